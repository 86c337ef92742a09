"""How the spatial frequencies are split between stamps and meshes, for a given accuracy.

The transfer function W is split by smooth low-pass filters G_0 > G_1 > ... of falling cut-off,

    W = W (1 - G_0)  +  W (G_0 - G_1)  +  W (G_1 - G_2)  +  ...

The first term is compact about each source, which is rendered alone on a stamp. Each of the
others belongs to a mesh whose cells are twice as wide as the one's before; its kernel reaches
twice as far, but always over the same number of cells. So the r^-3 wings of a diffraction PSF
and the wings of de Vaucouleurs galaxies are followed as far as they matter at a cost that
grows with the logarithm of the distance, and nothing wraps around. This is multilevel
summation (Skeel, Tezcan & Hardy 2002, J. Comput. Chem. 23, 673) with exact convolutions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from ..psf import RadialPSF
from .optics import Optics

Array = NDArray[np.float64]

# highest frequency used on a mesh, cycles per cell (0.5 would be its Nyquist frequency)
BAND = 0.35
# Rings fainter than this, over the peak of the source that makes them, are not followed: they
# reach over thousands of pixels.
FAINTEST_RINGS = 1e-10
# the same for the fine mesh, whose result is only wanted at the pixels
NEAR_BAND = 0.4


@dataclass(frozen=True)
class Plan:
    """Cells, filters and ranges for one transfer function and accuracy.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    digits : float
        Natural logarithm of the accuracy: errors are about exp(-digits) of what they belong to.
    ring_digits : float
        The same for the rings of a diffraction PSF about the scene's sharpest source; zero or
        less where they do not matter.
    cell : float
        Cell of the finest of the coarse meshes, pixels; a power of two, at least 1.
    near : {"", "mesh", "stamps"}
        What carries the frequencies above that mesh's band: nothing, a fine mesh or stamps.
    """

    optics: Optics
    digits: float
    ring_digits: float
    cell: float
    near: str

    @property
    def highest(self) -> float:
        """Frequency in cycles per pixel above which nothing passes."""
        return _highest(self.optics, self.digits)

    @property
    def near_unit(self) -> int:
        """The fine mesh's period is a multiple of this many pixels."""
        return 8

    @property
    def near_cell(self) -> float:
        """Cell of the fine mesh in pixels: a multiple of it is a pixel, and FFTs are quick."""
        least = int(np.ceil(self.near_unit * self.highest / NEAR_BAND))
        return self.near_unit / fft.next_fast_len(least, real=True)

    def near_spread(self) -> float:
        """Width in pixels of the Gaussian with which points are spread on the fine mesh."""
        return self.near_cell * _spread(self.digits, self.near_cell * self.highest)

    def without_rings(self) -> Plan:
        """Return the plan as far as filters depend on it: on the rings only reaches do."""
        return replace(self, ring_digits=0.0)

    def cell_size(self, level: int) -> float:
        """Cell of a mesh in pixels."""
        return self.cell * 2.0**level

    def lowpass(self, k: Array, level: int) -> Array:
        """G of a level at frequencies k; it vanishes above the band of that level's mesh."""
        if level == 0 and not self.near:
            return np.ones_like(k)
        width = self._width(level)
        passed: Array = 0.5 * special.erfc((k - 1.4 * np.sqrt(self.digits) * width) / width)
        return passed

    def _width(self, level: int) -> float:
        """Width of the error function at the filter's edge.

        The edge is centred so that both the filter beyond the band and the share of wide
        Gaussians that it leaves to the finer levels are below exp(-digits).
        """
        return float(BAND / self.cell_size(level) / (2.4 * np.sqrt(self.digits)))

    def spread(self) -> float:
        """Width in cells of the Gaussian with which points are spread on a coarse mesh."""
        return _spread(self.digits, BAND)

    def cut(self) -> float:
        """`spread_cut` for the plan's accuracy."""
        return float(spread_cut(self.digits))

    def taps(self) -> int:
        """Half-length in cells of the filter that interpolates from one mesh to the next finer.

        Kaiser's estimate for a transition of 1 - 2 BAND cycles per cell.
        """
        attenuation = self.attenuation()
        length = (attenuation - 7.95) / (2.285 * 2 * np.pi * (1 - 2 * BAND))
        return int(np.ceil(length / 2)) + 1

    def attenuation(self) -> float:
        """Attenuation of that filter in dB; its ripple adds up over the axes and levels."""
        return float(20 / np.log(10) * (self.digits + 2.5))

    def reach(self, level: int) -> float:
        """Distance in pixels to which a level's kernel is felt; level -1 is the stamps'."""
        return _reach(self, level)


def make_plan(
    optics: Optics,
    shape: tuple[int, int],
    accuracy: float,
    ring_accuracy: float,
    points: int,
    extended: int,
    sharp_edge: bool = False,
    meshes_only: bool = False,
) -> Plan:
    """Choose the meshes for a frame and a number of sources, by estimated run time.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    shape : (int, int)
        Frame in pixels.
    accuracy : float
        Error allowed over the brightest source's peak.
    ring_accuracy : float
        Error allowed over the amplitude of the sharpest source's rings.
    points, extended : int
        Numbers of sources.
    sharp_edge : bool
        Whether the transfer function ends at a sharp edge, see `direct`.
    meshes_only : bool
        Whether a source is too large for a stamp.
    """
    # a third of the error allowed, in half steps so that plans are shared
    digits = float(np.ceil(2 * np.log(3 / max(accuracy, 1e-15))) / 2)
    ring_digits = float(np.ceil(2 * np.log(10 / max(ring_accuracy, FAINTEST_RINGS))) / 2)
    ring_digits = max(ring_digits, 0.0)
    highest = _highest(optics, digits)
    if sharp_edge:
        # leave room between the meshes' band and the edge
        cell = 2.0 ** np.ceil(np.log2(BAND / (0.7 * highest)))
        return Plan(optics, digits, 0.0, max(cell, 1.0), near="stamps")
    if highest <= BAND:
        return Plan(optics, digits, ring_digits, 2.0 ** np.floor(np.log2(BAND / highest)), near="")
    mesh = Plan(optics, digits, ring_digits, 1.0, near="mesh")
    stamps = replace(mesh, near="stamps")
    if meshes_only or _mesh_seconds(mesh, shape, points) < _stamp_seconds(stamps, points, extended):
        return mesh
    return stamps


@lru_cache(maxsize=256)
def _highest(optics: Optics, digits: float) -> float:
    return max(optics.band_limit(0.1 * np.exp(-digits)), 1e-6)


def spread_cut(digits: float | Array) -> Array:
    """Distance in standard deviations at which a spread Gaussian may be cut.

    Dividing by the spreading Gaussian's transform amplifies the cut.
    """
    return np.sqrt(2 * 1.25 * np.asarray(digits))


def _spread(digits: float, band: float) -> float:
    """Width in cells of a Gaussian with which points are spread.

    Its aliases, exp(-2 pi^2 sigma^2 ((1 - band)^2 - band^2)), are below exp(-digits).
    """
    return float(np.sqrt(digits / (2 * np.pi**2 * (1 - 2 * band))))


def _mesh_seconds(plan: Plan, shape: tuple[int, int], points: int) -> float:
    """Rough run time of the fine mesh."""
    cell = plan.near_cell
    edge = plan.reach(-1) + 2 * plan.cut() * plan.near_spread()
    patch = (2 * plan.cut() * plan.near_spread() / cell) ** 2
    return 1.1e-8 * float(np.prod([(n + edge) / cell for n in shape])) + 3e-9 * points * patch


def _stamp_seconds(plan: Plan, points: int, extended: int) -> float:
    """Rough run time of the stamps."""
    pixels = 2 * plan.reach(-1) + 1
    modes = pixels * plan.highest
    product = 2e-10 * (pixels * modes**2 + pixels**2 * modes)
    return points * product + extended * (4 * product + 1e-7 * modes**2)


@lru_cache(maxsize=256)
def _reach(plan: Plan, level: int) -> float:
    # the filter's edge has the transform exp(-pi^2 width^2 r^2)
    window = float(np.sqrt(plan.digits) / (np.pi * plan._width(level + 1)))
    psf = plan.optics.psf
    if not isinstance(psf, RadialPSF):
        return window + plan.optics.extent
    edge = psf.first_edge() * plan.optics.pixel_scale
    highest = BAND / plan.cell_size(level) if level >= 0 else np.inf
    if plan.ring_digits <= 0 or edge > highest:
        return window
    return max(window, _ring_reach(plan, level, window))


def _ring_reach(plan: Plan, level: int, start: float) -> float:
    """Distance at which a kernel's rings are below the accuracy.

    The edges of the aperture and of its obscuration make rings that fall like r^-3 only. They
    are measured out to six times the filter's own reach, and beyond that follow their law.
    """
    r, envelope = _rings(plan.without_rings(), level, start)
    allowed = 0.3 * np.exp(-plan.ring_digits)
    below = np.flatnonzero(envelope <= allowed)
    if below.size:
        return float(r[below[0]])
    return float(r[-1] * (envelope[-16] / allowed) ** (1 / 3))


@lru_cache(maxsize=64)
def _rings(plan: Plan, level: int, start: float) -> tuple[Array, Array]:
    """Radii in pixels and the largest amplitude of a level's kernel beyond each.

    The amplitude is over a point source's peak; the kernel is the Hankel transform of its
    filter.
    """
    psf = plan.optics.psf
    assert isinstance(psf, RadialPSF)
    limit = plan.highest
    r = start * np.geomspace(1.0, 6.0, 160)
    # Gauss-Legendre on panels of less than two oscillations each
    x, w = np.polynomial.legendre.leggauss(16)
    panels = int(limit * r[-1]) + 8
    k = ((np.arange(panels)[:, None] + 0.5 * (x + 1)) * (limit / panels)).ravel()
    weight = np.tile(w, panels)
    measure = weight * k * psf.otf(k / plan.optics.pixel_scale)
    # for the peak, the pixel as a Gaussian of the same variance
    peak = abs(np.sum(measure * np.exp(-(np.pi**2) * k**2 / 6)))
    # a ring is averaged least in the direction of the pixel's sides: the envelope of sinc(k)
    measure /= np.sqrt(1 + (np.pi * k) ** 2)
    passed = np.ones_like(k) if level < 0 else plan.lowpass(k, level)
    band = measure * (passed - plan.lowpass(k, level + 1))
    kernel = np.abs(special.j0(2 * np.pi * np.outer(r, k)) @ band) / peak
    return r, np.maximum.accumulate(kernel[::-1])[::-1]

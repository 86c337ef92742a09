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
from scipy import special

from ..psf import RadialPSF
from .optics import Optics

Array = NDArray[np.float64]

# highest frequency used on a mesh, cycles per cell (0.5 would be its Nyquist frequency)
BAND = 0.35
# Rings fainter than this, over the peak of the source that makes them, are not followed: they
# reach over thousands of pixels.
FAINTEST_RINGS = 1e-10
# points of a mesh (0.4 GB) above which stamps are preferred
COMFORTABLE_MESH = 5e7


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
        Cell of the finest mesh, pixels; a power of two.
    stamps : bool
        Whether frequencies above the finest mesh's band are left to stamps.
    """

    optics: Optics
    digits: float
    ring_digits: float
    cell: float
    stamps: bool

    def without_rings(self) -> Plan:
        """Return the plan as far as filters depend on it: on the rings only reaches do."""
        return replace(self, ring_digits=0.0)

    def cell_size(self, level: int) -> float:
        """Cell of a mesh in pixels."""
        return self.cell * 2.0**level

    def lowpass(self, k: Array, level: int) -> Array:
        """G of a level at frequencies k; it vanishes above the band of that level's mesh."""
        if level == 0 and not self.stamps:
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
        """Width in cells of the Gaussian with which points are spread on a mesh.

        Its aliases, exp(-2 pi^2 sigma^2 ((1 - BAND)^2 - BAND^2)), are below exp(-digits).
        """
        return float(np.sqrt(self.digits / (2 * np.pi**2 * (1 - 2 * BAND))))

    def plain(self) -> float:
        """Width in cells from which a Gaussian is band-limited on a mesh by itself."""
        return float(np.sqrt(self.digits / 2) / (np.pi * BAND))

    def cut(self) -> float:
        """Distance in standard deviations at which a painted Gaussian is cut.

        Dividing by the spreading Gaussian's transform amplifies the cut.
        """
        return float(np.sqrt(2 * 1.25 * self.digits))

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
    # a third of the error allowed, in quarter steps so that plans are shared
    digits = float(np.ceil(4 * np.log(3 / max(accuracy, 1e-15))) / 4)
    ring_digits = float(np.ceil(2 * np.log(10 / max(ring_accuracy, FAINTEST_RINGS))) / 2)
    ring_digits = max(ring_digits, 0.0)
    highest = max(optics.band_limit(0.1 * np.exp(-digits)), 1e-6)
    if sharp_edge:
        # leave room between the meshes' band and the edge
        cell = 2.0 ** np.ceil(np.log2(BAND / (0.7 * highest)))
        return Plan(optics, digits, 0.0, max(cell, 0.5), stamps=True)
    finest = 2.0 ** np.floor(np.log2(BAND / highest))
    meshes = Plan(optics, digits, ring_digits, finest, stamps=False)
    if finest >= 0.5 or meshes_only:
        return meshes
    stamps = Plan(optics, digits, ring_digits, 0.5, stamps=True)
    if _seconds(meshes, shape, points, extended) < _seconds(stamps, shape, points, extended):
        return meshes
    return stamps


def _seconds(plan: Plan, shape: tuple[int, int], points: int, extended: int) -> float:
    """Rough run time on one core."""
    reach = plan.reach(0)
    mesh = float(np.prod([(n + reach) / plan.cell for n in shape]))
    seconds = 3e-8 * mesh + 1e-8 * points * (2 * plan.cut() * plan.spread()) ** 2
    if mesh > COMFORTABLE_MESH:
        seconds *= mesh / COMFORTABLE_MESH
    if plan.stamps:
        pixels = 2 * plan.reach(-1) + 1
        modes = pixels * plan.optics.band_limit(0.1 * np.exp(-plan.digits))
        product = 2e-10 * (pixels * modes**2 + pixels**2 * modes)
        seconds += points * product + extended * (4 * product + 1e-7 * modes**2)
    return seconds


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
    limit = plan.optics.band_limit(0.1 * np.exp(-plan.digits))
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

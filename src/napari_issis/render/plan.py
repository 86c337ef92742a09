"""How the spatial frequencies are split between meshes, for a given accuracy.

The transfer function W is split by smooth low-pass filters G_0 > G_1 > ... of falling cut-off,

    W = W (1 - G_0)  +  W (G_0 - G_1)  +  W (G_1 - G_2)  +  ...

The first term is compact about each source: one fine mesh carries it (`near`) or, where sources
are few, a stamp for each of them (`stamps`). Each of the others belongs to a mesh whose cells
are twice as wide as the one's before; its kernel reaches twice as far, but always over the same
number of cells. So the r^-3 wings of a diffraction PSF and the wings of de Vaucouleurs galaxies
are followed as far as they matter at a cost that grows with the logarithm of the distance, and
nothing wraps around. This is multilevel summation (Skeel, Tezcan & Hardy 2002, J. Comput. Chem.
23, 673) with exact convolutions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from .fine_mesh import fine_meshes
from .optics import Optics
from .rings import end_fade, fading, first_edge, ring_fade, ring_reach, wrap_fade, wrap_fading
from .spreading import spread, spread_cut

Array = NDArray[np.float64]

# highest frequency used on a mesh, cycles per cell (0.5 would be its Nyquist frequency)
BAND = 0.35
# rings are cut at multiples of this distance in pixels, so that filters are shared
RING_STEP = 64.0


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
    ring_cut : float
        Distance in pixels behind which rings may be cut; inf where they are followed.
    ring_fade : float
        Argument of the error function with which the cut begins and ends: what it changes is
        exp(-ring_fade^2) of the rings there.
    ring_width : float
        Width of that error function, pixels.
    seen : (float, float)
        Largest distances in pixels, along y and x, between a pixel and a source.
    wrap_fade : float
        Argument of the error function with which the fine mesh's kernel fades out beyond
        ``seen``, so that it may wrap around; zero if it must not.
    """

    optics: Optics
    digits: float
    ring_digits: float
    cell: float
    near: str
    ring_cut: float = np.inf
    ring_fade: float = 0.0
    ring_width: float = 1.0
    seen: tuple[float, float] = (np.inf, np.inf)
    wrap_fade: float = 0.0

    @property
    def highest(self) -> float:
        """Frequency in cycles per pixel above which nothing passes."""
        highest = _highest(self.optics, self.digits)
        if self.ring_cut < np.inf:
            cut = self.ring_fade / self.ring_width
            wrap = self.wrap_fade / wrap_fading(self.optics)
            highest += max(cut, wrap) / np.pi
        return highest

    @property
    def wraps(self) -> bool:
        """Whether the fine mesh's kernel wraps around where nobody looks."""
        return self.wrap_fade > 0

    @property
    def compact(self) -> Plan:
        """The plan with its rings cut at once, so that the fine mesh's kernel ends soon."""
        return replace(
            self,
            ring_cut=0.0,
            ring_fade=end_fade(self, -1, self.without_rings(-1)),
            ring_width=wrap_fading(self.optics),
            seen=(np.inf, np.inf),
            wrap_fade=0.0,
        )

    @property
    def filters(self) -> Plan:
        """The plan as far as filters depend on it: what else it holds is for reaches only."""
        return replace(self, ring_digits=0.0, seen=(np.inf, np.inf))

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
        return spread(self.digits, BAND)

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
        """Distance in pixels to which a level's kernel is felt; level -1 is the fine mesh's."""
        reach = self.without_rings(level)
        if self.ring_digits > 0 and self._has_rings(level):
            reach = max(reach, min(_ring_reach(self, level), self.ring_end(level)))
        return reach

    def cuts_rings(self, level: int) -> bool:
        """Whether a level's rings are cut behind the farthest pixel."""
        return self._has_rings(level) and self.ring_cut < np.inf

    def ring_begin(self, level: int) -> float:
        """Distance in pixels at which the cut of a level's rings begins."""
        cell = self.cell_size(level) if level >= 0 else 0.0
        margin = 4 * self.taps() * cell if cell > 1 else 0.0
        return max(self.ring_cut + margin, self.without_rings(level))

    def ring_end(self, level: int) -> float:
        """Distance in pixels at which a level's rings have been cut."""
        return self.ring_begin(level) + 2 * self.ring_fade * self.ring_width

    def ringing(self) -> list[int]:
        """Levels whose kernels have rings."""
        return [j for j in range(-1 if self.near else 0, 3) if self._has_rings(j)]

    def rings_end(self) -> float:
        """Distance in pixels to which any level's kernel is felt that has rings or is finest."""
        levels = {*self.ringing(), -1 if self.near else 0}
        return max(self.reach(j) for j in levels)

    def without_rings(self, level: int) -> float:
        """`reach` apart from rings."""
        # the filter's edge has the transform exp(-pi^2 width^2 r^2)
        reach = np.sqrt(self.digits) / (np.pi * self._width(level + 1))
        return float(reach) + self.optics.extent

    def _has_rings(self, level: int) -> bool:
        highest = BAND / self.cell_size(level) if level >= 0 else np.inf
        edge = first_edge(self.optics)
        if not edge < np.inf or edge > highest:
            return False
        # Where a blur has put the light out well below an edge, that makes no rings. (Without a
        # blur the light fades towards the edge itself.)
        return 0.7 * edge <= _highest(self.optics, max(self.digits, self.ring_digits))


@lru_cache(maxsize=256)
def _ring_reach(plan: Plan, level: int) -> float:
    return ring_reach(plan, level, plan.without_rings(level))


def make_plan(
    optics: Optics,
    shape: tuple[int, int],
    accuracy: float,
    ring_accuracy: float,
    distances: Callable[[float], tuple[float, tuple[float, float]]],
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
        Error allowed in the rings over the peak of the source that has the strongest.
    distances : callable
        Takes how far outside the frame sources may be felt, in pixels, and returns the largest
        distance between a pixel and one of those whose rings matter, and the largest distances
        along y and x between a pixel and any of those.
    points, extended : int
        Numbers of sources.
    sharp_edge : bool
        Whether the transfer function ends at a sharp edge, see `direct`.
    meshes_only : bool
        Whether a source is too large for a stamp.
    """
    # a third of the error allowed, in half steps so that plans are shared
    digits = float(np.ceil(2 * np.log(3 / max(accuracy, 1e-15))) / 2)
    ring_digits = max(float(np.ceil(-2 * np.log(max(ring_accuracy, 1e-15))) / 2), 0.0)
    highest = _highest(optics, digits)
    if sharp_edge:
        # leave room between the meshes' band and the edge
        cell = 2.0 ** np.ceil(np.log2(BAND / (0.7 * highest)))
        return Plan(optics, digits, 0.0, max(cell, 1.0), near="stamps")
    if highest <= BAND:
        cell = 2.0 ** np.floor(np.log2(BAND / highest))
        wide = Plan(optics, digits, ring_digits, cell, near="")
        farthest, _ = distances(wide.rings_end())
        wide = _with_rings_cut(wide, farthest)
        if wide.highest <= BAND / cell:
            return wide
        if cell > 1:
            wide = Plan(optics, digits, ring_digits, cell / 2, near="")
            return _with_rings_cut(wide, farthest)
    mesh = Plan(optics, digits, ring_digits, 1.0, near="mesh")
    farthest, seen = distances(mesh.rings_end())
    mesh = _with_rings_cut(mesh, farthest)
    stamps = replace(mesh, near="stamps")
    shorter = any(2 * d < n + mesh.reach(-1) for d, n in zip(seen, shape, strict=True))
    if shorter and mesh._has_rings(-1) and not meshes_only:
        wrapped = _wrapped(mesh, seen)
        if _mesh_seconds(wrapped, shape, points) < _mesh_seconds(mesh, shape, points):
            mesh = wrapped
    if meshes_only or _mesh_seconds(mesh, shape, points) < _stamp_seconds(stamps, points, extended):
        return mesh
    return stamps


def _with_rings_cut(plan: Plan, farthest: float, *, always: bool = False) -> Plan:
    """Cut the rings of a plan, by default only if they reach further than needed."""
    cut = RING_STEP * float(np.ceil(farthest / RING_STEP))
    levels = plan.ringing()
    faded = all(_ring_reach(plan, j) <= max(cut, plan.without_rings(j)) for j in levels)
    if faded and not always:
        return plan
    plan = replace(plan, ring_cut=cut, ring_width=fading(plan.optics))
    fade = max(ring_fade(plan, j, plan.without_rings(j), plan.ring_begin(j)) for j in levels)
    return replace(plan, ring_fade=0.5 * float(np.ceil(2 * max(fade, 1.0))))


def _wrapped(plan: Plan, seen: tuple[float, float]) -> Plan:
    """Let the fine mesh's kernel wrap around beyond the distances seen.

    The rings are cut beyond these in any case, so that the kernel comes to an end.
    """
    plan = _with_rings_cut(replace(plan, ring_cut=np.inf), float(np.hypot(*seen)), always=True)
    fade = wrap_fade(plan, -1, plan.without_rings(-1), min(seen))
    return replace(plan, seen=seen, wrap_fade=0.25 * float(np.ceil(4 * max(fade, 1.0))))


@lru_cache(maxsize=256)
def _highest(optics: Optics, digits: float) -> float:
    return max(optics.band_limit(0.1 * np.exp(-digits)), 1e-6)


def _mesh_seconds(plan: Plan, shape: tuple[int, int], points: int) -> float:
    """Rough run time of the fine meshes, on two cores."""
    seconds = 0.0
    for mesh in fine_meshes(plan):
        edge = mesh.cut * mesh.spread
        periods = [mesh.period(i, n, -edge, n - 1 + edge) for i, n in enumerate(shape)]
        patch = (2 * edge / mesh.cell) ** 2
        transform = 0.9e-8 if mesh.apart is None else 0.5e-8
        seconds += transform * float(np.prod(periods)) / mesh.cell**2 + 3e-9 * points * patch
    return seconds


def _stamp_seconds(plan: Plan, points: int, extended: int) -> float:
    """Rough run time of the stamps."""
    pixels = 2 * plan.reach(-1) + 1
    modes = pixels * plan.highest
    product = 2e-10 * (pixels * modes**2 + pixels**2 * modes)
    return points * product + extended * (2e-3 + 4 * product + 1e-7 * modes**2)

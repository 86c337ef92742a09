"""The frequencies that coarse meshes carry: paint, transform, filter, pass on, add up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..sources import SourceArrays
from .compiled_painting import Painter
from .discs import disc_half_sizes, paint_discs, paint_large_discs
from .gaussians import Gaussians
from .interpolation import Span, add_up, spans
from .near import paint_near
from .optics import Transfer
from .painting import half_patch, half_patches, paint, scene_painter
from .plan import BAND, Plan
from .rings import Band, band_transfer
from .spreading import FEWEST_CUT_DIGITS, spread_cut
from .threads import alongside

# Uniform ellipses wider than this, in pixels, are painted on every mesh as far as they lie on it,
# instead of once and whole.
LARGEST_DISC = 400.0
# share of the error allowed that each Gaussian may take where it is cut or sampled
SHARE = 0.02
# Meshes of fewer points are transformed by one thread: the others would have to be woken, or are
# at work on the fine mesh.
FEWEST_FOR_THREADS = 2e6

Array = NDArray[np.float64]
Spectrum = NDArray[np.complex128]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Axis:
    """One axis of a level's mesh.

    ``start`` is the position in pixels of the first of ``count`` points, ``content`` the
    interval that holds everything painted, ``frame`` the first and last mesh index (from
    position 0) at which the result is wanted.
    """

    start: float
    count: int
    content: Interval
    frame: Span


@dataclass(frozen=True, eq=False)
class Density:
    """Density passed on to the next level, on that level's mesh points in two intervals."""

    values: Array
    intervals: tuple[Interval, Interval]


@dataclass(frozen=True, eq=False)
class _Content:
    """What a mesh is painted with."""

    plain: Gaussians
    plain_digits: Array
    spread: Gaussians
    spread_digits: Array
    discs: SourceArrays
    disc_rate: Array
    large: SourceArrays
    large_rate: Array
    passed: Density | None
    compiled: Painter | None


def mesh_rate(
    plan: Plan,
    shape: tuple[int, int],
    gaussians: Gaussians,
    discs: SourceArrays,
    disc_rate: Array,
    allowed: float,
) -> Array:
    """Count rate, up to the frequencies that stamps do not carry.

    Parameters
    ----------
    plan : Plan
        Cells and filters.
    shape : (int, int)
        Frame (ny, nx) in pixels.
    gaussians : Gaussians
        Points and smooth profiles.
    discs : SourceArrays
        Uniform ellipses.
    disc_rate : ndarray
        Their count rates.
    allowed : float
        Error allowed, cps per pixel.

    Returns
    -------
    ndarray, shape (ny, nx)
    """
    if not len(gaussians) and not len(discs):
        return np.zeros(shape)
    is_large = discs.r_half > LARGEST_DISC
    large, large_rate = discs.take(is_large), disc_rate[is_large]
    discs, disc_rate = discs.take(~is_large), disc_rate[~is_large]
    digits = _digits(plan, gaussians, allowed)
    own = _own_levels(plan, gaussians, digits)
    half = (plan.cut() * np.sqrt(gaussians.yy), plan.cut() * np.sqrt(gaussians.xx))
    near = (own < 0) & (_outside(shape, gaussians.y, gaussians.x, half) <= plan.reach(-1))
    level_of = _first_in_reach(plan, shape, gaussians.y, gaussians.x, half, np.maximum(own, 0))
    plain = level_of == own
    disc_level = _first_in_reach(
        plan, shape, discs.y, discs.x, disc_half_sizes(discs), np.zeros(len(discs), dtype=np.intp)
    )
    total = float(sum(np.abs(r).sum() for r in (gaussians.rate, disc_rate, large_rate)))
    top = max(int(level_of.max(initial=0)), int(disc_level.max(initial=0)))
    while _wings(plan, top, shape, total) > 0.03 * allowed or plan.cuts_rings(top):
        top += 1
    compiled = scene_painter(gaussians, digits)
    near_image: Callable[[], Array] | None = None
    close = _outside(shape, discs.y, discs.x, disc_half_sizes(discs)) <= plan.reach(-1)
    if plan.near == "mesh" and (near.any() or close.any() or len(large)):
        sharp = (gaussians.take(near), digits[near], discs.take(close), disc_rate[close])
        near_image = alongside(paint_near(plan, shape, *sharp, large, large_rate, compiled))
    results: list[Array | None] = []
    passed: Density | None = None
    for level, frame in enumerate(spans(plan, shape, top + 1)):
        mine, my_discs = level_of == level, disc_level == level
        mesh = _Mesh(
            plan,
            level,
            level == top,
            frame,
            _Content(
                plain=gaussians.take(mine & plain),
                plain_digits=digits[mine & plain],
                spread=gaussians.take(mine & ~plain),
                spread_digits=digits[mine & ~plain],
                discs=discs.take(my_discs),
                disc_rate=disc_rate[my_discs],
                large=large,
                large_rate=large_rate,
                passed=passed,
                compiled=compiled,
            ),
        )
        if mesh.empty:
            results.append(None)
            continue
        here, onward = mesh.transform()
        results.append(mesh.rate(here))
        passed = None if onward is None else mesh.pass_on(onward)
    image = add_up(plan, results, shape)
    if near_image is not None:
        image += near_image()
    return image


def _digits(plan: Plan, gaussians: Gaussians, allowed: float) -> Array:
    """Natural logarithm of the accuracy that each Gaussian needs: faint ones need less."""
    # where many overlap, it is their sum that is seen
    height = np.abs(gaussians.rate) / np.minimum(
        plan.optics.point_area + 2 * np.pi * gaussians.minor * gaussians.major,
        gaussians.pitch**2,
    )
    with np.errstate(divide="ignore"):
        digits: Array = np.log(height / (SHARE * allowed))
    return np.clip(digits, FEWEST_CUT_DIGITS, plan.digits)


def _own_levels(plan: Plan, gaussians: Gaussians, digits: Array) -> NDArray[np.intp]:
    """Coarsest level whose mesh holds each Gaussian's spectrum; -1 if there is none.

    On a mesh of whole pixels the spectrum may go up to the Nyquist frequency, on coarser ones as
    far as they are interpolated.
    """
    width = gaussians.minor * np.pi / np.sqrt(digits / 2) / plan.cell
    level = np.full(width.shape, -1, dtype=np.intp)
    if plan.near and plan.cell == 1:
        level[width >= 2.0] = 0
    with np.errstate(divide="ignore"):
        coarse = np.floor(np.log2(width * BAND))
    level = np.maximum(level, np.maximum(coarse, -1).astype(np.intp))
    level[level == 0] = 0 if plan.near else -1
    return level


def _first_in_reach(
    plan: Plan,
    shape: tuple[int, int],
    y: Array,
    x: Array,
    half: tuple[Array, Array],
    level: NDArray[np.intp],
) -> NDArray[np.intp]:
    """Raise levels until what lies at (y, x) is felt in the frame."""
    away = _outside(shape, y, x, half)
    level = level.copy()
    while True:
        reach = np.array([_reach(plan, j) for j in range(int(level.max(initial=0)) + 1)])
        beyond = away > reach[level]
        if not beyond.any():
            return level
        level[beyond] += 1


def _outside(shape: tuple[int, int], y: Array, x: Array, half: tuple[Array, Array]) -> Array:
    """Distance in pixels along the axes of what has half-sizes ``half`` from the frame."""
    away: Array = np.maximum.reduce(
        [
            -(y + half[0]),
            y - half[0] - (shape[0] - 1),
            -(x + half[1]),
            x - half[1] - (shape[1] - 1),
            np.zeros_like(y),
        ]
    )
    return away


def _reach(plan: Plan, level: int) -> float:
    """Reach of a level's kernel as felt in the frame and the margin that interpolation needs."""
    cell = plan.cell_size(level)
    return plan.reach(level) + (2 * plan.taps() * cell if cell > 1 else 0.0)


def _wings(plan: Plan, top: int, shape: tuple[int, int], total: float) -> float:
    """Light per pixel that periodic images would leave if ``top`` were the last level.

    The share of a source's light further away than a period P is about 1 - |OTF(1/P)|.
    """
    period = max(shape) + 2 * plan.reach(top)
    otf = plan.optics.transfer(np.array([0.0]), np.array([1 / period]))[0, 0]
    return float(total * 4 * abs(1 - abs(otf)) / period**2)


class _Mesh:
    """One mesh: what is painted on it, its transform and its contribution."""

    def __init__(
        self, plan: Plan, level: int, last: bool, frame: tuple[Span, Span], content: _Content
    ) -> None:
        self.plan, self.level, self.last = plan, level, last
        self.cell = plan.cell_size(level)
        plain, spread, passed = content.plain, content.spread, content.passed
        discs, large = content.discs, content.large
        count = len(plain) + len(spread) + len(discs) + len(large)
        self.empty = passed is None and count == 0
        if self.empty:
            return
        sigma, cut = plan.spread() * self.cell, plan.cut()
        cut_plain, cut_spread = np.sqrt(2 * content.plain_digits), spread_cut(content.spread_digits)
        disc_half = disc_half_sizes(discs)
        axes = []
        for axis in (0, 1):
            low, high = frame[axis][0] * self.cell, frame[axis][1] * self.cell
            reach = plan.reach(level)
            # the same for all scenes that lie in the frame, so that filters can be kept
            edge = self.cell * (half_patch(sigma**2, self.cell, cut) + 1.0)
            edge += reach if len(large) else 0.0
            extent = [low - edge, high + edge]
            for centre, half in (
                (
                    (plain.y, plain.x)[axis],
                    self.cell
                    * (half_patches((plain.yy, plain.xx)[axis], self.cell, cut_plain) + 1),
                ),
                (
                    (spread.y, spread.x)[axis],
                    self.cell
                    * (
                        half_patches((spread.yy, spread.xx)[axis] + sigma**2, self.cell, cut_spread)
                        + 1
                    ),
                ),
                ((discs.y, discs.x)[axis], disc_half[axis] * 1.1 + cut * sigma + 12 * self.cell),
            ):
                if centre.size:
                    extent[0] = min(extent[0], float((centre - half).min()))
                    extent[1] = max(extent[1], float((centre + half).max()))
            if passed is not None:
                extent[0] = min(extent[0], passed.intervals[axis][0])
                extent[1] = max(extent[1], passed.intervals[axis][1])
            axes.append(
                _axis(
                    (extent[0], extent[1]),
                    frame[axis],
                    reach,
                    self.cell,
                    0.0 if self.last else 2 * sigma * cut,
                )
            )
        self.axes = (axes[0], axes[1])
        self.shape = (axes[0].count, axes[1].count)
        self.workers = -1 if np.prod(self.shape) >= FEWEST_FOR_THREADS else 1
        start = (axes[0].start, axes[1].start)
        self.plain_mesh: Array | None = None
        self.low_mesh: Array | None = None
        self.large_mesh: Array | None = None
        if len(large):
            self.large_mesh = np.zeros(self.shape)
            paint_large_discs(
                self.large_mesh, start, self.cell, large, content.large_rate, sigma, plan.digits
            )
        if len(plain):
            self.plain_mesh = np.zeros(self.shape)
            paint(self.plain_mesh, start, self.cell, plain, 0.0, cut_plain, content.compiled)
        if len(spread) or len(discs) or passed is not None:
            self.low_mesh = np.zeros(self.shape)
            paint(self.low_mesh, start, self.cell, spread, sigma, cut_spread, content.compiled)
            paint_discs(
                self.low_mesh, start, self.cell, discs, content.disc_rate, sigma, plan.digits
            )
            if passed is not None:
                y, x = (round((passed.intervals[a][0] - start[a]) / self.cell) for a in (0, 1))
                rows, columns = passed.values.shape
                self.low_mesh[y : y + rows, x : x + columns] += passed.values

    def transform(self) -> tuple[Spectrum, Spectrum | None]:
        """Transform of the contribution, and that of the density to pass on, if there is any."""
        spectrum: Spectrum | None = None
        onward: Spectrum | None = None
        if self.low_mesh is not None:
            transformed = fft.rfft2(self.low_mesh, workers=self.workers)
            self.low_mesh = None  # the largest array of all
            spectrum = transformed * self._filter(spread=True)
            if not self.last:
                more_y, more_x = self._widening(2.0, 1.0)
                transformed *= more_y[:, None]
                transformed *= more_x
                onward = transformed
        if self.plain_mesh is not None:
            transformed = fft.rfft2(self.plain_mesh, workers=self.workers)
            filtered = transformed * self._filter(spread=False)
            spectrum = filtered if spectrum is None else spectrum + filtered
            if not self.last:
                next_y, next_x = self._widening(2.0, 0.0)
                transformed *= next_y[:, None]
                transformed *= next_x
                onward = transformed if onward is None else onward + transformed
        if self.large_mesh is not None:
            filtered = fft.rfft2(self.large_mesh, workers=self.workers) * self._filter(spread=True)
            spectrum = filtered if spectrum is None else spectrum + filtered
        assert spectrum is not None
        return spectrum, onward

    def _filter(self, *, spread: bool) -> Transfer:
        return _filter(self.plan.filters, self.level, self.last, self.shape, spread)

    def _widening(self, to: float, already: float) -> tuple[Array, Array]:
        """Transform of the Gaussian that widens from ``already`` to ``to`` cells' spreading."""
        sigma2 = (self.plan.spread() * self.cell) ** 2 * (to**2 - already**2)
        ky, kx = fft.fftfreq(self.shape[0], self.cell), fft.rfftfreq(self.shape[1], self.cell)
        return np.exp(-2 * np.pi**2 * sigma2 * ky**2), np.exp(-2 * np.pi**2 * sigma2 * kx**2)

    def rate(self, spectrum: Spectrum) -> Array:
        """Contribution at the mesh points of the frame."""
        values = fft.irfft2(spectrum, self.shape, workers=self.workers)
        index = []
        for axis, count in zip(self.axes, self.shape, strict=True):
            begin = round(axis.start / self.cell)
            index.append((np.arange(axis.frame[0], axis.frame[1] + 1) - begin) % count)
        wanted: Array = values[np.ix_(*index)]
        return wanted

    def pass_on(self, onward: Spectrum) -> Density:
        """Density for the next level, spread for it and sampled on its mesh."""
        ny, nx = self.shape
        density = fft.irfft2(fold(onward, ny, nx), (ny // 2, nx // 2), workers=self.workers)
        room = 2 * self.plan.spread() * self.cell * self.plan.cut()
        index, intervals = [], []
        for axis in self.axes:
            first = int(np.ceil((axis.content[0] - room) / (2 * self.cell)))
            last = int(np.floor((axis.content[1] + room) / (2 * self.cell)))
            begin = round(axis.start / (2 * self.cell))
            index.append(np.arange(first - begin, last + 1 - begin) % (axis.count // 2))
            intervals.append((first * 2 * self.cell, last * 2 * self.cell))
        return Density(density[np.ix_(*index)], (intervals[0], intervals[1]))


def _axis(content: Interval, frame: Span, reach: float, cell: float, room: float) -> Axis:
    """Lay out an axis so that neither the kernel nor what is passed on wraps into the frame."""
    step = 2 * cell  # on a point of the next mesh
    start = step * np.floor((content[0] - room) / step)
    need = max(
        content[1] + room - start,
        frame[1] * cell + reach - content[0],
        content[1] + reach - frame[0] * cell,
    )
    count = 2 * fft.next_fast_len(int(np.ceil((need / cell + 1) / 2)), real=True)
    return Axis(float(start), int(count), content, frame)


@lru_cache(maxsize=48)
def _filter(plan: Plan, level: int, last: bool, shape: tuple[int, int], spread: bool) -> Transfer:
    """Filter of a mesh, for what is spread on it or for what is painted as it is."""
    cell = plan.cell_size(level)
    ky, kx = fft.fftfreq(shape[0], cell), fft.rfftfreq(shape[1], cell)
    # spreading is not taken back beyond the band, and the mesh resolves nothing beyond 0.5
    limit = (BAND if spread else 0.5) / cell
    rows = np.arange(shape[0])
    if plan.optics.radial:
        # even in ky: half of the rows hold everything
        rows = np.minimum(rows, shape[0] - rows)
        ky = np.abs(ky[: shape[0] // 2 + 1])
    # with stamps, level 0 has lost its highest frequencies to them
    first = level if spread else (0 if plan.near == "stamps" else -1)
    filtered = band_transfer(plan, Band(level, first, None if last else level + 1), ky, kx, limit)
    if spread:
        sigma = plan.spread() * cell
        filtered *= np.exp(2 * (np.pi * sigma * ky) ** 2)[:, None]
        filtered *= np.exp(2 * (np.pi * sigma * kx) ** 2)
    return filtered[rows]


def fold(spectrum: Spectrum, ny: int, nx: int) -> Spectrum:
    """Half-spectrum of the real array that keeps every second point of either axis.

    Parameters
    ----------
    spectrum : ndarray, shape (ny, nx // 2 + 1)
        `rfft2` of a real array of shape (ny, nx), both even.
    """
    rows, m = ny // 2, nx // 2
    folded = spectrum[:rows] + spectrum[rows:]
    low = folded[:, : m // 2 + 1]
    high = folded[:, m - m // 2 : m + 1][:, ::-1]
    mirrored = np.roll(high[::-1], 1, axis=0).conj()
    result: Spectrum = 0.25 * (low + mirrored)
    return result

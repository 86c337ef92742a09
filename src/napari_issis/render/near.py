"""The frequencies above the coarse meshes' band, on fine meshes that cover the frame.

What is too sharp for a mesh of whole pixels, points, cusps and edges, is painted on a mesh fine
enough for every frequency that the PSF passes. Its transform is filtered and *folded* to the
pixel rate, aliases summed, which is what a pixel-sampled image of an undersampled PSF is, and
inverted at that rate only.
"""

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
from .fine_mesh import NEAR_UNIT, FineMesh, fine_meshes
from .folding import fold_half, fold_rows
from .gaussians import Gaussians
from .optics import Transfer
from .painting import half_patch, half_patches, paint
from .plan import Plan
from .rings import Band, band_transfer, first_edge
from .spreading import FEWEST_CUT_DIGITS, spread_cut
from .threads import for_each, pieces
from .wrapping import wrapped_transfer

Array = NDArray[np.float64]

# points of the mesh, some 5 GB of memory in all
LARGEST_MESH = 5e8
# the fine mesh's share of the frequencies
NEAR = Band(-1, -1, 0)
# Natural logarithm of the accuracy needed in a Gaussian's rings below which they are left out
FEWEST_RING_DIGITS = 0.0


@dataclass(frozen=True)
class Axis:
    """One axis: position of the first point, period in pixels, points, and kept frequencies.

    Only the first ``painted`` of the ``count`` points may hold anything. The frequencies are the
    multiples of 1 / period from 0 to ``modes``.
    """

    start: int
    period: int
    count: int
    painted: int
    modes: int


def paint_near(
    plan: Plan,
    shape: tuple[int, int],
    gaussians: Gaussians,
    digits: Array,
    discs: SourceArrays,
    disc_rate: Array,
    large: SourceArrays,
    large_rate: Array,
    compiled: Painter | None,
) -> Callable[[], Array]:
    """Paint the fine meshes; the function returned transforms them.

    Parameters
    ----------
    plan : Plan
        Filters and ranges.
    shape : (int, int)
        Frame (ny, nx) in pixels.
    gaussians : Gaussians
        Points and narrow Gaussians that are felt in the frame.
    digits : ndarray
        Natural logarithms of their accuracies.
    discs, large : SourceArrays
        Uniform ellipses that are felt in the frame, and such as are painted only as far as
        they lie on the mesh.
    disc_rate, large_rate : ndarray
        Their count rates.
    compiled : callable or None
        What paints (`scene_painter`).

    Returns
    -------
    callable
        Returns the count rate above the coarse meshes' frequencies, shape (ny, nx).

    Raises
    ------
    ValueError
        If the mesh would not fit into memory.
    """
    image: Array | None = None
    *first, last = fine_meshes(plan)
    parts = (gaussians, digits, discs, disc_rate, large, large_rate, compiled)
    for mesh in first:
        part = _at_pixels(*_painted(mesh, shape, *parts), shape)
        image = part if image is None else image + part
    painted = [_painted(last, shape, *parts)]

    def near_rate() -> Array:
        # taken out of the list: its memory is free before the result is asked for
        rate = _at_pixels(*painted.pop(), shape)
        return rate if image is None else rate + image

    return near_rate


def _painted(
    mesh: FineMesh,
    shape: tuple[int, int],
    gaussians: Gaussians,
    digits: Array,
    discs: SourceArrays,
    disc_rate: Array,
    large: SourceArrays,
    large_rate: Array,
    compiled: Painter | None,
) -> tuple[Array, Axis, Axis, Transfer]:
    """Rows of one fine mesh, its axes and its filter."""
    plan = mesh.plan
    if mesh.apart is not None:
        digits = digits - (plan.digits - mesh.digits)
        ringing = digits - _smoothing(plan, gaussians) > FEWEST_RING_DIGITS
        gaussians, digits = gaussians.take(ringing), digits[ringing]
    cut = spread_cut(np.maximum(digits, FEWEST_CUT_DIGITS))
    y, x = _axes(mesh, shape, gaussians, cut, discs, bool(len(large)))
    if y.count * x.count > LARGEST_MESH:
        raise ValueError(
            f"this frame, PSF and accuracy need a mesh of {y.count} x {x.count} points, more than "
            "fits into memory; choose a smaller frame, a larger tolerance or a wider PSF."
        )
    filtered = _filter(mesh.filters, y.period, x.period)
    # room for the transform of each row in its own place
    rows = np.zeros((y.painted, 2 * (x.count // 2 + 1)), mesh.dtype)
    points = rows[:, : x.painted]
    start, cell, spread = (float(y.start), float(x.start)), mesh.cell, mesh.spread
    paint(rows, start, cell, gaussians, spread, cut, compiled)
    paint_discs(points, start, cell, discs, disc_rate, spread, mesh.digits)
    if len(large):
        paint_large_discs(points, start, cell, large, large_rate, spread, mesh.digits)
    return rows, y, x, filtered


def _smoothing(plan: Plan, gaussians: Gaussians) -> Array:
    """Natural logarithm by which rings are weaker about each Gaussian than about a point."""
    k = first_edge(plan.optics)
    loss: Array = 2 * (np.pi * k * gaussians.minor) ** 2
    return loss


def _axes(
    mesh: FineMesh,
    shape: tuple[int, int],
    gaussians: Gaussians,
    cut: Array,
    discs: SourceArrays,
    large: bool,
) -> tuple[Axis, Axis]:
    """Lay out a mesh that holds what is painted and where the kernel does not wrap around."""
    cell, spread = mesh.cell, mesh.spread
    disc_half = disc_half_sizes(discs)
    axes = []
    for axis in (0, 1):
        # at least so much, that scenes in the frame share their filters
        edge = cell * (half_patch(spread**2, cell, mesh.cut) + 1.0)
        edge += mesh.plan.reach(-1) if large else 0.0
        low, high = -edge, shape[axis] - 1 + edge
        variance = (gaussians.yy, gaussians.xx)[axis] + spread**2
        for centre, half in (
            ((gaussians.y, gaussians.x)[axis], cell * (half_patches(variance, cell, cut) + 1)),
            ((discs.y, discs.x)[axis], disc_half[axis] * 1.1 + mesh.cut * spread + 12 * cell),
        ):
            low = min(low, float((centre - half).min(initial=np.inf)))
            high = max(high, float((centre + half).max(initial=-np.inf)))
        start = int(np.floor(low))
        need = mesh.period(axis, shape[axis], start, high)
        period = NEAR_UNIT * fft.next_fast_len(int(np.ceil(need / NEAR_UNIT)), real=True)
        count = round(period / cell)
        # what covers everything must not end, not even out of reach
        painted = count if large else min(int((high - start) / cell) + 2, count)
        axes.append(Axis(start, period, count, painted, int(mesh.highest * period)))
    return axes[0], axes[1]


@lru_cache(maxsize=24)
def _filter(mesh: FineMesh, period_y: int, period_x: int) -> Transfer:
    """Filter of the mesh at the frequencies kept: ky and kx >= 0, or both signs of ky.

    It takes back the spreading and holds the area of a cell.
    """
    plan, cell, spread = mesh.plan, mesh.cell, mesh.spread
    ky, kx = (np.arange(int(mesh.highest * p) + 1) / p for p in (period_y, period_x))
    if not plan.optics.radial:
        ky = np.concatenate([ky, -ky[:0:-1]])
    wrapped = wrapped_transfer(plan, NEAR, period_y, period_x, mesh.highest) if plan.wraps else None
    filtered: Transfer = np.empty((ky.size, kx.size), mesh.dtype if plan.optics.radial else complex)
    for block in pieces(ky.size):  # temporary arrays stay small
        if wrapped is None:
            part = high_pass(plan, ky[block], kx)
        else:
            part = wrapped[block] * plan.optics.pixel(ky[block], kx)
            part[np.hypot(ky[block, None], kx) > mesh.highest] = 0.0
        if mesh.apart is not None:
            part -= high_pass(mesh.apart, ky[block], kx)
        part *= cell**2 * np.exp(2 * (np.pi * spread * ky[block]) ** 2)[:, None]
        filtered[block] = part * np.exp(2 * (np.pi * spread * kx) ** 2)
    return filtered


def high_pass(plan: Plan, ky: Array, kx: Array) -> Transfer:
    """Transfer function above the meshes' band, on the grid (ky, kx) in cycles per pixel."""
    limit = plan.highest if plan.optics.radial else np.inf
    return band_transfer(plan, NEAR, ky, kx, limit)


def _at_pixels(rows: Array, y: Axis, x: Axis, filtered: Transfer, shape: tuple[int, int]) -> Array:
    """Filter a mesh, sum all aliases and invert at the frame's pixels.

    ``rows`` holds the mesh in its first columns and is overwritten. Along each axis only what
    is painted is transformed, and only what is wanted is kept.
    """
    half = rows.view(np.result_type(rows, np.complex64))

    def transform_rows(block: slice) -> None:
        half[block] = fft.rfft(rows[block, : x.painted], x.count, axis=1)

    for_each(transform_rows, pieces(y.painted))
    radial = filtered.shape[0] == y.modes + 1
    # a mesh starts before the frame and ends behind it
    in_y, in_x = (slice(-axis.start, n - axis.start) for n, axis in zip(shape, (y, x), strict=True))
    # in the place of columns that have been transformed
    inverted = half[: shape[0], : x.modes + 1]

    def invert_columns(columns: slice) -> None:
        spectrum = fft.fft(half[:, columns], y.count, axis=0)
        weight = filtered[:, columns]
        upper, lower = spectrum[: y.modes + 1], spectrum[y.count - y.modes :]
        upper *= weight[: y.modes + 1]
        lower *= weight[:0:-1] if radial else weight[y.modes + 1 :]
        folded = fold_rows(upper, lower, y.period)
        inverted[:, columns] = fft.ifft(folded, axis=0, overwrite_x=True)[in_y]

    for_each(invert_columns, pieces(x.modes + 1))
    wanted = np.empty(shape)

    def invert_rows(block: slice) -> None:
        wanted[block] = fft.irfft(fold_half(inverted[block], x.period), x.period, axis=1)[:, in_x]

    for_each(invert_rows, pieces(shape[0]))
    return wanted

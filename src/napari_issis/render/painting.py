"""Gaussians painted on a mesh."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .compiled_painting import Painter, painter
from .gaussians import Gaussians
from .threads import blocks, for_each

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

# mesh points painted at a time: what a core's cache holds
BATCH = 32768
# sides of the painted patches are rounded up to a multiple of this, so that many are alike
STEP = 6
# Work from which on compiled code paints, in mesh points of stars: with less, loading it takes
# longer than it saves in some forty images. Gaussians of all sizes take numpy so many times as
# long as points, which are alike and are painted many at a time.
FEWEST_COMPILED = 4e6
UNLIKE = 5.0
# rows of a mesh that it paints at a time
ROWS = 128
# How much fainter than asked for a Gaussian is where it ends, a natural logarithm: ellipses are cut
# all around, patches in four places only and with sides rounded up.
RIM = 4.0


def paint(
    mesh: Array,
    start: tuple[float, float],
    cell: float,
    gaussians: Gaussians,
    spread: float,
    cut: float | Array,
    compiled: Painter | None,
) -> None:
    """Add Gaussians to a mesh of densities (cps per pixel area).

    Parameters
    ----------
    mesh : ndarray, shape (ny, nx)
        The mesh, contiguous; every Gaussian must lie on it as far as `half_patches` tells.
    start : (float, float)
        Position (y, x) of the mesh's first point, pixels.
    cell : float
        Spacing of the mesh, pixels.
    gaussians : Gaussians
        What to paint.
    spread : float
        Standard deviation in pixels of a Gaussian by which each is widened.
    cut : float or ndarray, shape (n,)
        Distance in standard deviations beyond which a Gaussian may be left out.
    compiled : callable or None
        What `scene_painter` gives for the whole scene: an image must not depend on what was
        painted before it.
    """
    if not len(gaussians):
        return
    xx, yy, xy = gaussians.xx + spread**2, gaussians.yy + spread**2, gaussians.xy
    y = (gaussians.y - start[0]) / cell
    x = (gaussians.x - start[1]) / cell
    determinant = xx * yy - xy**2
    with np.errstate(divide="ignore"):
        log_height = np.log(np.abs(gaussians.rate) / (2 * np.pi * np.sqrt(determinant)))
    # exponent a dy^2 + b dy dx + c dx^2 + log height, dy and dx in cells
    a = -0.5 * cell**2 * xx / determinant
    b = cell**2 * xy / determinant
    c = -0.5 * cell**2 * yy / determinant
    if compiled is None:
        half_y, half_x = half_patches(yy, cell, cut), half_patches(xx, cell, cut)
        _paint_patches(mesh, y, x, half_y, half_x, a, b, c, log_height, gaussians.rate < 0)
    else:
        depth = np.broadcast_to(0.5 * np.square(cut) + RIM, y.shape).copy()
        values = (y, x, a, b, c, log_height, np.sign(gaussians.rate), depth)
        for_each(
            lambda rows: compiled(mesh, rows.start, rows.stop, *values), blocks(len(mesh), ROWS)
        )


def scene_painter(gaussians: Gaussians, digits: Array) -> Painter | None:
    """Return compiled code for a scene's Gaussians, where there is any and it pays.

    Parameters
    ----------
    gaussians : Gaussians
        All that will be painted.
    digits : ndarray
        Natural logarithms of their accuracies.
    """
    # points that a point takes on a mesh, spread and cut as the accuracy asks for
    points = 10 * digits**2
    work = float(np.sum(np.where(gaussians.major > 0, UNLIKE, 1.0) * points))
    return painter() if work >= FEWEST_COMPILED else None


def _paint_patches(
    mesh: Array,
    y: Array,
    x: Array,
    half_y: Indices,
    half_x: Indices,
    a: Array,
    b: Array,
    c: Array,
    log_height: Array,
    negative: NDArray[np.bool_],
) -> None:
    """Add exp(a dy^2 + b dy dx + c dx^2 + log_height) to a mesh, dy and dx from (y, x)."""
    order = np.lexsort((half_x, half_y))
    row, column = np.rint(y), np.rint(x)
    a, b, c, log_height, dy, dx = (
        values[order, None] for values in (a, b, c, log_height, y - row, x - column)
    )
    half_y, half_x, negative = half_y[order], half_x[order], negative[order]
    top = (row[order].astype(np.intp) - half_y).tolist()
    left = (column[order].astype(np.intp) - half_x).tolist()
    for batch in _batches(half_y, half_x):
        h, w = int(half_y[batch.start]), int(half_x[batch.start])
        in_y, in_x = _offsets(h) - dy[batch], _offsets(w) - dx[batch]
        # the exponents as products of matrices, (n, ny, 3) by (n, 3, nx)
        by_row = np.ones((*in_y.shape, 3))
        by_column = np.ones((in_x.shape[0], 3, in_x.shape[1]))
        by_row[:, :, 0] = b[batch] * in_y
        by_column[:, 0] = in_x
        by_row[:, :, 1] = a[batch] * in_y**2 + log_height[batch]
        by_column[:, 2] = c[batch] * in_x**2
        patches = by_row @ by_column
        np.exp(patches, out=patches)
        if negative[batch].any():
            patches[negative[batch]] *= -1
        ny, nx = in_y.shape[1], in_x.shape[1]
        for r, k, patch in zip(top[batch], left[batch], patches, strict=True):
            part = mesh[r : r + ny, k : k + nx]
            part += patch


def half_patches(variance: Array, cell: float, cut: float | Array) -> Indices:
    """Half-sizes in cells of what is painted of Gaussians of a variance along an axis."""
    half: Indices = (STEP * np.ceil(cut * np.sqrt(variance) / cell / STEP)).astype(np.intp)
    return half


def half_patch(variance: float, cell: float, cut: float) -> int:
    """`half_patches` of one Gaussian."""
    return int(half_patches(np.array([variance]), cell, cut)[0])


@lru_cache(maxsize=512)
def _offsets(half: int) -> Array:
    return np.arange(-half, half + 1.0)


def _batches(half_y: Indices, half_x: Indices) -> Iterator[slice]:
    """Ranges of Gaussians whose patches are alike, few enough for the cache."""
    change = (np.diff(half_y) != 0) | (np.diff(half_x) != 0)
    ends = np.append(np.flatnonzero(change) + 1, half_y.size).tolist()
    first = 0
    for end in ends:
        size = (2 * int(half_y[first]) + 1) * (2 * int(half_x[first]) + 1)
        count = max(1, BATCH // size)
        for begin in range(first, end, count):
            yield slice(begin, min(begin + count, end))
        first = end

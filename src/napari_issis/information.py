"""Fisher information of the counts of a frame on the parameters of all its sources."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from .detector import Detector
from .render.derivatives import Derivatives
from .render.small_products import square

Array = NDArray[np.float64]

# pixels; smaller tiles are more work for Python, larger ones for empty corners of windows
TILE = 32


def joint_information(
    parts: Iterable[tuple[int, Derivatives]], scale: Array, expected: Array, first: NDArray[np.intp]
) -> csr_array:
    """Sum the information over all pixels, those of a tile of the frame at once.

    Parameters
    ----------
    parts : iterable of (int, Derivatives)
        Sources and derivatives of their images of 1 cps; first rows of windows never fall. Each
        is forgotten when the rows of its window are done.
    scale : ndarray, shape (m,)
        What makes them derivatives of the count rate by the m parameters.
    expected : ndarray, shape (ny, nx)
        Count rate of sources and sky, cps per pixel: the variance of Poisson counts in 1 s.
    first : ndarray, shape (n + 1,)
        Each source's first parameter, and m.

    Returns
    -------
    scipy.sparse.csr_array, shape (m, m)
        F_ab = sum over pixels of (d lambda / d a) (d lambda / d b) / lambda, for 1 s.
    """
    root = np.sqrt(np.divide(1.0, expected, out=np.zeros_like(expected), where=expected > 0))
    m = int(first[-1])
    joined = csr_array((m, m))
    for top, held in _rows_of_tiles(parts):
        rows, columns, data = [], [], []
        for left, members in _tiles(held).items():
            weight = root[top : top + TILE, left : left + TILE]
            ids = np.concatenate([np.arange(first[i], first[i + 1]) for i in members])
            stack = np.zeros((ids.size, *weight.shape))
            at = 0
            for i in members:
                part = held[i]
                y, x = part.window
                y0, y1 = max(y.start, top), min(y.stop, top + TILE)
                x0, x1 = max(x.start, left), min(x.stop, left + TILE)
                inside = slice(y0 - top, y1 - top), slice(x0 - left, x1 - left)
                own = part.images[:, y0 - y.start : y1 - y.start, x0 - x.start : x1 - x.start]
                np.multiply(own, weight[inside], out=stack[(slice(at, at + len(own)), *inside)])
                at += len(own)
            product = square(stack.reshape(ids.size, -1))
            product *= scale[ids]
            product *= scale[ids][:, None]
            short = ids.astype(np.int32)
            rows.append(np.repeat(short, short.size))
            columns.append(np.tile(short, short.size))
            data.append(product.ravel())
        indices = np.concatenate(rows), np.concatenate(columns)
        # neighbouring tiles hold much the same pairs: only their sum is kept
        joined = joined + coo_array((np.concatenate(data), indices), shape=(m, m)).tocsr()
    return joined


def _rows_of_tiles(
    parts: Iterable[tuple[int, Derivatives]],
) -> Iterator[tuple[int, dict[int, Derivatives]]]:
    """First row of each row of tiles, and the sources whose windows reach into it."""
    waiting = iter(parts)
    ahead = next(waiting, None)
    held: dict[int, Derivatives] = {}
    top = 0
    while held or ahead is not None:
        while ahead is not None and ahead[1].window[0].start < top + TILE:
            held[ahead[0]] = ahead[1]
            ahead = next(waiting, None)
        if held:
            yield top, held
        top += TILE
        held = {i: part for i, part in held.items() if part.window[0].stop > top}


def _tiles(held: dict[int, Derivatives]) -> dict[int, list[int]]:
    """By first column of each tile of a row, the sources whose windows reach into it."""
    tiles: dict[int, list[int]] = {}
    for i, part in held.items():
        x = part.window[1]
        for left in range(x.start // TILE * TILE, x.stop, TILE):
            tiles.setdefault(left, []).append(i)
    return tiles


def own_information(
    part: Derivatives, scale: Array, sky: float, darkest: float, detector: Detector
) -> Array:
    """Information on the parameters of one source alone on the sky, shape (3 or 6, 3 or 6).

    Its pixels are taken as no darker than ``darkest`` of the brightest one.
    """
    images = part.images.reshape(len(part.images), -1)
    expected = np.maximum(scale[1] * images[0] + sky, 0.0)
    brightest = float(expected.max())
    if not brightest > 0:
        return np.zeros((len(images), len(images)))
    weighted = images / detector.variance(np.maximum(expected, darkest * brightest))
    result: Array = (weighted @ images.T) * scale * scale[:, None]
    return result

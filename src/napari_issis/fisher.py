"""Fisher information of an exposure: how well the parameters of all its sources can be fitted.

The information scales with the exposure time, since the counts of sources, sky and dark
current all do and no other noise is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from .exposure import noise_ready_rate
from .observation import Observation
from .render.derivatives import Derivatives, derivatives
from .render.optics import Optics
from .source_rates import sources_and_rates
from .sources import IMAGE, SourceArrays

Array = NDArray[np.float64]

# most parameters that a source has: flux, x, y, r_half, ellipticity, pa
PARAMETERS = 6
# windows end where a source falls below this share of the sky, but within these shares of
# a point source's peak
SKY_SHARE = 0.02
HIGHEST_LEVEL, LOWEST_LEVEL = 1e-4, 1e-5
TILE = 32
# sources whose parameters are coupled by less than this are inverted apart
COUPLED = 1e-4
# eigenvalues of the normalised information below which a combination is undetermined
SINGULAR = 1e-11
# share of an undetermined combination above which a parameter is undetermined too
INVOLVED = 1e-6
# pixels are not expected to be darker than this share of the brightest
DARKEST = 1e-9


@dataclass(frozen=True, eq=False)
class Covariance:
    """Covariances of fitted parameters, per second of exposure.

    Attributes
    ----------
    sources : SourceArrays
        The scene, of n sources.
    rates : ndarray, shape (n,)
        Count rates in cps.
    source_rate : ndarray, shape (ny, nx)
        Expected count rate of the sources, cps per pixel.
    variance : ndarray, shape (n, 6)
        Variances of rate (cps), x, y, r_half (pixels), ellipticity and pa (degrees) for an
        exposure of 1 s, all fitted together; infinite where undetermined, NaN where a source
        has no such parameter.
    alone : ndarray, shape (n,)
        Variance of the rate if the source were alone on the sky.
    correlation : sparse array, shape (n, n)
        Correlations of the rates; those of undetermined ones are the limits.
    """

    sources: SourceArrays
    rates: Array
    source_rate: Array
    variance: Array
    alone: Array
    correlation: coo_array


def covariance(sources: Table, observation: Observation) -> Covariance:
    """Invert the Fisher information of all parameters of a scene, for 1 s of exposure.

    Notes
    -----
    F_ab = sum over pixels of (d lambda / d a) (d lambda / d b) / lambda for Poisson counts of
    expectation lambda, and the covariance of an efficient estimator is its inverse (Cramer
    1946, Mathematical Methods of Statistics, 32.3; Kay 1993, Fundamentals of Statistical
    Signal Processing, 3.7).
    """
    arrays, rates = sources_and_rates(sources, observation)
    sky = observation.background_rate
    rate, _ = noise_ready_rate(sources, observation)
    optics = Optics(observation.effective_psf, observation.pixel_scale)
    parts = [
        _derivatives(optics, arrays, float(rates[i]), i, sky, observation)
        for i in range(len(arrays))
    ]
    expected = rate + sky
    expected = np.maximum(expected, DARKEST * float(expected.max(initial=0.0)))
    counts = np.where(np.isin(arrays.kind, ("point", IMAGE)), 3, PARAMETERS)
    first = np.concatenate([[0], np.cumsum(counts)]).astype(int)
    information = _information(parts, rates, expected, first)
    values, flux_correlation = _invert(information, first)
    variance = np.full((len(arrays), PARAMETERS), np.nan)
    for i, count in enumerate(counts):
        variance[i, :count] = values[first[i] : first[i + 1]]
    alone = np.array([_alone(part, float(r), sky) for part, r in zip(parts, rates, strict=True)])
    return Covariance(arrays, rates, rate, variance, alone, flux_correlation)


def _derivatives(
    optics: Optics, arrays: SourceArrays, rate: float, i: int, sky: float, observation: Observation
) -> Derivatives | None:
    one = arrays.take(slice(i, i + 1))
    size = np.pi * float(one.r_half[0]) ** 2 * (1 - float(one.ellipticity[0]))
    peak = 1 / (optics.point_area + 2 * size)
    level = SKY_SHARE * sky / rate if rate > 0 else HIGHEST_LEVEL * peak
    level = float(np.clip(level, LOWEST_LEVEL * peak, HIGHEST_LEVEL * peak))
    return derivatives(optics, one, level, observation.shape)


def _scaled(part: Derivatives, rate: float) -> Array:
    """Scale derivatives of the image to those of the count rate of a source of that rate."""
    scale = np.full(len(part.images), rate)
    scale[0] = 1.0
    scaled: Array = part.images * scale[:, None, None]
    return scaled


def _information(
    parts: list[Derivatives | None], rates: Array, expected: Array, first: NDArray[np.int_]
) -> coo_array:
    """Sum the Fisher information over tiles of the frame, sparse, shape (m, m)."""
    inverse = np.divide(1.0, expected, out=np.zeros_like(expected), where=expected > 0)
    root = np.sqrt(inverse)
    weighted: list[Array | None] = [
        None if part is None else _scaled(part, float(rate)) * root[part.window]
        for part, rate in zip(parts, rates, strict=True)
    ]
    ny, nx = expected.shape
    tiles: dict[tuple[int, int], list[int]] = {}
    for i, part in enumerate(parts):
        if part is not None:
            y, x = part.window
            for row in range(y.start // TILE, (y.stop - 1) // TILE + 1):
                for column in range(x.start // TILE, (x.stop - 1) // TILE + 1):
                    tiles.setdefault((row, column), []).append(i)
    blocks: dict[tuple[int, int], Array] = {}
    size = int(first[-1])
    dense = np.zeros((size, size)) if size <= 6000 else None
    for (row, column), members in tiles.items():
        top, left = row * TILE, column * TILE
        height, width = min(TILE, ny - top), min(TILE, nx - left)
        ids = np.concatenate([np.arange(first[i], first[i + 1]) for i in members])
        stack = np.zeros((ids.size, height, width))
        at = 0
        for i in members:
            part, own = parts[i], weighted[i]
            assert part is not None
            assert own is not None
            y, x = part.window
            y0, y1 = max(y.start, top), min(y.stop, top + height)
            x0, x1 = max(x.start, left), min(x.stop, left + width)
            stack[at : at + len(own), y0 - top : y1 - top, x0 - left : x1 - left] = own[
                :, y0 - y.start : y1 - y.start, x0 - x.start : x1 - x.start
            ]
            at += len(own)
        flat = stack.reshape(ids.size, -1)
        product = flat @ flat.T
        if dense is not None:
            dense[np.ix_(ids, ids)] += product
        else:
            blocks[row, column] = product
    if dense is not None:
        return coo_array(dense)
    rows, columns, data = [], [], []
    for key, product in blocks.items():
        ids = np.concatenate([np.arange(first[i], first[i + 1]) for i in tiles[key]])
        rows.append(np.repeat(ids, ids.size))
        columns.append(np.tile(ids, ids.size))
        data.append(product.ravel())
    joined = coo_array(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))), (size, size)
    )
    joined.sum_duplicates()
    return joined


def _invert(information: coo_array, first: NDArray[np.int_]) -> tuple[Array, coo_array]:
    """Variances of all parameters, and the correlations of the sources' rates."""
    size, n = int(first[-1]), first.size - 1
    if not n:
        return np.zeros(0), coo_array((0, 0))
    matrix = information.tocsr()
    diagonal = matrix.diagonal()
    norm = np.divide(1.0, np.sqrt(diagonal), out=np.zeros(size), where=diagonal > 0)
    owner = np.repeat(np.arange(n), np.diff(first))
    entries = matrix.tocoo()
    coupling = np.abs(entries.data) * norm[entries.row] * norm[entries.col]
    strong = coupling > COUPLED
    graph = coo_array(
        (np.ones(int(strong.sum())), (owner[entries.row[strong]], owner[entries.col[strong]])),
        (n, n),
    )
    count, label = connected_components(graph, directed=False)
    variance = np.full(size, np.inf)
    rows, columns, data = [], [], []
    order = np.argsort(label, kind="stable")
    for members in np.split(order, np.searchsorted(label[order], np.arange(1, count))):
        ids = np.concatenate([np.arange(first[i], first[i + 1]) for i in members])
        ids = ids[norm[ids] > 0]
        if not ids.size:
            continue
        scaled = matrix[ids][:, ids].toarray() * norm[ids] * norm[ids][:, None]
        inverse, infinite = _inverse(scaled)
        variance[ids] = np.where(infinite, np.inf, np.diagonal(inverse) * norm[ids] ** 2)
        is_rate = np.isin(ids, first[:-1])
        which = owner[ids[is_rate]]
        spread = inverse[np.ix_(is_rate, is_rate)]
        deviation = np.sqrt(np.diagonal(spread))
        rows.append(np.repeat(which, which.size))
        columns.append(np.tile(which, which.size))
        data.append((spread / deviation / deviation[:, None]).ravel())
    if not data:
        return variance, coo_array((n, n))
    indices = (np.concatenate(rows), np.concatenate(columns))
    return variance, coo_array((np.concatenate(data), indices), (n, n))


def _inverse(scaled: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Inverse of a matrix of unit diagonal, and which parameters are undetermined.

    A singular direction gets a variance that is large enough to rule the correlations.
    """
    try:
        inverse: Array = linalg.cho_solve(linalg.cho_factor(scaled), np.eye(len(scaled)))
    except linalg.LinAlgError:
        pass
    else:
        if np.diagonal(inverse).max() < 1e6:
            return inverse, np.zeros(len(scaled), dtype=bool)
    values, vectors = linalg.eigh(scaled)
    singular = values < SINGULAR
    infinite = (vectors[:, singular] ** 2).sum(axis=1) > INVOLVED
    inverse = (vectors / np.maximum(values, SINGULAR * 1e-3 * singular)) @ vectors.T
    if singular.any():
        # determined parameters are spared the rounding of the singular directions
        regular = vectors[:, ~singular] / values[~singular] @ vectors[:, ~singular].T
        good = ~infinite
        inverse[good] = regular[good]
        inverse[:, good] = regular[:, good]
    return inverse, infinite


def _alone(part: Derivatives | None, rate: float, sky: float) -> float:
    if part is None:
        return np.inf
    images = _scaled(part, rate).reshape(len(part.images), -1)
    expected = np.maximum(rate * images[0] + sky, 0.0)
    expected = np.maximum(expected, DARKEST * expected.max())
    if not expected.max() > 0:
        return np.inf
    matrix = (images / expected) @ images.T
    norm = np.sqrt(np.diagonal(matrix))
    used = norm > 0
    if not used[0]:
        return np.inf
    scaled = matrix[np.ix_(used, used)] / norm[used] / norm[used][:, None]
    inverse, infinite = _inverse(scaled)
    return np.inf if infinite[0] else float(inverse[0, 0] / norm[0] ** 2)

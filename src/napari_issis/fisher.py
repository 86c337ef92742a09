"""Fisher information of an exposure: how well the parameters of all its sources can be fitted.

The information scales with the exposure time, since the counts of sources, sky and dark
current all do and no other noise is assumed. A dead time of the pixels lowers it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from .exposure import noise_ready_rate
from .information import joint_information, own_information
from .observation import Observation
from .render.derivatives import Derivatives, derivatives
from .render.optics import Optics
from .source_rates import sources_and_rates
from .sources import IMAGE, SourceArrays

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

# most parameters that a source has: flux, x, y, r_half, ellipticity, pa
PARAMETERS = 6
# windows end where a source falls below this share of the sky, but within these shares of
# a point source's peak
SKY_SHARE = 0.02
HIGHEST_LEVEL, LOWEST_LEVEL = 1e-4, 3e-5
# sources whose parameters are coupled by less than this are inverted apart
COUPLED = 1e-4
# most sources inverted at once, and the coupling of those around them that come with them
MOST, AROUND = 300, 3e-3
# variances of a normalised parameter above which combinations may be undetermined...
LARGE = 1e7
# ...eigenvalues of the normalised information below which one is...
SINGULAR = 1e-11
# ...and the share in it above which a parameter is undetermined too
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
    Signal Processing, 3.7). Where pixels have a dead time lambda is `Detector.variance` of it.
    """
    arrays, rates = sources_and_rates(sources, observation)
    sky = observation.background_rate
    rate, _ = noise_ready_rate(sources, observation)
    optics = Optics(observation.effective_psf, observation.pixel_scale)
    level, share = _levels(optics, arrays, rates, sky)
    expected = rate + sky
    expected = np.maximum(expected, DARKEST * float(expected.max(initial=0.0)))
    counts = np.where(np.isin(arrays.kind, ("point", IMAGE)), 3, PARAMETERS)
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
    scale = np.repeat(rates, counts)
    scale[first[:-1]] = 1.0
    detector = observation.detector
    own = [np.zeros((count, count)) for count in counts]

    def seen() -> Iterator[tuple[int, Derivatives]]:
        for i, part in derivatives(optics, arrays, level, share, observation.shape):
            own[i] = own_information(part, scale[first[i] : first[i + 1]], sky, DARKEST, detector)
            yield i, part

    information = joint_information(seen(), scale, detector.variance(expected), first)
    values, flux_correlation = _invert(information, first, arrays)
    variance = np.full((len(arrays), PARAMETERS), np.nan)
    for i, count in enumerate(counts):
        variance[i, :count] = values[first[i] : first[i + 1]]
    return Covariance(arrays, rates, rate, variance, _alone(own), flux_correlation)


def _levels(optics: Optics, arrays: SourceArrays, rates: Array, sky: float) -> tuple[Array, float]:
    """Levels at which the windows of profiles end, and share of its peak where a star's does."""
    size = np.pi * arrays.r_half**2 * (1 - arrays.ellipticity)
    peak = 1 / (optics.point_area + 2 * size)
    brightest = max(float(rates.max(initial=0.0)) * float(1 / optics.point_area), 1e-300)
    share = float(np.clip(SKY_SHARE * sky / brightest, LOWEST_LEVEL, HIGHEST_LEVEL))
    faint = np.divide(SKY_SHARE * sky, rates, out=np.full_like(rates, np.inf), where=rates > 0)
    return np.clip(faint, LOWEST_LEVEL * peak, HIGHEST_LEVEL * peak), share


def _invert(matrix: csr_array, first: Rows, arrays: SourceArrays) -> tuple[Array, coo_array]:
    """Variances of all parameters, and the correlations of the sources' rates."""
    size, n = int(first[-1]), first.size - 1
    diagonal = matrix.diagonal()
    norm = np.divide(1.0, np.sqrt(diagonal), out=np.zeros(size), where=diagonal > 0)
    owner = np.repeat(np.arange(n), np.diff(first))
    entries = matrix.tocoo()
    coupling = np.abs(entries.data) * norm[entries.row] * norm[entries.col]
    pairs = owner[entries.row], owner[entries.col]
    _, label = connected_components(_graph(pairs, coupling > COUPLED, n), directed=False)
    around = _graph(pairs, coupling > AROUND, n).tocsr()
    is_rate = np.zeros(size, dtype=bool)
    is_rate[first[:-1]] = True
    variance = np.full(size, np.inf)
    rows, columns, data = [], [], []
    for patch in _patches(label, arrays):
        members = patch
        if patch.size < np.count_nonzero(label == label[patch[0]]):
            for _ in range(2):
                members = np.union1d(members, around[members].indices)
        ids = np.concatenate([np.arange(first[i], first[i + 1]) for i in members])
        ids = ids[norm[ids] > 0]
        if not ids.size:
            continue
        scaled = matrix[ids][:, ids].toarray() * norm[ids] * norm[ids][:, None]
        inverse, infinite = _inverse(scaled)
        wanted = np.isin(owner[ids], patch)
        found = np.where(infinite, np.inf, np.diagonal(inverse) * norm[ids] ** 2)
        variance[ids[wanted]] = found[wanted]
        flux = is_rate[ids]
        here = owner[ids[flux & wanted]]
        spread = inverse[np.ix_(flux, flux)]
        deviation = np.sqrt(np.diagonal(spread))
        spread = (spread / deviation / deviation[:, None])[wanted[flux]]
        rows.append(np.repeat(here, spread.shape[1]))
        columns.append(np.tile(owner[ids[flux]], here.size))
        data.append(spread.ravel())
    if not data:
        return variance, coo_array((n, n))
    indices = (np.concatenate(rows), np.concatenate(columns))
    return variance, coo_array((np.concatenate(data), indices), (n, n))


def _graph(pairs: tuple[Rows, Rows], chosen: NDArray[np.bool_], n: int) -> coo_array:
    """Join sources, the nodes of a graph."""
    return coo_array(
        (np.ones(int(chosen.sum())), (pairs[0][chosen], pairs[1][chosen])), shape=(n, n)
    )


def _patches(label: NDArray[np.int32], arrays: SourceArrays) -> list[Rows]:
    """Part sources by label, and those of a label with too many by place."""
    order = np.argsort(label, kind="stable")
    waiting = np.split(order, np.flatnonzero(np.diff(label[order])) + 1) if order.size else []
    patches = []
    while waiting:
        members = waiting.pop()
        if members.size <= MOST:
            patches.append(members)
            continue
        x, y = arrays.x[members], arrays.y[members]
        across = x if np.ptp(x) > np.ptp(y) else y
        halves = np.argsort(across, kind="stable")
        waiting += [members[part] for part in np.array_split(halves, 2)]
    return patches


def _inverse(scaled: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Inverse of a matrix of unit diagonal, and which parameters are undetermined.

    A singular direction gets a variance that is large enough to rule the correlations.
    """
    factor, failed = linalg.lapack.dpotrf(scaled)
    if not failed:
        inverse, failed = linalg.lapack.dpotri(factor)
        if not failed and np.diagonal(inverse).max() < LARGE:
            inverse = np.triu(inverse)
            return inverse + np.triu(inverse, 1).T, np.zeros(len(scaled), dtype=bool)
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


def _alone(information: list[Array]) -> Array:
    """Variance of the first parameter from the information of each source alone, shape (n,)."""
    result = np.full(len(information), np.inf)
    sizes = np.array([len(matrix) for matrix in information])
    for size in np.unique(sizes):
        which = np.flatnonzero(sizes == size)
        matrices = np.stack([information[i] for i in which])
        diagonal = np.diagonal(matrices, axis1=1, axis2=2)
        norm = np.divide(1.0, np.sqrt(diagonal), out=np.zeros_like(diagonal), where=diagonal > 0)
        # what does not change the image is left out: alone, and of information 1
        scaled = matrices * norm[:, None] * norm[:, :, None]
        scaled[:, np.arange(size), np.arange(size)] = 1.0
        values, vectors = np.linalg.eigh(scaled)
        shares = vectors[:, 0] ** 2
        singular = values < SINGULAR
        inverse = np.divide(shares, values, out=np.zeros_like(shares), where=~singular).sum(axis=1)
        known = (norm[:, 0] > 0) & ((shares * singular).sum(axis=1) <= INVOLVED)
        result[which[known]] = inverse[known] * norm[known, 0] ** 2
    return result

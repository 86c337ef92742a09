"""The Poisson quantile: the counts that belong to a probability."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, pdtr

from .poisson_exact import poisson_quantile_exact

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
Indices = NDArray[np.intp]

_SUMMED_BELOW = 10.0
_SUM_ERROR = 2e-14
_CDF_RELATIVE_ERROR = 1e-10
_CDF_TRUSTED_BELOW = 1e4  # from 1e6 on scipy's is off by up to 1e-6 beyond 4.5 sigma
_BLOCK = 32768  # the half dozen arrays of a block stay in the cache


def poisson_quantile(u: Floats, lam: Floats, z: Floats | None = None) -> Counts:
    """Smallest k with CDF(k; lam) >= u, never off by one.

    Parameters
    ----------
    u : ndarray of float64, one-dimensional
        Probabilities in (0, 1).
    lam : ndarray of float64, same shape
        Expected counts, from 0 to 1e15; neither is checked here.
    z : ndarray of float64, same shape, optional
        ``scipy.special.ndtri(u)``, if at hand.

    Returns
    -------
    ndarray of int64

    Notes
    -----
    There are no ties to break: for every representable lam > 0 the CDF is a rational number
    times e^-lam, hence irrational, and never equals a floating-point u.

    Every shortcut comes with a bound on its error; where the bound leaves two answers
    possible, a more accurate method decides, at last one of 30 digits. The shortcuts:

    * k = 0 if lam <= 1 - u, as e^-lam >= 1 - lam;
    * below lam = 10 the sum of the terms e^-lam lam^k / k!;
    * above, an expansion of the continuous quantile in 1 / sqrt(lam), then
      `scipy.special.pdtr` near a boundary if lam < 1e4.
    """
    z = ndtri(u) if z is None else z
    counts = np.empty(lam.shape, np.int64)
    for start in range(0, lam.size, _BLOCK):
        block = slice(start, start + _BLOCK)
        counts[block] = _block_quantile(u[block], lam[block], z[block])
    return counts


def _block_quantile(u: Floats, lam: Floats, z: Floats) -> Counts:
    is_large = lam >= _SUMMED_BELOW
    large = np.flatnonzero(is_large)
    if large.size == lam.size:
        return _expanded(u, lam, z)
    counts = np.zeros(lam.shape, np.int64)
    counts[large] = _expanded(u.take(large), lam.take(large), z.take(large))
    small = np.flatnonzero((lam > 1 - u) & ~is_large)
    counts[small] = _summed(u.take(small), lam.take(small))
    return counts


def _summed(u: Floats, lam: Floats) -> Counts:
    """Sum the terms; lam < 10.

    Count the partial sums below u - e and below u + e, where e exceeds their rounding errors
    (2k + 3 units in the last place of term k, k in the sum): where the two numbers are equal,
    they are the answer. Pixels that are done are dropped when seven
    of eight are.
    """
    counts = np.empty(u.shape, np.int64)
    index: Indices = np.arange(u.size)
    low, high = u - _SUM_ERROR, u + _SUM_ERROR
    lam_left = lam
    term: Floats = np.exp(-lam)
    cdf = term.copy()
    sums_below_low: NDArray[np.uint8] = np.zeros(u.size, np.uint8)  # at most 70
    sums_below_high = sums_below_low.copy()
    doubtful: list[int] = []
    k = 0
    while index.size:
        below = cdf < low
        sums_below_low += below.view(np.uint8)
        sums_below_high += (cdf < high).view(np.uint8)
        if 8 * np.count_nonzero(below) <= index.size:
            counts[index] = sums_below_low
            doubtful.extend(index[sums_below_low != sums_below_high])
            left = np.flatnonzero(below)
            index = index.take(left)
            low, high, lam_left, term, cdf = (
                a.take(left) for a in (low, high, lam_left, term, cdf)
            )
            sums_below_low = sums_below_low.take(left)
            sums_below_high = sums_below_high.take(left)
        k += 1
        term *= lam_left
        term *= 1 / k
        cdf += term
    _settle(counts, doubtful, u, lam)
    return counts


def _expanded(u: Floats, lam: Floats, z: Floats) -> Counts:
    """Expand the x of Q(x, lam) = u, Q the regularised upper incomplete gamma function; k = [x].

    x = lam + s z + (z^2 + 2) / 6 + ... with s = sqrt(lam) and z the normal quantile of u; with
    CDF(k; lam) = Q(k + 1, lam). The polynomials follow, order by order, from
    phi(z) dx/dlam = lam^(x - 1) e^-lam / Gamma(x) dx/dz; the first three are Giles' (2016,
    ACM TOMS 42, 7). With y = z^2 + 2 the first omitted term and the rounding errors are below
    3e-3 y^3 / lam^2 + 2e-15 s y wherever that is below 1/4, lam >= 10 and |z| <= 8.3.
    """
    s = np.sqrt(lam)
    r = 1 / s
    z2 = z * z
    y = z2 + 2
    whole = np.floor(lam)
    x = (207 * z2 + 548) * z2
    x -= 2684
    x *= r * z
    x *= -1 / 155520
    x += ((3 / 810) * y - 5 / 810) * y
    x -= 18 / 810
    x *= r
    x -= (z * y) / 72
    x *= r
    x += y / 6
    x += s * z
    x += lam - whole
    floor = np.floor(x)
    counts = whole.astype(np.int64)
    counts += floor.astype(np.int64)

    error = y * r
    error *= error
    error *= y * r * r
    error *= 3e-3
    s *= 2e-15
    s *= y
    error += s
    x -= floor
    x -= 0.5
    doubtful = np.flatnonzero(np.abs(x) > 0.5 - error)
    if doubtful.size:
        _decide(counts, doubtful, u, lam, x, error)
    return counts


def _decide(
    counts: Counts, doubtful: Indices, u: Floats, lam: Floats, from_middle: Floats, error: Floats
) -> None:
    """Correct in place the counts of pixels whose x is nearly an integer."""
    above = counts[doubtful] + (from_middle[doubtful] > 0)
    below = above - 1
    excess = pdtr(below, lam[doubtful]) - u[doubtful]  # nan, never trusted, below zero
    counts[doubtful] = np.where(excess > 0, below, above)
    trusted = (
        (np.abs(excess) > _CDF_RELATIVE_ERROR * u[doubtful])
        & (lam[doubtful] < _CDF_TRUSTED_BELOW)
        & (error[doubtful] < 0.25)
    )
    _settle(counts, doubtful[~trusted], u, lam)


def _settle(counts: Counts, doubtful: Iterable[int], u: Floats, lam: Floats) -> None:
    for i in doubtful:
        counts[i] = poisson_quantile_exact(float(u[i]), float(lam[i]), int(counts[i]))

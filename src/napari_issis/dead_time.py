"""Counts of a pixel that is blind for a time after each of them.

The pixel sees at the start. With photons of a Poisson process of rate n, the k-th count comes
after k waiting times, each exponential with mean 1 / n, and k - 1 dead times tau. So at least k
counts in a time T are k waiting times within T - (k - 1) tau, that is at least k photons of the
process in so long a time, and

    P(N <= k) = P(Poisson(n (T - k tau)) <= k) for k tau < T, and 1 beyond.

For T much longer than 1 / n + tau the mean tends to n T / (1 + n tau), but for a constant below
1/2, and the variance to n T / (1 + n tau)^3: N counts the renewals of a process whose intervals
have mean 1 / n + tau and variance 1 / n^2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .poisson_quantile import poisson_quantile

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

# Steps by the secant before every other one halves what is left.
NEWTON_STEPS = 6


def photons_of(expected: Floats, dead_share: float) -> Floats:
    """Return the photons that come in the exposure, of which so many counts are expected.

    The inverse of lambda / (1 + lambda d); infinite where it has none.

    Parameters
    ----------
    expected : ndarray of float64
        Expected counts, reduced by the dead time.
    dead_share : float
        Dead time over exposure time, d.
    """
    seeing = 1 - expected * dead_share
    return np.divide(expected, seeing, out=np.full_like(expected, np.inf), where=seeing > 0)


def dead_time_quantile(u: Floats, photons: Floats, dead_share: float, z: Floats) -> Counts:
    """Smallest k with P(N <= k) >= u.

    Parameters
    ----------
    u : ndarray of float64, one-dimensional
        Probabilities in (0, 1).
    photons : ndarray of float64, same shape
        Photons expected in the exposure, n T, from 0 to 1e15.
    dead_share : float
        Dead time over exposure time, above 0.
    z : ndarray of float64, same shape
        ``scipy.special.ndtri(u)``.

    Returns
    -------
    ndarray of int64
        As exact as `poisson_quantile`, by which k is searched: with q(k) the quantile of the
        Poisson distribution of mean n (T - k tau), P(N <= k) >= u where q(k) <= k, and q never
        rises with k.
    """
    # q(0), of the photons: a first upper end. At least one photon is at least one count.
    high = poisson_quantile(u, photons, z)
    left = np.flatnonzero(high > 1)
    low = np.zeros(left.size, np.int64)
    slope = 1 + photons[left] * dead_share
    mean = photons[left] / slope
    guess = mean + z[left] * np.sqrt(mean) / slope
    step = 0
    while left.size:
        top = high[left]
        if step > NEWTON_STEPS and step % 2:
            trial = (low + top) // 2
        else:
            trial = np.clip(np.rint(guess), low + 1, np.maximum(top - 1, low + 1)).astype(np.int64)
        q = poisson_quantile(
            u[left], photons[left] * np.maximum(1 - trial * dead_share, 0.0), z[left]
        )
        enough = q <= trial
        # q(k) >= q for smaller k, and q(k) <= q for larger ones
        low = np.where(enough, np.maximum(low, q - 1), trial)
        high[left] = np.where(enough, trial, np.minimum(top, q))
        guess = trial + (q - trial) / slope
        # the answer is found from both sides: it and its neighbour below are tried
        guess = np.where(enough & (np.rint(guess) == trial), trial - 1, guess)
        guess = np.where(~enough & (np.rint(guess) == trial), trial + 1, guess)
        more = high[left] - low > 1
        left, low, slope, guess = left[more], low[more], slope[more], guess[more]
        step += 1
    return high

"""Fourier transforms of circular profiles of unit flux and half-light radius.

In closed form; de Vaucouleurs' by its convergent series in high precision.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.polynomial import Chebyshev
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.special import gamma, gammaincinv, j1

Array = NDArray[np.float64]

# half of a de Vaucouleurs or exponential profile's light lies inside r = 1 for these
B = float(gammaincinv(8, 0.5))
EXPONENTIAL_B = float(gammaincinv(2, 0.5))
# below LOWEST, cycles per half-light radius, the transform is its first two moments' to 1e-16
LOWEST, HIGHEST = 1e-5, 100.0
TERMS = 1600
DIGITS = 180


def transform(kind: str, k: Array) -> Array:
    """Transform at k cycles per half-light radius."""
    if kind == "gaussian":
        value: Array = np.exp(-((np.pi * k) ** 2) / np.log(2))
    elif kind == "exponential":
        value = (1 + (2 * np.pi * k / EXPONENTIAL_B) ** 2) ** -1.5
    elif kind == "uniform":
        x = np.maximum(2 * np.pi * np.sqrt(2) * k, 1e-12)
        value = 2 * j1(x) / x
    else:
        mean_square = gamma(16) / gamma(8) / B**8
        series = _devaucouleurs()(np.log(np.maximum(k, LOWEST)))
        value = np.where(k < LOWEST, 1 - (np.pi * k) ** 2 * mean_square, series)
    return value


@lru_cache(maxsize=1)
def _devaucouleurs() -> BSpline:
    """Transform in ln k: Chebyshev series, and from it a quintic spline that is quicker."""
    with mpmath.workdps(DIGITS):
        factors = _series_factors()
        domain = (np.log(LOWEST), np.log(HIGHEST))
        series = Chebyshev.interpolate(
            lambda log_k: np.array([_series(float(v), factors) for v in log_k]), 160, domain=domain
        )
    knots = np.linspace(*domain, 6001)
    return make_interp_spline(knots, series(knots), k=5)


def _series(log_k: float, factors: list[Any]) -> float:
    """Hankel transform of exp(-b r^(1/4)), the exponential expanded and integrated termwise.

    The transform of r^s is 2 pi (2/q)^(s+2) Gamma(1+s/2) / (2 Gamma(-s/2)) in q = 2 pi k; the
    sum over s = j/4 converges for every q > 0, with cancellation that the digits allow for.
    """
    q = 2 * mpmath.pi * mpmath.exp(mpmath.mpf(log_k))
    z = -mpmath.mpf(B) * mpmath.root(2 / q, 4)
    flux = 2 * mpmath.pi * 4 * mpmath.factorial(7) / mpmath.mpf(B) ** 8
    total = mpmath.mpf(0)
    for factor in reversed(factors):
        total = total * z + factor
    return float(mpmath.pi * (2 / q) ** 2 * total / flux)


def _series_factors() -> list[Any]:
    """Gamma(1 + j/8) / Gamma(-j/8) / j!, by recurrence from j - 8."""
    factors: list[Any] = []
    for j in range(TERMS):
        s = mpmath.mpf(j) / 8
        if j < 8:
            factors.append(mpmath.gamma(1 + s) * mpmath.rgamma(-s) / mpmath.factorial(j))
        else:
            falling = mpmath.mpf(1)
            for i in range(8):
                falling *= j - i
            factors.append(factors[j - 8] * s * -s / falling)
    return factors

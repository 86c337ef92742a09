"""Luminosity functions: how the fluxes of a population are distributed."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from .sources import FLUX_UNIT, check_sources

Array = NDArray[np.float64]

DISTRIBUTIONS = ("uniform", "log", "power")
# dN/dF of a main sequence: Salpeter's (1955) dN/dM ~ M^-2.35 with F ~ M^3.5
# gives F^-(1 + 1.35/3.5).
DEFAULT_SLOPE = 1.4


def draw_fluxes(
    rng: np.random.Generator,
    count: int,
    limits: tuple[float, float],
    distribution: str = "uniform",
    slope: float = DEFAULT_SLOPE,
) -> Array:
    """Draw fluxes between limits.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of randomness.
    count : int
        Number of fluxes.
    limits : (float, float)
        Lower and upper limit, 0 <= lower <= upper.
    distribution : {"uniform", "log", "power"}
        Uniform in the flux F, uniform in log F, or dN/dF proportional to F^-slope.
    slope : float
        For ``power`` only; 1 is the same as ``log``, 0 as ``uniform``.

    Returns
    -------
    ndarray, shape (count,)

    Raises
    ------
    ValueError
        If the distribution is unknown, the slope no number, or a limit 0 where a logarithm or
        a power is taken.

    Notes
    -----
    A power law is drawn by the inverse of its cumulative: with b = 1 - slope and u uniform,
    F = low (1 + u [(high/low)^b - 1])^(1/b) for b < 0 and
    F = high (1 + u [(low/high)^b - 1])^(1/b) for b > 0, which pass smoothly through b = 0.
    """
    low, high = limits
    if distribution not in DISTRIBUTIONS:
        known = ", ".join(repr(name) for name in DISTRIBUTIONS)
        raise ValueError(f"flux_distribution is {distribution!r}; known: {known}.")
    if distribution == "uniform":
        return rng.uniform(low, high, count)
    if low <= 0:
        kind = "log-uniform" if distribution == "log" else "power-law"
        raise ValueError(f"flux limits are {limits}; a {kind} flux needs them above zero.")
    try:
        rise = 1.0 - float(slope) if distribution == "power" else 0.0
    except (TypeError, ValueError):
        rise = np.nan
    if not isfinite(rise):
        raise ValueError(f"flux_slope is {slope!r}; it must be a finite number.")
    if rise == 0:
        fluxes = np.exp(rng.uniform(np.log(low), np.log(high), count))
    else:
        # From the end towards which the power law rises: no power overflows.
        start, sign = (high, -1.0) if rise > 0 else (low, 1.0)
        span = np.expm1(sign * rise * (np.log(high) - np.log(low)))
        fluxes = start * np.exp(np.log1p(rng.random(count) * span) / rise)
    return np.clip(fluxes, low, high)


def sample_fluxes(rng: np.random.Generator, count: int, sample: Any) -> Any:
    """Draw fluxes from a list, each with the same chance, with replacement.

    Parameters
    ----------
    rng : numpy.random.Generator
        Source of randomness.
    count : int
        Number of fluxes.
    sample : array_like or Quantity or Magnitude
        The list; plain numbers are in erg s-1 cm-2 A-1.

    Returns
    -------
    Quantity or Magnitude, shape (count,)
        In the unit of the list.

    Raises
    ------
    ValueError
        If the list is empty or holds what is no flux; the message names the row (from 0).
    """
    unit = getattr(sample, "unit", None) or FLUX_UNIT
    try:
        values = np.array(getattr(sample, "value", sample), dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise ValueError(f"flux_sample is {sample!r}; give a list of fluxes.") from None
    if values.size == 0:
        raise ValueError("flux_sample is empty; give at least one flux.")
    nowhere = np.zeros(values.size)
    stars = {"kind": np.full(values.size, "point"), "x": nowhere, "y": nowhere}
    try:
        check_sources(QTable({**stars, "flux": values * unit}))
    except ValueError as error:
        raise ValueError(f"flux_sample: {error}") from None
    return values[rng.integers(values.size, size=count)] * unit

"""How the fluxes of sources change with time, each image of a lens with its own delay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .counts import checked_seed
from .psf import positive

Array = NDArray[np.float64]
# Flux over that of the source table as a function of time, or as (times, factors).
LightCurve = Callable[[float], float] | tuple[Any, Any]
# Steps of a random walk in the time after which it forgets.
STEPS = 50
# Steps from time 0 that a random walk goes at most: seconds to compute.
FARTHEST = 10_000_000


def flux_factors(
    light_curves: Mapping[int, LightCurve] | None,
    delays: Mapping[int, float] | None,
    times: Array,
    rows: int,
) -> Array:
    """Evaluate light curves at the epochs.

    Parameters
    ----------
    light_curves : mapping of int to callable or (times, factors), optional
        By row of the source table: flux over that of the table, as a function of time or as a
        table that is interpolated linearly. Rows without one are constant.
    delays : mapping of int to float, optional
        By row: the light curve arrives so much later, in the unit of the times.
    times : ndarray, shape (epochs,)
        Times of the epochs.
    rows : int
        Number of sources.

    Returns
    -------
    ndarray, shape (epochs, rows)
        The factor of row r at time t is ``light_curves[r](t - delays[r])``.

    Raises
    ------
    ValueError
        If a row does not exist, a delay has no light curve, a table does not cover an epoch, or
        a factor is negative or not finite.
    """
    factors = np.ones((times.size, rows))
    curves, shifts = dict(light_curves or {}), dict(delays or {})
    for row in (*curves, *shifts):
        if isinstance(row, bool) or not hasattr(row, "__index__") or not 0 <= row < rows:
            raise ValueError(f"there is no row {row!r}; the source table has rows 0 to {rows - 1}.")
    for row in shifts:
        if row not in curves:
            raise ValueError(f"row {row} has a delay and no light curve; give it one.")
    for row, curve in curves.items():
        shift = float(shifts.get(row, 0.0))
        factors[:, row] = _values(row, curve, times - shift)
        for time, factor in zip(times, factors[:, row], strict=True):
            if not (np.isfinite(factor) and factor >= 0):
                raise ValueError(
                    f"row {row}, time {time:g}: the light curve gives {factor}; "
                    "it must be finite and 0 or more."
                )
    return factors


def _values(row: int, curve: Any, times: Array) -> Array:
    if callable(curve):
        return np.array([float(curve(float(time))) for time in times])
    try:
        when, factors = (np.asarray(part, dtype=np.float64) for part in curve)
    except (TypeError, ValueError):
        raise ValueError(
            f"row {row}: a light curve is a function of time or (times, factors), not {curve!r}."
        ) from None
    if when.ndim != 1 or when.shape != factors.shape or not when.size:
        raise ValueError(f"row {row}: times and factors of a light curve are two equal lists.")
    if not np.all(np.diff(when) > 0):
        raise ValueError(f"row {row}: the times of a light curve must increase.")
    for time in times:
        if not when[0] <= time <= when[-1]:
            raise ValueError(
                f"row {row}: the light curve covers {when[0]:g} to {when[-1]:g}, but {time:g} is "
                "needed (an epoch less the delay); lengthen it."
            )
    return np.interp(times, when, factors)


def sinusoid(amplitude: float, period: float, phase: float = 0.0) -> Callable[[float], float]:
    """Make the light curve of a sinusoidal variation in magnitudes.

    Parameters
    ----------
    amplitude : float
        Half of the difference between brightest and faintest, magnitudes, 0 or more.
    period : float
        In the unit of the times.
    phase : float
        Degrees at time 0; at 90 the source is brightest.

    Returns
    -------
    callable
        Flux factor as a function of time.

    Raises
    ------
    ValueError
        If a value is out of range; the message names it.
    """
    amplitude, period = _variation(amplitude), positive("period", period, "the times' unit")
    if not np.isfinite(phase):
        raise ValueError(f"phase is {phase}; it must be a finite angle in degrees.")

    def factor(time: float) -> float:
        wave = np.sin(2 * np.pi * time / period + np.radians(phase))
        return float(10 ** (0.4 * amplitude * wave))

    return factor


def damped_random_walk(amplitude: float, tau: float, *, seed: int = 0) -> Callable[[float], float]:
    """Make the light curve of a damped random walk in magnitudes, as quasars show.

    Parameters
    ----------
    amplitude : float
        Standard deviation over long times, magnitudes, 0 or more. For quasars 0.1 to 0.3.
    tau : float
        Time after which it forgets, in the unit of the times. For quasars 100 to 1000 days.
    seed : int
        Each seed is a curve of its own, at all times from minus to plus infinity.

    Returns
    -------
    callable
        Flux factor as a function of time.

    Raises
    ------
    ValueError
        If a value is out of range, or a time is farther than 200,000 tau from 0.

    Notes
    -----
    The Ornstein-Uhlenbeck process, of covariance amplitude^2 exp(-|dt| / tau) (Kelly, Bechtold
    & Siemiginowska 2009, ApJ 698, 895), exact at multiples of tau / 50 and linear between.
    """
    amplitude, tau = _variation(amplitude), positive("tau", tau, "the times' unit")
    seeds = np.random.SeedSequence(checked_seed(seed)).spawn(2)
    generators = [np.random.default_rng(one) for one in seeds]
    start = amplitude * float(generators[0].standard_normal())
    # magnitudes at multiples of a step, forwards and backwards from time 0
    walks = [[start], [start]]
    keep = float(np.exp(-1 / STEPS))
    kick = amplitude * float(np.sqrt(1 - keep**2))

    def node(k: int) -> float:
        walk, generator = walks[k < 0], generators[k < 0]
        while len(walk) <= abs(k):
            walk.append(keep * walk[-1] + kick * float(generator.standard_normal()))
        return walk[abs(k)]

    def factor(time: float) -> float:
        place = time * STEPS / tau
        if not abs(place) <= FARTHEST:
            raise ValueError(
                f"time {time:g} is more than {FARTHEST / STEPS:,.0f} tau from 0; count the times "
                "from a nearer day."
            )
        k = int(np.floor(place))
        magnitude = node(k) + (place - k) * (node(k + 1) - node(k))
        return float(10 ** (-0.4 * magnitude))

    return factor


def _variation(amplitude: float) -> float:
    return positive("amplitude", amplitude, "magnitudes", zero=True)

"""The exposure time that a goal asks for: a signal-to-noise ratio, a flux ratio, a position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .fisher import Covariance, covariance
from .limits import warn_of_count_rates
from .observation import Observation

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


def exposure_for(
    sources: Table,
    observation: Observation | None = None,
    *,
    rows: int | Sequence[int],
    snr: float | None = None,
    flux_ratio: float | None = None,
    position: Any = None,
) -> u.Quantity:
    """Exposure time after which a goal is reached, all sources of the scene fitted together.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation, optional
        The instrument set-up; its exposure time does not matter.
    rows : int or sequence of int
        Rows of the sources the goal is for. Of several the worst decides; ``flux_ratio`` takes
        two.
    snr : float, optional
        Goal: flux over its 1-sigma error.
    flux_ratio : float, optional
        Goal: relative 1-sigma error of the ratio of two sources' fluxes, 0.01 for 1 %.
    position : float or Quantity, optional
        Goal: 1-sigma error of x and of y, in pixels or as an angle.

    Returns
    -------
    astropy.units.Quantity
        The exposure time, s.

    Raises
    ------
    ValueError
        If there is not exactly one goal above zero, if a row does not exist, or if no exposure
        time reaches the goal; the message names the row.

    Warns
    -----
    CountRateWarning
        If the scene breaks a count-rate limit, which no exposure time cures.

    Notes
    -----
    Counts of sources, sky and dark current all grow with time, and with them the Fisher
    information: errors fall as the root of the exposure time, exactly, so that the time
    follows from the error after 1 s.
    """
    observation = Observation() if observation is None else observation
    goals = {"snr": snr, "flux_ratio": flux_ratio, "position": position}
    given = {name: value for name, value in goals.items() if value is not None}
    if len(given) != 1:
        raise ValueError(f"{len(given)} goals are given; give one of snr, flux_ratio and position.")
    ((name, value),) = given.items()
    goal = _number(name, value, observation.pixel_scale)
    chosen = checked_rows(name, rows, len(sources))
    result = covariance(sources, observation)
    value, _ = after_one_second(result, name, chosen)
    warn_of_count_rates(result.source_rate, sources, observation)
    return seconds_for(name, goal, value) * u.s


def checked_rows(name: str, rows: int | Sequence[int], count: int) -> Rows:
    """Return rows of a table of ``count`` sources that a goal can be for.

    Raises
    ------
    ValueError
        If there is none, one does not exist, or a flux ratio is not of two.
    """
    chosen: Rows = np.atleast_1d(np.asarray(rows, dtype=np.intp))
    if not chosen.size:
        raise ValueError("rows is empty; name at least one row of the source table.")
    for row in chosen[(chosen < 0) | (chosen >= count)]:
        raise ValueError(f"there is no row {row}; the table has {count} rows, from 0.")
    if name == "flux_ratio" and (chosen.size != 2 or chosen[0] == chosen[1]):
        raise ValueError(f"rows is {chosen.tolist()}; flux_ratio takes two different rows.")
    return chosen


def after_one_second(result: Covariance, name: str, chosen: Rows) -> tuple[float, int]:
    """Return what 1 s of exposure reaches for the worst of the chosen rows, and that row.

    An S/N, a relative error of a flux ratio, or an error of a position in pixels.

    Raises
    ------
    ValueError
        If one of them is never reached; the message names the row.
    """
    rates = result.rates[chosen]
    for row in chosen[rates <= 0] if name != "position" else ():
        raise ValueError(f"row {row} has no flux: no exposure time reaches the goal.")
    for row in chosen[~np.isfinite(result.variance[chosen, :3]).all(axis=1)]:
        raise ValueError(
            f"row {row} cannot be measured (no flux, outside the frame, or at the place of "
            "another source): no exposure time reaches the goal."
        )
    if name == "position":
        errors = np.sqrt(result.variance[chosen, 1:3].max(axis=1))
        worst = int(np.argmax(errors))
        return float(errors[worst]), int(chosen[worst])
    relative = np.sqrt(result.variance[chosen, 0]) / rates
    worst = int(np.argmax(relative))
    if name == "snr":
        return float(1 / relative[worst]), int(chosen[worst])
    correlation = result.correlation.tocsr()[int(chosen[0]), int(chosen[1])]
    variance = relative @ relative - 2 * correlation * relative.prod()
    return float(np.sqrt(variance)), int(chosen[worst])


def seconds_for(name: str, goal: float, value: float) -> float:
    """Exposure time, s, that reaches a goal from what 1 s reaches."""
    return (goal / value) ** 2 if name == "snr" else (value / goal) ** 2


def reached(name: str, value: float, seconds: Array) -> Array:
    """Return what exposures reach, from what 1 s reaches."""
    root: Array = np.sqrt(seconds)
    return value * root if name == "snr" else value / root


def _number(name: str, value: Any, pixel_scale: float) -> float:
    unit = u.pix if name == "position" else u.dimensionless_unscaled
    try:
        scale = u.pixel_scale(pixel_scale * u.arcsec / u.pix)
        number = float(u.Quantity(value, getattr(value, "unit", unit)).to_value(unit, scale))
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} is {value!r}; it must be a number ({unit or 'no unit'})."
        ) from None
    if not np.isfinite(number) or number <= 0:
        raise ValueError(f"{name} is {value}; it must be finite and above zero.")
    return number

"""The exposure time that a goal asks for: a signal-to-noise ratio, a flux ratio, a position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import Table

from .fisher import covariance
from .limits import warn_of_count_rates
from .observation import Observation


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
    chosen = np.atleast_1d(np.asarray(rows, dtype=np.intp))
    if not chosen.size:
        raise ValueError("rows is empty; name at least one row of the source table.")
    for row in chosen[(chosen < 0) | (chosen >= len(sources))]:
        raise ValueError(f"there is no row {row}; the table has {len(sources)} rows, from 0.")
    if name == "flux_ratio" and (chosen.size != 2 or chosen[0] == chosen[1]):
        raise ValueError(f"rows is {chosen.tolist()}; flux_ratio takes two different rows.")
    result = covariance(sources, observation)
    rates = result.rates[chosen]
    for row in chosen[rates <= 0] if name != "position" else ():
        raise ValueError(f"row {row} has no flux: no exposure time reaches the goal.")
    for row in chosen[~np.isfinite(result.variance[chosen, :3]).all(axis=1)]:
        raise ValueError(
            f"row {row} cannot be measured (no flux, outside the frame, or at the place of "
            "another source): no exposure time reaches the goal."
        )
    if name == "snr":
        seconds = goal**2 * result.variance[chosen, 0] / rates**2
    elif name == "position":
        seconds = result.variance[chosen, 1:3].max(axis=1) / goal**2
    else:
        relative = np.sqrt(result.variance[chosen, 0]) / rates
        correlation = result.correlation.tocsr()[int(chosen[0]), int(chosen[1])]
        seconds = (relative @ relative - 2 * correlation * relative.prod()) / goal**2
    warn_of_count_rates(result.source_rate, sources, observation)
    return float(np.max(seconds)) * u.s


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

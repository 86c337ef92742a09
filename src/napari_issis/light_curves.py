"""How the fluxes of sources change with time, each image of a lens with its own delay."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Flux over that of the source table as a function of time, or as (times, factors).
LightCurve = Callable[[float], float] | tuple[Any, Any]


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

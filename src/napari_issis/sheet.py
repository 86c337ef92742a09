"""A proposal sheet: what a proposal's figure shows, promises and assumes, on one page."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .counts import checked_seed
from .exposure import Exposure, expose, noise_ready_rate
from .exposure_goal import checked_rows, exposure_for
from .forecast import forecast
from .limits import CountRateWarning, count_rate_warnings
from .observation import OPEN, Observation
from .safe_write import check_target, replacing
from .sheet_page import page
from .source_rates import sources_and_rates

SUFFIXES = (".html", ".htm")
# Sources of which a sheet shows the forecast unless rows are given.
SHOWN = 15
GOALS = ("snr", "flux_ratio", "position")


@dataclass(frozen=True, eq=False)
class ChannelResult:
    """What a sheet shows of one set-up.

    Attributes
    ----------
    exposure : Exposure
        The simulated exposure.
    source_rate : float
        Expected rate of the sources in the frame, cps.
    forecast : astropy.table.QTable
        Of all sources, see `napari_issis.forecast`.
    times : tuple of (float or str)
        For each goal the exposure time in s, or why there is none.
    warnings : tuple of str
        Of count rates.
    """

    exposure: Exposure
    source_rate: float
    forecast: QTable
    times: tuple[float | str, ...]
    warnings: tuple[str, ...]


def proposal_sheet(
    sources: Table,
    observations: Observation | Sequence[Observation],
    path: str | os.PathLike[str],
    *,
    seed: int = 0,
    goals: Sequence[Mapping[str, Any]] = (),
    rows: Sequence[int] | None = None,
    title: str = "",
    notes: str = "",
    date: str = "",
    overwrite: bool = False,
) -> None:
    """Write a page on a scene: pictures, settings, forecasts, warnings, how to make it again.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table. A column ``name`` names them on the page; else the rows do.
    observations : Observation or sequence of Observation
        One or two set-ups of frames of the same shape. Of a single one the other channel is
        added, see `both_channels`.
    path : path-like
        The file; its name ends in ``.html``. It is complete in itself, holds no scripts and
        prints on A4.
    seed : int
        Seed of the noise of all exposures.
    goals : sequence of mapping
        Arguments of `exposure_for`, such as ``{"rows": 3, "snr": 20}``: the page tells the
        exposure time of each.
    rows : sequence of int, optional
        Rows of the source table whose forecast is shown; the brightest 15 by default. The
        forecast itself is always of all sources together.
    title, notes, date : str
        What else stands on the page. The same input gives the same file, byte by byte: no
        date is put in unless given.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If an argument is not as above; the message names it.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.
    """
    check_target(path, SUFFIXES, overwrite=overwrite)
    seed = checked_seed(seed)
    given = [observations] if isinstance(observations, Observation) else list(observations)
    if not 1 <= len(given) <= 2 or not all(isinstance(one, Observation) for one in given):
        raise ValueError(f"observations is {observations!r}; give one or two Observations.")
    if len({one.shape for one in given}) > 1:
        shapes = ", ".join(str(one.shape) for one in given)
        raise ValueError(f"the observations' shapes are {shapes}; give frames of the same shape.")
    asked = [_checked_goal(goal, len(sources)) for goal in goals]
    shown = _rows(rows, sources, given[0])
    added = ""
    if len(given) == 1:
        given = list(both_channels(given[0]))
        added = given[-1].channel if len(given) > 1 else ""
    results = [_result(sources, one, seed, asked) for one in given]
    text = page(
        results,
        shown=shown,
        goals=asked,
        added=added,
        title=str(title),
        notes=str(notes),
        date=str(date),
    )
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        file.write(text.encode("utf-8"))


def both_channels(observation: Observation) -> tuple[Observation, ...]:
    """Return an observation and the same one in the next channel of the camera, if it has one.

    That has the channel's own PSF and sky; neutral filters stay, others have no counterpart
    and are open.
    """
    camera = observation.instrument
    channels = list(camera.channels)
    other = channels[(channels.index(observation.channel) + 1) % len(channels)]
    if other == observation.channel:
        return (observation,)
    filters = tuple(
        one if isinstance(one, str) and one in camera.neutral_filters else OPEN[0]
        for one in observation.filters
    )
    changes: dict[str, Any] = {"channel": other, "filters": filters, "psf": None}
    return observation, observation.replace(**changes, background=None)


def _result(
    sources: Table, observation: Observation, seed: int, goals: Sequence[Mapping[str, Any]]
) -> ChannelResult:
    rate, clipped = noise_ready_rate(sources, observation)
    background = observation.background_rate
    messages = count_rate_warnings(rate, background, sources=sources, observation=observation)
    return ChannelResult(
        exposure=expose(rate, sources, observation, seed=seed, clipped=clipped),
        source_rate=float(rate.sum()),
        forecast=forecast(sources, observation),
        times=tuple(_time(sources, observation, goal) for goal in goals),
        warnings=tuple(messages),
    )


def _time(sources: Table, observation: Observation, goal: Mapping[str, Any]) -> float | str:
    with warnings.catch_warnings():
        # they stand on the page already
        warnings.simplefilter("ignore", CountRateWarning)
        try:
            return float(exposure_for(sources, observation, **goal).to_value("s"))
        except ValueError as error:
            return str(error)


def _checked_goal(goal: Any, number: int) -> dict[str, Any]:
    if (
        not isinstance(goal, Mapping)
        or "rows" not in goal
        or len(goal) != 2
        or not set(goal) - {"rows"} <= set(GOALS)
    ):
        raise ValueError(
            f"a goal is {goal!r}; give the rows and one of {', '.join(GOALS)}, such as "
            '{"rows": 3, "snr": 20}.'
        )
    (name,) = set(goal) - {"rows"}
    try:
        checked_rows(name, goal["rows"], number)
    except ValueError as error:
        raise ValueError(f"a goal is {goal!r}: {error}") from error
    return dict(goal)


def _rows(rows: Sequence[int] | None, sources: Table, observation: Observation) -> NDArray[np.intp]:
    _, rates = sources_and_rates(sources, observation)
    if rows is None:
        brightest = np.argsort(-rates, kind="stable")[:SHOWN]
        return np.sort(brightest)
    chosen = np.atleast_1d(np.asarray(rows, dtype=np.intp))
    for row in chosen[(chosen < 0) | (chosen >= len(rates))]:
        raise ValueError(f"there is no row {row}; the table has {len(rates)} rows, from 0.")
    return chosen

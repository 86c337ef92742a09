"""Count rates at which a photon-counting detector stops being linear."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from itertools import combinations_with_replacement
from math import inf, prod
from typing import Any

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .bright_sources import bright_sources
from .filters import Filter
from .instrument import OPEN, Instrument
from .observation import Observation

# How many sources a warning names.
NAMED = 3


class CountRateWarning(UserWarning):
    """The scene is brighter than a photon-counting detector counts linearly."""


def count_rate_warnings(
    rate: NDArray[np.float64],
    background_rate: float,
    *,
    sources: Table | None = None,
    observation: Observation | None = None,
) -> list[str]:
    """Sentences for each limit that the scene breaks, the last with the cure; none if none.

    Parameters
    ----------
    rate : ndarray, shape (ny, nx)
        Count rate of the sources, cps per pixel, filters included.
    background_rate : float
        Sky and dark rate, cps per pixel, filters included.
    sources : astropy.table.QTable, optional
        The source table. With it and ``observation`` the sources that break the local limit
        are named.
    observation : Observation, optional
        The instrument set-up, by default that of ISSIS. The cure allows for the filters that
        it has.

    Notes
    -----
    The limits are the channel's. Those of ISSIS are of HST ACS/SBC, the nearest analogue: none
    has been published. The frame stands for the detector; light outside it is not seen.
    """
    if rate.size == 0:
        return []
    own = Observation() if observation is None else observation
    detector = own.instrument.limits_note or f"the detector of {own.instrument.name}"
    local_limit, total_limit = _limits(own)
    messages = []
    total = float(rate.sum() + background_rate * rate.size)
    if total > total_limit:
        messages.append(
            f"The frame receives {total:.3g} cps; {detector} is linear up to {total_limit:.0e} cps."
        )
    local = rate + background_rate
    peak = float(local.max())
    if peak > local_limit:
        y, x = np.unravel_index(int(local.argmax()), local.shape)
        count = int(np.count_nonzero(local > local_limit))
        pixels = "1 pixel receives" if count == 1 else f"{count} pixels receive"
        messages.append(
            f"{pixels} more than {local_limit:g} cps, at most {peak:.3g} cps at x = {x}, "
            f"y = {y}; {detector} counts linearly below that."
        )
        if sources is not None and observation is not None:
            messages[-1] += _names(sources, bright_sources(sources, observation, rate))
    if messages:
        excess = max(total / total_limit, peak / local_limit)
        messages[-1] += f" {_cure(excess, own.filters, own.instrument)}"
    return messages


def brief_warning(
    rate: NDArray[np.float64], background_rate: float, sources: Table, observation: Observation
) -> str:
    """Say in a line or two what `count_rate_warnings` says; empty if no limit is broken.

    It names the source with the brightest pixel, or the rate in all where no pixel is too
    bright, and the cure. Parameters as there.
    """
    if rate.size == 0:
        return ""
    local_limit, total_limit = _limits(observation)
    total = float(rate.sum() + background_rate * rate.size)
    peak = float(rate.max()) + background_rate
    if total <= total_limit and peak <= local_limit:
        return ""
    text = f"Too bright: {total:.3g} cps in all (limit {total_limit:.0e})."
    if peak > local_limit:
        rows = bright_sources(sources, observation, rate)
        there = f", row {rows[0]}" if rows.size else ""
        more = f" and {rows.size - 1} more" if rows.size > 1 else ""
        text = f"Too bright: {peak:.3g} cps/px (limit {local_limit:g}){there}{more}."
    excess = max(total / total_limit, peak / local_limit)
    cure = _cure(excess, observation.filters, observation.instrument)
    return f"{text} {cure.removeprefix('The neutral filter ')}"


def warn_of_count_rates(
    rate: NDArray[np.float64], sources: Table, observation: Observation, *, stacklevel: int = 2
) -> None:
    """Issue a `CountRateWarning` for each limit that a scene breaks, as `count_rate_warnings`.

    ``stacklevel`` is that of `warnings.warn`, counted from the caller.
    """
    for message in count_rate_warnings(
        rate, observation.background_rate, sources=sources, observation=observation
    ):
        warnings.warn(message, CountRateWarning, stacklevel=stacklevel + 1)


def _limits(observation: Observation) -> tuple[float, float]:
    """Count rates per pixel and in all above which the channel's detector is not linear, cps."""
    channel = observation.channel_data
    return channel.local_limit or inf, channel.total_limit or inf


def _names(sources: Table, rows: NDArray[np.int64]) -> str:
    if not rows.size:
        return ""
    named = [
        f"{sources['kind'][row]} at x = {_pixels(sources['x'][row]):.1f}, "
        f"y = {_pixels(sources['y'][row]):.1f} (row {row})"
        for row in rows[:NAMED]
    ]
    more = f" and {rows.size - NAMED} more" if rows.size > NAMED else ""
    return f" {'Source' if rows.size == 1 else 'Sources'} there: {'; '.join(named)}{more}."


def _pixels(value: Any) -> float:
    return float(getattr(value, "value", value))


def _cure(excess: float, filters: tuple[str | Filter, str | Filter], instrument: Instrument) -> str:
    """Name the brightest neutral filters that bring the excess to 1 beside the curves."""
    passed = instrument.neutral_filters

    def product(names: Iterable[str]) -> float:
        return prod(passed[name] for name in names)

    neutral = [one for one in filters if not isinstance(one, Filter) and one in passed]
    needed = product(neutral) / excess * (1 + 1e-12)
    present = " and ".join(one for one in neutral if one != OPEN)
    instead = f" in place of {present}" if present else ""
    names = [name for name in passed if name != OPEN]
    choices = [
        one for n in (1, 2)[: len(neutral)] for one in combinations_with_replacement(names, n)
    ]
    # one filter rather than two that pass as much
    for chosen in sorted(choices, key=lambda one: (-round(product(one), 9), len(one))):
        if product(chosen) <= needed:
            first, *others = chosen
            text = f"{first} twice" if others == [first] else " and ".join(chosen)
            return f"The neutral filter {text}{instead} would cure it."
    return "No neutral filter cures it."

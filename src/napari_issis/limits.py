"""Count rates at which a photon-counting detector stops being linear."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
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
    named = None if observation is None else sources
    own = Observation() if observation is None else observation
    breach = _breach(rate, background_rate, named, own)
    return [] if breach is None else breach.at_length()


def long_and_brief(
    rate: NDArray[np.float64], background_rate: float, sources: Table, observation: Observation
) -> tuple[list[str], str]:
    """Return what `count_rate_warnings` says, and the same in a line or two, empty if nothing.

    The latter names the source with the brightest pixel, or the rate in all where no pixel is
    too bright, and the cure. Parameters as there.
    """
    breach = _breach(rate, background_rate, sources, observation)
    return ([], "") if breach is None else (breach.at_length(), breach.briefly())


@dataclass(frozen=True)
class _Breach:
    """How far a scene is above the limits; ``sources`` None where they are not to be named."""

    local: NDArray[np.float64]
    total: float
    peak: float
    limits: tuple[float, float]
    sources: Table | None
    rows: NDArray[np.int64]
    observation: Observation

    def at_length(self) -> list[str]:
        detector = self._detector
        local_limit, total_limit = self.limits
        messages = []
        if self.total > total_limit:
            messages.append(
                f"The frame receives {self.total:.3g} cps; {detector} is linear up to "
                f"{total_limit:.0e} cps."
            )
        if self.peak > local_limit:
            y, x = np.unravel_index(int(self.local.argmax()), self.local.shape)
            count = int(np.count_nonzero(self.local > local_limit))
            pixels = "1 pixel receives" if count == 1 else f"{count} pixels receive"
            messages.append(
                f"{pixels} more than {local_limit:g} cps, at most {self.peak:.3g} cps at x = {x}, "
                f"y = {y}; {detector} counts linearly below that."
            )
            if self.sources is not None:
                messages[-1] += _names(self.sources, self.rows)
        messages[-1] += f" {self._cure()}"
        return messages

    def of_a_sequence(self) -> list[str]:
        """Name the limits alone: the same words for all exposures that break them."""
        detector = self._detector
        local_limit, total_limit = self.limits
        messages = []
        if self.total > total_limit:
            messages.append(
                f"Exposures of the sequence receive more than {total_limit:.0e} cps in all; "
                f"{detector} is linear up to that."
            )
        if self.peak > local_limit:
            messages.append(
                f"Exposures of the sequence have pixels that receive more than {local_limit:g} "
                f"cps; {detector} counts linearly below that. Simulate one of them to see where."
            )
        return messages

    def briefly(self) -> str:
        local_limit, total_limit = self.limits
        if self.peak > local_limit:
            rows = self.rows
            there = f", row {rows[0]}" if rows.size else ""
            more = f" and {rows.size - 1} more" if rows.size > 1 else ""
            text = f"Too bright: {self.peak:.3g} cps/px (limit {local_limit:g}){there}{more}."
        else:
            text = f"Too bright: {self.total:.3g} cps in all (limit {total_limit:.0e})."
        return f"{text} {self._cure().removeprefix('The neutral filter ')}"

    @property
    def _detector(self) -> str:
        camera = self.observation.instrument
        return camera.limits_note or f"the detector of {camera.name}"

    def _cure(self) -> str:
        local_limit, total_limit = self.limits
        excess = max(self.total / total_limit, self.peak / local_limit)
        return _cure(excess, self.observation.filters, self.observation.instrument)


def _breach(
    rate: NDArray[np.float64],
    background_rate: float,
    sources: Table | None,
    observation: Observation,
) -> _Breach | None:
    if rate.size == 0:
        return None
    channel = observation.channel_data
    limits = channel.local_limit or inf, channel.total_limit or inf
    local = rate + background_rate
    total, peak = float(rate.sum() + background_rate * rate.size), float(local.max())
    if peak <= limits[0] and total <= limits[1]:
        return None
    rows = np.empty(0, dtype=np.int64)
    if sources is not None and peak > limits[0]:
        rows = bright_sources(sources, observation, rate)
    return _Breach(local, total, peak, limits, sources, rows, observation)


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


def warn_of_a_sequence(rate: NDArray[np.float64], observation: Observation) -> None:
    """Issue a `CountRateWarning` for each limit that an exposure of a sequence breaks.

    Its text is the same for all of them, so that Python and napari show it once.
    """
    breach = _breach(rate, observation.background_rate, None, observation)
    for message in [] if breach is None else breach.of_a_sequence():
        warnings.warn(message, CountRateWarning, stacklevel=2)


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

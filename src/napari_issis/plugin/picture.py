"""What the scene shows: rendered where needed, kept where not. Runs in the worker thread."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from ..counts import poisson_counts
from ..detector import IDEAL
from ..drag import Drag
from ..exposure import (
    Exposure,
    accuracy_for_counts,
    dead_share,
    expected_of_rate,
    expose,
    noise_ready_rate,
    same_table,
)
from ..limits import long_and_brief
from ..observation import Observation

Array = NDArray[np.float64]
# what a rate depends on, beside the sources
Rendered = tuple[Observation, tuple[float, float | None]]

# Largest error while the mouse moves, over the image's peak: no more than the sky.
PREVIEW_TOLERANCE = 1e-6
# share of the sky that the error may have anyway
PREVIEW_SHARE = 0.05


@dataclass(frozen=True)
class Picture:
    """An exposure to show; ``final`` unless it is a preview during a drag.

    ``warning`` says briefly which count-rate limit is broken, ``warnings`` at length.
    """

    exposure: Exposure
    warnings: tuple[str, ...] = ()
    warning: str = ""
    final: bool = True


@dataclass
class HeldSources:
    """Sources held by the mouse: the table when it was pressed, and which of them move.

    ``live`` holds the count rate that follows them, with the observation it belongs to;
    ``drawn`` the latest expected counts and counts, with the observation and the seed.
    """

    sources: QTable
    source_id: NDArray[np.int64]
    moving: frozenset[int]
    live: tuple[Rendered, Drag] | None = field(default=None)
    drawn: tuple[tuple[Observation, int], Array, NDArray[np.int64]] | None = field(default=None)


class PictureMaker:
    """Makes pictures, and keeps the last rate so that a new exposure time renders nothing."""

    def __init__(self) -> None:
        self._kept: tuple[QTable, Rendered, Array, float] | None = None

    def final(self, sources: QTable, observation: Observation, seed: int) -> Picture:
        """Make the exposure that `napari_issis.simulate` makes of the same scene."""
        rate, clipped = self._rate(sources, observation)
        at_length, brief = long_and_brief(rate, observation.background_rate, sources, observation)
        exposure = expose(rate, sources, observation, seed=seed, clipped=clipped)
        return Picture(exposure, tuple(at_length), brief)

    def preview(
        self,
        held: HeldSources,
        sources: QTable,
        source_id: NDArray[np.int64],
        observation: Observation,
        seed: int,
    ) -> Picture:
        """Make a picture in which only the held sources are drawn anew."""
        rendered = _rendered(observation)
        if held.live is None or held.live[0] != rendered:
            drag = self._live(held.sources[:0], observation, self._rest(held, observation))
            held.live = (rendered, drag)
        live = held.live[1]
        moving = np.isin(source_id, held.source_id, invert=True)
        moving |= np.isin(source_id, list(held.moving))
        windows = live.move(sources[moving])
        dead = dead_share(observation)
        if held.drawn is not None and held.drawn[0] == (observation, seed):
            _, before, counts = held.drawn
            expected = before.copy()
            for window in windows:
                expected[window] = _expected(live.rate[window], observation)
            counts = poisson_counts(
                expected, seed, dead_share=dead, previous=(before, counts), windows=windows
            )
        else:
            expected = _expected(live.rate, observation)
            counts = poisson_counts(expected, seed, dead_share=dead)
        # those taken over are stored already, which changes nothing a second time
        counts = observation.detector.stored(counts)
        held.drawn = ((observation, seed), expected, counts)
        table = QTable(sources, copy=True)
        return Picture(Exposure(counts, expected, table, observation, seed), final=False)

    def _rate(self, sources: QTable, observation: Observation) -> tuple[Array, float]:
        rendered = _rendered(observation)
        if not self._keeps(sources, rendered):
            rate, clipped = noise_ready_rate(sources, observation.without_neutral_filters())
            self._kept = (sources, rendered, rate, clipped)
        assert self._kept is not None
        _, _, rate, clipped = self._kept
        passed = observation.neutral_transmittance
        return rate * passed, clipped * passed

    def _keeps(self, sources: QTable, rendered: Rendered) -> bool:
        return (
            self._kept is not None
            and self._kept[1] == rendered
            and same_table(self._kept[0], sources)
        )

    def _rest(self, held: HeldSources, observation: Observation) -> Array:
        """Rate of the sources that do not move: the whole less the others, if it is known."""
        observation = observation.without_neutral_filters()
        moving = np.isin(held.source_id, list(held.moving))
        if self._keeps(held.sources, _rendered(observation)):
            whole, _ = self._rate(held.sources, observation)
            if not moving.any():
                return whole
            if 2 * moving.sum() <= moving.size:
                part = self._live(held.sources[moving], observation, np.zeros(whole.shape))
                return np.maximum(whole - part.rate, 0.0)
        return noise_ready_rate(held.sources[~moving], observation)[0]

    def _live(self, moving: QTable, observation: Observation, rest: Array) -> Drag:
        """Put sources that move on the rate of the others."""
        bare, _ = _rendered(observation)
        return Drag(
            moving,
            bare,
            range(len(moving)),
            tolerance=PREVIEW_TOLERANCE,
            negligible=PREVIEW_SHARE * observation.without_neutral_filters().sky_rate,
            rest=rest,
        )


def _expected(rate: Array, observation: Observation) -> Array:
    """Return the expected counts of rates at open-open."""
    sources = np.maximum(rate, 0.0) * observation.neutral_transmittance
    return expected_of_rate(sources, observation)


def _rendered(observation: Observation) -> Rendered:
    """Return the observation less what needs no rendering, and the accuracy it asks for.

    Rates are kept at open-open, for one second and without a sky.
    """
    bare = observation.without_neutral_filters().replace(
        exposure=1.0, background=0.0, dark=0.0, detector=IDEAL, pointing=None, roll=0.0
    )
    return bare, accuracy_for_counts(observation)

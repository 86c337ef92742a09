"""What the scene shows: rendered where needed, kept where not. Runs in the worker thread."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from ..exposure import Exposure, expose, noise_ready_rate, same_table
from ..limits import count_rate_warnings
from ..observation import OPEN, Observation
from ..render import count_rate

Array = NDArray[np.float64]

# Largest error of the moved sources while the mouse moves, over their peak: no more than the
# sky, and one set of filters serves the renderer for the whole drag.
PREVIEW_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Picture:
    """An exposure to show; ``final`` unless it is a preview during a drag."""

    exposure: Exposure
    warnings: tuple[str, ...] = ()
    final: bool = True


@dataclass
class Drag:
    """A drag in progress: the table at its start and the sources that move.

    ``rest`` is the rate of all others, with the observation it was rendered for.
    """

    sources: QTable
    source_id: NDArray[np.int64]
    moving: frozenset[int]
    rest: tuple[Any, Array] | None = field(default=None)


class PictureMaker:
    """Makes pictures, and keeps the last rate so that a new exposure time renders nothing."""

    def __init__(self) -> None:
        self._kept: tuple[QTable, Observation, Array, float] | None = None

    def final(self, sources: QTable, observation: Observation, seed: int) -> Picture:
        """Make the exposure that `napari_issis.simulate` makes of the same scene."""
        rate, clipped = self._rate(sources, observation)
        return Picture(
            expose(rate, sources, observation, seed=seed, clipped=clipped),
            tuple(count_rate_warnings(rate, observation.sky_rate)),
        )

    def preview(
        self,
        drag: Drag,
        sources: QTable,
        source_id: NDArray[np.int64],
        observation: Observation,
        seed: int,
    ) -> Picture:
        """Make a picture in which only the moving sources are rendered anew."""
        rendered = _rendered(observation)
        if drag.rest is None or drag.rest[0] != rendered:
            drag.rest = (rendered, self._rest(drag, rendered))
        moving = np.isin(source_id, drag.source_id, invert=True)
        moving |= np.isin(source_id, list(drag.moving))
        rate = drag.rest[1]
        if moving.any():
            moved = count_rate(sources[moving], rendered, tolerance=PREVIEW_TOLERANCE)
            rate = np.maximum(rate + moved, 0.0)
        rate = rate * observation.transmittance
        return Picture(expose(rate, sources, observation, seed=seed), final=False)

    def _rate(self, sources: QTable, observation: Observation) -> tuple[Array, float]:
        rendered = _rendered(observation)
        if not self._keeps(sources, rendered):
            rate, clipped = noise_ready_rate(sources, rendered)
            self._kept = (sources, rendered, rate, clipped)
        assert self._kept is not None
        _, _, rate, clipped = self._kept
        return rate * observation.transmittance, clipped * observation.transmittance

    def _keeps(self, sources: QTable, rendered: Observation) -> bool:
        return (
            self._kept is not None
            and self._kept[1] == rendered
            and same_table(self._kept[0], sources)
        )

    def _rest(self, drag: Drag, rendered: Observation) -> Array:
        """Rate of the sources that do not move: the whole less the others, if it is known."""
        moving = np.isin(drag.source_id, list(drag.moving))
        if self._keeps(drag.sources, rendered):
            whole, _ = self._rate(drag.sources, rendered)
            if not moving.any():
                return whole
            if 2 * moving.sum() <= moving.size:
                part = count_rate(drag.sources[moving], rendered, tolerance=PREVIEW_TOLERANCE)
                return np.maximum(whole - part, 0.0)
        return noise_ready_rate(drag.sources[~moving], rendered)[0]


def _rendered(observation: Observation) -> Observation:
    """Return the observation less what needs no rendering: at open-open, for one second."""
    return observation.replace(filters=OPEN, exposure=1.0, pointing=None, roll=0.0)

"""A forecast of the sources of a live scene, computed in the background."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from astropy.table import QTable
from napari.utils.notifications import show_error
from qtpy.QtCore import QObject, Signal

from ..observation import Observation
from .latest_wins import LatestWins
from .scene import Scene
from .single_shot import single_shot

# Milliseconds of rest before a forecast; and during a drag none is made.
REST = 200
# Images of more sources and their derivatives would take more than half a GB.
MOST = 3000


class SceneForecast(QObject):  # type: ignore[misc]
    """The newest forecast of a live scene; nothing is computed unless it is on.

    Parameters
    ----------
    scene : Scene
        The live scene.
    compute : callable
        Makes the forecast from the source table and the observation, in a thread.
    needs : callable
        What of the observation the forecast depends on.

    Attributes
    ----------
    changed : Signal
        After each forecast.
    result : object
        The newest forecast; None if there is none.
    source_id : ndarray
        Ids of the sources that it is of.
    on : bool
        Whether forecasts are made.
    """

    changed = Signal()

    def __init__(
        self,
        scene: Scene,
        compute: Callable[[QTable, Observation], Any],
        needs: Callable[[Observation], Observation] = lambda observation: observation,
    ) -> None:
        super().__init__()
        self.scene = scene
        self.on = False
        self.result: Any = None
        self.source_id = np.empty(0, dtype=np.int64)
        self._compute, self._needs = compute, needs
        self._made_for: object = None
        self._asked_for: object = None
        self._jobs = LatestWins(self._deliver, self._failed)
        self._timer = single_shot(self._request, REST, self)

    @property
    def _now(self) -> object:
        return self.scene.editor.version, self._needs(self.scene.observation)

    @property
    def pending(self) -> bool:
        """Whether a newer forecast is on its way."""
        return self.on and self._made_for != self._now

    def follow(self) -> None:
        """Make a forecast of the scene as it is now, soon."""
        if self.pending and self._asked_for != self._now:
            self._timer.start()

    def pause(self) -> None:
        """Make none any more."""
        with suppress(RuntimeError):  # Qt has gone where a program ends with its window open
            self._timer.stop()
        self._jobs.cancel()
        self._asked_for = None

    def _request(self) -> None:
        scene = self.scene
        if scene.editor.held is not None:
            self._timer.start()
            return
        sources, observation, now = scene.sources, self._needs(scene.observation), self._now
        source_id, compute = scene.editor.source_id.copy(), self._compute
        if len(sources) > MOST:
            self._deliver((now, source_id, None))
            show_error(
                f"In napari forecasts are made of at most {MOST:,} sources; these are "
                f"{len(sources):,}. In a script napari_issis.forecast makes them."
            )
            return
        self._asked_for = now
        self._jobs.request(lambda: (now, source_id, compute(sources, observation)))

    def _deliver(self, made: tuple[object, Any, Any]) -> None:
        self._made_for, self.source_id, self.result = made
        self.changed.emit()

    def _failed(self, error: BaseException) -> None:
        self._deliver((self._now, self.source_id, None))
        show_error(f"There is no forecast: {error}")

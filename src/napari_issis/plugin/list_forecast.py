"""Forecasts of the sources of a scene for the source list, computed in the background."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy import units as u
from astropy.table import QTable
from napari.utils.notifications import show_error
from numpy.typing import NDArray
from qtpy.QtCore import QObject, QTimer, Signal

from ..forecast import forecast
from ..observation import Observation
from .latest_wins import LatestWins
from .scene import Scene
from .source_columns import Column

Array = NDArray[np.float64]

# Milliseconds of rest before a forecast; and during a drag none is made.
REST = 200
# Images of more sources and their derivatives would take more than half a GB.
MOST = 3000

FORECAST_COLUMNS = (
    Column(
        "snr_crowd",
        "S/N crowd",
        ".3g",
        "all",
        "Signal-to-noise ratio with all sources fitted together (S/N: alone on the sky)",
        False,
    ),
    Column(
        "flux_error_percent",
        "σ F (%)",
        ".3g",
        "all",
        "Expected 1-sigma error of the flux, all sources fitted together; inf: not determined",
        False,
    ),
    Column(
        "position_error_mas",
        "σ x, y (mas)",
        ".3g",
        "all",
        "Expected 1-sigma error of x or y, whichever is larger",
        False,
    ),
    Column(
        "neighbour",
        "neighbour",
        ".0f",
        "all",
        "Number of the source whose flux is confused most with this one's",
        False,
    ),
    Column(
        "flux_correlation",
        "corr.",
        ".2f",
        "all",
        "Correlation of the fluxes of the two, −1 to 1",
        False,
    ),
)


def forecast_values(sources: QTable, observation: Observation) -> dict[str, Array]:
    """Return what the columns show, each of shape (n,); NaN where there is none."""
    table = forecast(sources, observation)
    snr = np.asarray(table["snr"], dtype=np.float64)
    error = np.maximum(table["x_error"].to_value(u.pix), table["y_error"].to_value(u.pix))
    some = np.asarray(table["neighbour"]) >= 0
    return {
        "snr_crowd": snr,
        "flux_error_percent": np.divide(100.0, snr, out=np.full(snr.shape, np.inf), where=snr > 0),
        "position_error_mas": 1e3 * observation.pixel_scale * error,
        "neighbour": np.where(some, table["neighbour"], np.nan),
        "flux_correlation": np.where(some, table["flux_correlation"], np.nan),
    }


class ListForecast(QObject):  # type: ignore[misc]
    """The forecast of a live scene, newest wins; nothing is computed unless it is on.

    Parameters
    ----------
    scene : Scene
        The live scene.

    Attributes
    ----------
    changed : Signal
        After each forecast, and when the one there is has become stale.
    """

    changed = Signal()

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self.scene = scene
        self.on = False
        self._source_id = np.empty(0, dtype=np.int64)
        self._values: dict[str, Array] = {}
        self._made_for: object = None
        self._jobs = LatestWins(self._deliver, self._failed)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(REST)
        self._timer.timeout.connect(self._request)

    @property
    def _now(self) -> object:
        return self.scene.editor.version, self.scene.observation

    @property
    def pending(self) -> bool:
        """Whether a newer forecast is on its way."""
        return self.on and self._made_for != self._now

    def values(self, source_id: NDArray[np.int64]) -> dict[str, Array]:
        """Return the newest forecast for sources with these ids; NaN for others."""
        if self.on and np.array_equal(source_id, self._source_id) and self._values:
            return self._values
        return {column.name: np.full(source_id.size, np.nan) for column in FORECAST_COLUMNS}

    def follow(self) -> None:
        """Make a forecast of the scene as it is now, soon."""
        if self.pending:
            self._timer.start()

    def pause(self) -> None:
        """Make none any more."""
        self._timer.stop()
        self._jobs.cancel()

    def _request(self) -> None:
        scene = self.scene
        if scene.editor.held is not None:
            self._timer.start()
            return
        sources, observation, now = scene.sources, scene.observation, self._now
        source_id = scene.editor.source_id.copy()
        if len(sources) > MOST:
            self._made_for, self._values = now, {}
            show_error(
                f"The list makes no forecast of more than {MOST:,} sources; these are "
                f"{len(sources):,}. napari_issis.forecast does, in a script."
            )
            self.changed.emit()
            return
        self._jobs.request(lambda: (now, source_id, forecast_values(sources, observation)))

    def _deliver(self, result: tuple[object, NDArray[np.int64], dict[str, Array]]) -> None:
        self._made_for, self._source_id, self._values = result
        self.changed.emit()

    def _failed(self, error: BaseException) -> None:
        self._made_for, self._values = self._now, {}
        show_error(f"There is no forecast: {error}")
        self.changed.emit()


def with_forecast(sources: QTable, values: dict[str, Any] | None) -> QTable:
    """Return a source table as files get it: with the columns of a forecast, or without any."""
    result = sources.copy()
    for column in FORECAST_COLUMNS:
        # of another scene, as a catalogue brings them
        if column.name in result.colnames:
            result.remove_column(column.name)
        if values is not None:
            result[column.name] = values[column.name]
    return result

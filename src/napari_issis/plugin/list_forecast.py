"""The source list's columns of forecasts."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy import units as u
from astropy.table import QTable
from numpy.typing import NDArray

from ..forecast import forecast
from ..observation import Observation
from .scene import Scene
from .scene_forecast import SceneForecast
from .source_columns import Column

Array = NDArray[np.float64]

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


class ListForecast(SceneForecast):
    """The forecast that the list of sources shows.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene, lambda *scene_now: forecast_values(*scene_now))

    def values(self, source_id: NDArray[np.int64]) -> dict[str, Array]:
        """Return the newest forecast for sources with these ids; NaN for others."""
        if self.on and self.result is not None and np.array_equal(source_id, self.source_id):
            values: dict[str, Array] = self.result
            return values
        return {column.name: np.full(source_id.size, np.nan) for column in FORECAST_COLUMNS}


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

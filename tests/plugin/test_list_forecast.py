"""The list's columns of forecasts: made in the background, stale while they are, exported."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from astropy.table import Table
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QFileDialog
from small_scene import few_sources

import napari_issis as ni
from napari_issis.exposure import same_table
from napari_issis.plugin import list_forecast, scene_forecast
from napari_issis.plugin.list_forecast import FORECAST_COLUMNS
from napari_issis.plugin.source_columns import COLUMNS, from_text
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.source_model import ALL_COLUMNS
from napari_issis.plugin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
PLACE = {column.name: place for place, column in enumerate(ALL_COLUMNS)}
FIRST = len(COLUMNS)


@pytest.fixture
def listed(scene, qtbot):
    widget = SourceList(scene.viewer)
    qtbot.addWidget(widget)
    widget.show()
    qtbot.waitExposed(widget)
    yield widget
    widget.hide()
    qtbot.waitUntil(lambda: not widget.forecast._jobs.busy, timeout=60_000)


def switch_on(listed, qtbot):
    listed.forecast_box.setFocus()
    QTest.keyClick(listed.forecast_box, Qt.Key.Key_Space)
    ready(listed, qtbot)


def ready(listed, qtbot):
    qtbot.waitUntil(lambda: listed.forecast.on and not listed.forecast.pending, timeout=60_000)


def asked(listed, qtbot):
    """Wait until the forecast of the present scene is asked for."""
    QTest.qWait(150)
    timer, jobs = listed.forecast._timer, listed.forecast._jobs
    qtbot.waitUntil(lambda: jobs.busy and not timer.isActive(), timeout=60_000)


def cell(listed, row, name):
    return listed.model.index(row, PLACE[name]).data()


def numbers(listed, name):
    return np.array([float(cell(listed, row, name)) for row in range(4)])


def expected(scene, name):
    table = ni.forecast(scene.sources, scene.observation)
    return {
        "snr_crowd": np.asarray(table["snr"]),
        "flux_error_percent": 100 * (table["flux_error"] / table["flux"]).value,
        "position_error_mas": 36.0 * np.maximum(table["x_error"], table["y_error"]).value,
        "neighbour": table["neighbour"],
        "flux_correlation": table["flux_correlation"],
    }[name]


def test_the_columns_show_the_forecast(scene, listed, qtbot):
    """Catches exchanged rows or columns, arcsec for mas, and shares for per cent."""
    assert all(listed.view.isColumnHidden(place) for place in range(FIRST, len(ALL_COLUMNS)))
    switch_on(listed, qtbot)
    assert not any(listed.view.isColumnHidden(place) for place in range(FIRST, len(ALL_COLUMNS)))
    for column in FORECAST_COLUMNS:
        found = numbers(listed, column.name)
        np.testing.assert_allclose(found, expected(scene, column.name), rtol=6e-3, atol=6e-3)
    listed.view.sortByColumn(PLACE["snr_crowd"], Qt.SortOrder.DescendingOrder)
    assert np.all(np.diff(numbers(listed, "snr_crowd")) <= 0)


def test_stale_until_the_new_one_is_there(scene, listed, qtbot, monkeypatch):
    """Catches old numbers that look like new ones, and an older result that comes last."""
    switch_on(listed, qtbot)
    go, real, made = threading.Event(), list_forecast.forecast_values, []

    def slow(sources, observation):
        go.wait(30)
        made.append(observation.exposure)
        return real(sources, observation)

    monkeypatch.setattr(list_forecast, "forecast_values", slow)
    before = cell(listed, 0, "snr_crowd")
    for exposure in (60.0, 70.0, 200.0):
        scene.observation = scene.observation.replace(exposure=exposure)
        asked(listed, qtbot)
    listed.refresh()
    assert cell(listed, 0, "snr_crowd") == f"{before} …"
    listed.view.selectAll()
    listed.copy()
    assert "S/N crowd" not in QApplication.clipboard().text()
    go.set()
    ready(listed, qtbot)
    # the one that ran when the others came, and the newest of those
    assert made == [60.0, 200.0]
    np.testing.assert_allclose(
        numbers(listed, "snr_crowd"), expected(scene, "snr_crowd"), rtol=6e-3
    )


def test_none_is_made_in_a_drag_nor_switched_off_nor_hidden(
    scene, listed, qtbot, mouse, monkeypatch
):
    """Catches work that takes the processor from the drag, and a closed list that goes on."""
    made, real = [], list_forecast.forecast_values
    monkeypatch.setattr(list_forecast, "forecast_values", lambda *a: made.append(1) or real(*a))
    scene.add(ni.source("point", 5, 5))
    QTest.qWait(500)
    assert not made
    scene.undo()
    scene.wait()
    switch_on(listed, qtbot)
    count = len(made)
    assert count
    mouse.press(20.25, 12.5)
    for x in (22.0, 24.0, 26.0):
        mouse.move(x, 12.5)
        QTest.qWait(250)
    assert len(made) == count
    assert cell(listed, 0, "snr_crowd").endswith("…")
    mouse.release(26.0, 12.5)
    scene.wait()
    ready(listed, qtbot)
    assert len(made) > count
    count = len(made)
    listed.hide()
    scene.add(ni.source("point", 5, 5))
    QTest.qWait(500)
    assert len(made) == count
    listed.show()
    ready(listed, qtbot)
    assert len(made) == count + 1
    assert float(cell(listed, 4, "snr_crowd")) > 0


@pytest.mark.parametrize("suffix", ["ecsv", "csv", "fits"])
def test_exported_and_copied(scene, listed, qtbot, tmp_path, monkeypatch, suffix):
    """Catches files and text without the columns, or that can no longer be read as sources."""
    switch_on(listed, qtbot)
    path = tmp_path / f"sources.{suffix}"
    monkeypatch.setattr(QFileDialog, "exec", lambda self: True)
    monkeypatch.setattr(QFileDialog, "selectedFiles", lambda self: [str(path)])
    listed.save()
    written = Table.read(path, **({"format": "ascii.csv"} if suffix == "csv" else {}))
    for column in FORECAST_COLUMNS:
        np.testing.assert_allclose(written[column.name], expected(scene, column.name), rtol=1e-6)
    listed.forecast_box.click()
    scene.sources = ni.read_catalogue(path, scene.observation).sources
    assert same_table(scene.sources[["kind", "x", "y"]], few_sources()[["kind", "x", "y"]])
    # columns that were read are not those of the scene as it is now
    listed.save()
    written = Table.read(path, **({"format": "ascii.csv"} if suffix == "csv" else {}))
    assert not {column.name for column in FORECAST_COLUMNS} & set(written.colnames)
    listed.forecast_box.click()
    ready(listed, qtbot)
    listed.view.selectAll()
    listed.copy()
    text = QApplication.clipboard().text()
    assert "S/N crowd\tσ F (%)\tσ x, y (mas)\tneighbour\tcorr." in text.splitlines()[0]
    assert same_table(
        from_text(text, scene.observation, Units())[["x", "y"]], few_sources()[["x", "y"]]
    )


def test_too_many_sources_are_named(scene, listed, qtbot, monkeypatch):
    """Catches a list that stays pending for ever or fills the memory."""
    monkeypatch.setattr(scene_forecast, "MOST", 3)
    told = []
    monkeypatch.setattr(scene_forecast, "show_error", told.append)
    switch_on(listed, qtbot)
    assert cell(listed, 0, "snr_crowd") == "–"
    assert "at most 3 sources; these are 4" in told[0]

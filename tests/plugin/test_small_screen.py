"""Panel, list and both traces on a screen of 1366 x 768, with the frame whole."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QLabel, QStyle, QStyleOptionComboBox
from small_scene import SMALL, few_sources

from napari_issis import SKIES, source
from napari_issis.plugin.canvas_geometry import find_window, to_view_box
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.panels import DOCK_NAME, LIST_NAME, ROW_NAME, find_dock
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.trace_docks import RowTrace, show_traces

pytestmark = [
    pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning"),
    pytest.mark.needs_gl,
]


@pytest.fixture
def panel(make_napari_viewer):
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1366, 740)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    panel = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(panel, name="panel")
    scene.wait()
    QTest.qWait(200)
    panel.view.zoom.fit()
    return panel


def corners(panel):
    """Corners of the frame as shares of the canvas."""
    scene = panel.scene
    ny, nx = scene.counts.layer.data.shape
    places = [
        to_view_box(scene.viewer, scene.counts.layer, (y, x))
        for y in (-0.5, ny - 0.5)
        for x in (-0.5, nx - 0.5)
    ]
    height, width = scene.viewer.canvas.size
    return np.array(places) / (width, height)


def is_whole(panel):
    return bool(np.all((corners(panel) >= -0.01) & (corners(panel) <= 1.01)))


def span(panel):
    """How much of the canvas the frame fills in the direction that fits less well."""
    return float(np.ptp(corners(panel), axis=0).max())


def test_the_frame_stays_whole(panel):
    """Catches a list that crops the frame, and a frame that stays small when it is closed."""
    assert is_whole(panel)
    full = span(panel)
    steps = (
        panel.toggle_list,
        lambda: show_traces(panel.scene.viewer),
        panel.toggle_list,
        lambda: show_traces(panel.scene.viewer, False),
    )
    sizes = [panel.scene.viewer.canvas.size]
    for step in steps:
        step()
        QTest.qWait(300)
        assert is_whole(panel)
        assert span(panel) == pytest.approx(full, abs=0.03)
        sizes.append(panel.scene.viewer.canvas.size)
    # it was the panels that changed the canvas
    assert sizes[1][0] < sizes[0][0] - 50
    assert sizes[2][1] < sizes[1][1] - 50


def test_a_view_that_was_zoomed_stays(panel):
    """Catches a zoom that is lost whenever a panel opens."""
    panel.view.zoom.to(4)
    camera = panel.scene.viewer.scene.camera
    zoom, centre = camera.zoom, camera.center
    panel.toggle_list()
    QTest.qWait(300)
    assert (camera.zoom, camera.center) == (zoom, centre)


def docks(panel):
    docked = panel.scene.viewer.window.dock_widgets
    return [
        find_dock(next(docked[name] for name in docked if name.startswith(title)))
        for title in (ROW_NAME, LIST_NAME)
    ]


def in_sight(dock):
    return dock.isVisible() and not dock.visibleRegion().isEmpty()


def open_both(panel, list_first):
    steps = [panel.toggle_list, lambda: show_traces(panel.scene.viewer)]
    for step in steps if list_first else steps[::-1]:
        step()
        QTest.qWait(300)


@pytest.mark.parametrize("list_first", [True, False])
def test_list_and_traces_are_tabs_of_a_low_window(panel, list_first):
    """Catches a row trace too low to be read, or beside the list; the last one opened is seen."""
    window = find_window(panel)
    open_both(panel, list_first)
    row, listed = docks(panel)
    assert listed in window.tabifiedDockWidgets(row)
    assert (in_sight(row), in_sight(listed)) == (list_first, not list_first)
    assert window.width() <= 1366
    assert window.height() <= 768
    canvas = window.centralWidget()
    assert canvas.height() > 0.5 * window.height()
    # the button brings the list into sight before it hides it
    if not in_sight(listed):
        panel.toggle_list()
        QTest.qWait(200)
        assert in_sight(listed)
    panel.toggle_list()
    QTest.qWait(200)
    assert not listed.isVisible()
    assert in_sight(row)
    assert row.findChild(RowTrace).plot.height() >= 85
    assert row.geometry().left() <= canvas.geometry().left()
    assert row.geometry().right() >= canvas.geometry().right() - 1


def test_a_list_behind_the_trace_follows_nothing(panel):
    """Catches a list that is kept up to date where nobody sees it, or that comes back old."""
    open_both(panel, True)
    _, listed = docks(panel)
    source_list = listed.findChild(SourceList)
    panel.scene.add(source("point", 9.0, 9.0))
    QTest.qWait(300)
    assert source_list.model.rowCount() == len(few_sources())
    panel.toggle_list()
    QTest.qWait(300)
    assert source_list.model.rowCount() == len(few_sources()) + 1


@pytest.mark.parametrize("list_first", [True, False])
def test_list_below_the_row_trace_where_there_is_room(panel, list_first):
    """Catches a row trace beside the list, where it has not the width of the canvas."""
    window = find_window(panel)
    window.resize(1366, 960)
    QTest.qWait(200)
    open_both(panel, list_first)
    row, listed = docks(panel)
    assert row.geometry().bottom() <= listed.geometry().top() + 1
    assert row.width() == listed.width()
    canvas = window.centralWidget()
    assert row.geometry().left() <= canvas.geometry().left()
    assert row.geometry().right() >= canvas.geometry().right() - 1
    assert canvas.height() > 0.5 * window.height()


def test_no_line_of_text_is_cut(panel, qtbot):
    """Catches labels that wrap and are squeezed by the warning below them."""
    scene = panel.scene
    scene.sources = vstack(2 * [source("point", 30, 30, 1e-13)])
    scene.wait()
    qtbot.waitUntil(panel.instrument.warning.isVisible, timeout=2000)
    QTest.qWait(100)
    wrapped = [
        label
        for label in panel.instrument.findChildren(QLabel)
        if label.isVisible() and label.wordWrap() and label.text()
    ]
    assert panel.instrument.warning in wrapped
    assert panel.instrument.sky in wrapped
    for label in wrapped:
        assert label.height() >= label.heightForWidth(label.width()), label.text()


def test_no_line_is_cut_after_another_camera(panel):
    """Catches rows that keep the heights of the texts before."""
    scene = panel.scene
    own = scene.observation.replace(psf=None, sky=SKIES["HST average"])
    sky = panel.instrument.sky
    for camera, channel in (("FCU", "FUV"), ("ISSIS", "NUV")):
        scene.observation = own.replace(instrument=camera, channel=channel)
        QTest.qWait(300)
        assert sky.height() >= sky.heightForWidth(sky.width())


@pytest.mark.parametrize("name", ["ISSIS exposure time", "ISSIS monitoring"])
def test_a_panel_of_the_menu_shares_the_place_of_the_simulator(panel, name):
    """Catches a panel below the simulator's, which leaves neither the room that it needs."""
    viewer, window = panel.scene.viewer, find_window(panel)
    main = find_dock(panel)
    main.setWindowTitle(DOCK_NAME)
    height, width = main.height(), main.width()
    dock, _ = viewer.window.add_plugin_dock_widget("napari-issis", name)
    QTest.qWait(300)
    assert dock in window.tabifiedDockWidgets(main)
    assert in_sight(dock)
    assert not in_sight(main)
    assert dock.height() > 0.9 * height
    main.raise_()
    QTest.qWait(200)
    assert in_sight(main)
    assert abs(main.width() - width) < 30


def test_the_band_of_each_channel_can_be_read(panel):
    """Catches a box that cuts the text of the channel off."""
    box = panel.instrument.channel.native
    option = QStyleOptionComboBox()
    box.initStyleOption(option)
    room = box.style().subControlRect(
        QStyle.ComplexControl.CC_ComboBox, option, QStyle.SubControl.SC_ComboBoxEditField, box
    )
    texts = [box.itemText(entry) for entry in range(box.count())]
    assert any("Å" in text for text in texts)
    assert all(box.fontMetrics().horizontalAdvance(text) <= room.width() for text in texts)

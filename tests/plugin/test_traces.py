"""The traces: rows and columns of the picture on the axes of the canvas."""

from __future__ import annotations

from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from napari.utils.notifications import notification_manager
from npe2 import PluginManifest
from qtpy.QtCore import QEvent, QPoint, QPointF, Qt
from qtpy.QtGui import QMouseEvent
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis.plugin.brightness import SCALES
from napari_issis.plugin.canvas_geometry import find_canvas, find_window, screen_axis
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.trace_colors import trace_colors
from napari_issis.plugin.trace_docks import (
    ColumnTrace,
    RowTrace,
    find_dock,
    show_traces,
    trace_widgets,
    traces_shown,
)
from napari_issis.plugin.trace_plot import steps, thinned
from napari_issis.plugin.traces import Traces, traces_of
from napari_issis.plugin.value_axis import ValueAxis, linear_ticks, round_up

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
ROOT = Path(__file__).parents[2]


def settle(milliseconds: int = 60) -> None:
    QTest.qWait(milliseconds)


def hover(canvas, x: float, y: float, button=Qt.MouseButton.NoButton) -> None:
    """Move the mouse over the canvas, as Qt reports it."""
    place = QPointF(x, y)
    event = QMouseEvent(
        QEvent.Type.MouseMove,
        place,
        canvas.mapToGlobal(place),
        Qt.MouseButton.NoButton,
        button,
        Qt.KeyboardModifier.NoModifier,
    )
    QApplication.sendEvent(canvas, event)
    settle()


@pytest.fixture
def window(make_napari_viewer):
    """A viewer on the screen with the traces open."""
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1200, 760)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    show_traces(viewer)
    settle(100)
    viewer.reset_view()
    settle()
    return scene


def widgets(scene) -> tuple[RowTrace, ColumnTrace]:
    row, column = trace_widgets(scene.viewer)
    assert isinstance(row, RowTrace)
    assert isinstance(column, ColumnTrace)
    return row, column


# ---------------------------------------------------------------- what is traced


def test_a_trace_is_a_row_or_a_column_of_the_picture(scene):
    """Catches rows taken for columns, and counts of another picture."""
    traces = traces_of(scene)
    traces.pixel = (12, 20)
    exposure = scene.exposure
    row, column = traces.trace("row"), traces.trace("column")
    np.testing.assert_array_equal(row.counts, exposure.counts[12])
    np.testing.assert_array_equal(row.expected, exposure.expected[12])
    np.testing.assert_array_equal(column.counts, exposure.counts[:, 20])
    assert (row.index, row.position, column.index, column.position) == (12, 20, 20, 12)


def test_the_pixel_stays_within_a_smaller_frame(scene):
    """Catches an IndexError after a change of the frame."""
    traces = traces_of(scene)
    traces.pixel = (63, 79)
    scene.observation = SMALL.replace(shape=(32, 40))
    scene.wait()
    assert traces.pixel == (31, 39)
    assert traces.trace("column").counts.size == 32


def test_a_scene_has_one_pair_of_traces(scene):
    """Catches plots that are frozen one by one."""
    traces = traces_of(scene)
    assert traces_of(scene) is traces


def test_what_is_saved_is_what_is_shown(scene, tmp_path):
    """Catches tables without units, and metadata that do not say what was traced."""
    traces = traces_of(scene)
    traces.pixel = (30, 40)
    traces.save("row", tmp_path / "row.ecsv")
    traces.save("column", tmp_path / "column.ecsv")
    row, column = (QTable.read(tmp_path / f"{name}.ecsv") for name in ("row", "column"))
    exposure = scene.exposure
    np.testing.assert_array_equal(row["counts"], exposure.counts[30] * u.ct)
    np.testing.assert_array_equal(row["expected"], exposure.expected[30] * u.ct)
    np.testing.assert_array_equal(row["position"], np.arange(80) * u.pix)
    np.testing.assert_array_equal(column["expected"], exposure.expected[:, 40] * u.ct)
    assert row.meta["row"] == 30
    assert column.meta["column"] == 40
    assert row.meta["exposure"] == 50 * u.s
    assert "column" not in row.meta


def test_saving_overwrites_nothing_unasked(scene, tmp_path):
    """Catches a file of the user's that is lost, or half written."""
    traces = traces_of(scene)
    (tmp_path / "mine.ecsv").write_text("mine")
    with pytest.raises(FileExistsError):
        traces.save("row", tmp_path / "mine.ecsv")
    assert (tmp_path / "mine.ecsv").read_text() == "mine"
    traces.save("row", tmp_path / "mine.ecsv", overwrite=True)
    assert len(QTable.read(tmp_path / "mine.ecsv")) == 80
    with pytest.raises(ValueError, match="ecsv"):
        traces.save("row", tmp_path / "row.txt")


def test_the_scale_is_the_images(scene):
    """Catches plots that stay on another scale than the image."""
    traces = traces_of(scene)
    changes = []
    traces.events.changed.connect(lambda event: changes.append(traces.scale))
    scene.counts.scale = "log"
    assert changes == ["log"]
    with pytest.raises(ValueError, match="linear, log, sqrt, asinh, snr"):
        scene.counts.scale = "cube"


# ---------------------------------------------------------------- axis of counts


@pytest.mark.parametrize("scale", SCALES)
def test_brighter_is_higher_on_every_scale(scale):
    """Catches a scale that turns, leaves its axis, or has its ticks elsewhere than its curve."""
    counts = np.array([0, 1, 2, 10, 100, 4321])
    axis = ValueAxis(scale, counts, counts + 0.02, 0.02)
    heights = axis.fractions(counts)
    assert np.all(np.diff(heights[1:]) > 0)
    assert heights[0] <= heights[1]
    assert np.all((heights >= 0) & (heights <= 1))
    ticks = axis.ticks(6)
    assert 2 <= len(ticks) <= 9
    if scale != "snr":
        for place, text in ticks:
            assert axis.fractions(float(text)) == pytest.approx(place, abs=1e-9)


def test_the_scales_are_what_they_are_called():
    """Catches a square root under the name of a logarithm."""
    counts = np.array([1.0, 100.0, 10000.0])
    for scale, expected in (
        ("linear", counts),
        ("sqrt", np.sqrt(counts)),
        ("log", np.log10(counts)),
        ("asinh", np.arcsinh(counts)),
        ("snr", (counts - 0.5) / np.sqrt(counts)),
    ):
        heights = ValueAxis(scale, counts, counts, 0.5).fractions(counts)
        ratio = (heights[1] - heights[0]) / (heights[2] - heights[0])
        wanted = (expected[1] - expected[0]) / (expected[2] - expected[0])
        assert ratio == pytest.approx(wanted, rel=1e-9)


def test_dark_traces_have_an_axis():
    """Catches a logarithm of zero, and axes of no length."""
    zero = np.zeros(5)
    for scale in SCALES:
        for counts in (zero, zero[:0]):
            axis = ValueAxis(scale, counts, counts, 0.0)
            assert np.isfinite(axis.fractions(counts)).all()
            assert axis.high >= 1 > axis.low


def test_round_numbers():
    assert linear_ticks(0, 600, 4) == [0, 200, 400, 600]
    assert linear_ticks(-3, 7, 5) == [-2, 0, 2, 4, 6]
    assert [round_up(v) for v in (1, 1.01, 637, 0.021)] == [1, 1.5, 750, 0.03]


def test_steps_and_thinning_keep_the_peaks():
    """Catches a star that is lost where a pixel of the screen holds many of the frame."""
    x, y = steps(np.array([0.0, 2, 4]), np.array([5.0, 7]))
    assert (x.tolist(), y.tolist()) == ([0, 2, 2, 4], [5, 5, 7, 7])
    heights = np.zeros(16384)
    heights[[5000, 16383]] = 9, 4
    places, thin = thinned(np.arange(16384) * 600 / 16384, heights)
    assert thin.size < 1300
    assert thin.max() == 9
    assert places[thin.argmax()] == pytest.approx(5000 * 600 / 16384, abs=1)
    assert thin[-2:].max() == 4


# ---------------------------------------------------------------- on the screen


@pytest.mark.needs_gl
def test_the_plots_lie_on_the_axes_of_the_canvas(window):
    """Catches plots that are shifted or stretched after a pan, a zoom, a resize or a turn.

    The truth is napari's own: the mouse is moved to where the plot shows a pixel, and napari
    says which world position is there.
    """
    scene, viewer = window, window.viewer
    row, column = widgets(scene)
    canvas = find_canvas(row)
    camera = viewer.scene.camera

    def check():
        settle()
        for x in (7, 61):
            for y in (5, 50):
                here = row.plot.area().axis.to_canvas(x)
                there = column.plot.area().axis.to_canvas(y)
                left = row.plot.mapTo(find_window(row), QPoint(0, 0)).x() + here
                top = column.plot.mapTo(find_window(row), QPoint(0, 0)).y() + there
                corner = canvas.mapTo(find_window(row), QPoint(0, 0))
                hover(canvas, left - corner.x(), top - corner.y())
                world = viewer.cursor.position
                assert world == pytest.approx((y * 0.036, x * 0.036), abs=0.51 / camera.zoom)

    check()
    camera.center = (0.8, 1.9)
    check()
    camera.zoom *= 1.15
    check()
    viewer.window.resize(1000, 660)
    check()
    camera.orientation2d = ("down", "left")
    camera.center = (1.0, 1.5)
    check()


@pytest.mark.needs_gl
def test_the_traces_follow_the_pointer_until_frozen(window):
    """Catches traces that lag behind the pointer, or that run away while frozen."""
    scene = window
    row, column = widgets(scene)
    traces = row.traces
    assert traces is column.traces
    canvas = find_canvas(row)
    axis = screen_axis(scene.viewer, scene.counts.layer, 1)
    up = screen_axis(scene.viewer, scene.counts.layer, 0)
    hover(canvas, float(axis.to_canvas(20)), float(up.to_canvas(12)))
    assert traces.pixel == (12, 20)
    assert "y = 12" in row.title.text()
    assert f"C = {scene.exposure.counts[12, 20]}<" in row.title.text()
    assert "Column x = 20" in column.title.text()
    row.frozen.click()
    hover(canvas, float(axis.to_canvas(60)), float(up.to_canvas(50)))
    assert traces.pixel == (12, 20)
    assert column.frozen.isChecked()
    before = traces.trace("row").counts
    scene.new_noise()
    scene.wait()
    assert not np.array_equal(traces.trace("row").counts, before)
    assert f"C = {scene.exposure.counts[12, 20]}<" in row.title.text()
    column.frozen.click()
    hover(canvas, float(axis.to_canvas(60)), float(up.to_canvas(50)))
    assert traces.pixel == (50, 60)


@pytest.mark.needs_gl
def test_a_drag_is_traced_while_it_lasts(window, qtbot):
    """Catches traces that wait for the end of a drag: previews have to come through."""
    scene = window
    row, _ = widgets(scene)
    canvas = find_canvas(row)
    axis = screen_axis(scene.viewer, scene.counts.layer, 1)
    up = screen_axis(scene.viewer, scene.counts.layer, 0)
    x, y = float(axis.to_canvas(20.25)), float(up.to_canvas(12.5))
    seen = []

    def note(event=None):
        if not scene.picture.final:
            trace = row.traces.trace("row")
            seen.append((trace.index, int(trace.expected.argmax())))

    row.traces.events.changed.connect(note)
    hover(canvas, x, y)
    QTest.mousePress(canvas, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(y)))
    for n in range(1, 13):
        hover(canvas, x + 10 * n, y, button=Qt.MouseButton.LeftButton)
    assert {row for row, _ in seen} == {12}
    assert max(peak for _, peak in seen) > 23
    place = round((x + 120 - axis.origin) / axis.step)
    qtbot.waitUntil(
        lambda: abs(int(row.traces.trace("row").expected.argmax()) - place) <= 2, timeout=3000
    )
    QTest.mouseRelease(canvas, Qt.MouseButton.LeftButton, pos=QPoint(round(x + 120), round(y)))
    scene.wait()


@pytest.mark.needs_gl
def test_hidden_traces_cost_nothing(window):
    """Catches plots that follow the pointer and the picture though nobody sees them."""
    scene = window
    row, column = widgets(scene)
    traces = row.traces
    calls = []
    for widget in (row, column):
        widget.plot.update = lambda: calls.append("drawn")
        widget.title.setText = lambda text: calls.append("told")
    show_traces(scene.viewer, False)
    settle()
    assert not traces_shown(scene.viewer)
    assert not traces.watched
    calls.clear()
    canvas = find_canvas(row)
    hover(canvas, 300, 200)
    scene.viewer.scene.camera.zoom *= 1.1
    scene.new_noise()
    scene.wait()
    traces.pixel = (1, 1)
    assert calls == []
    show_traces(scene.viewer)
    settle()
    assert traces_shown(scene.viewer)
    assert traces.watched
    assert {"drawn", "told"} <= set(calls)
    assert len(trace_widgets(scene.viewer)) == 2


@pytest.mark.needs_gl
def test_the_docks_lie_beside_the_canvas(window, npe2pm):
    """Catches a row at the right, a column behind the panel, and a window that stays changed."""
    scene, viewer = window, window.viewer
    row, column = widgets(scene)
    main = find_window(row)
    assert main.dockWidgetArea(find_dock(row)) == Qt.DockWidgetArea.BottomDockWidgetArea
    show_traces(viewer, False)
    settle()
    right = Qt.DockWidgetArea.RightDockWidgetArea
    assert main.corner(Qt.Corner.BottomRightCorner) != right
    panel = viewer.window.add_dock_widget(SimulatorWidget(viewer), name="panel", area="right")
    for dock in (find_dock(row), find_dock(column)):
        viewer.window.remove_dock_widget(dock)
    settle()
    with npe2pm.tmp_plugin(manifest=PluginManifest.from_file(ROOT / "napari.yaml")):
        show_traces(viewer)
        settle(100)
    row, column = widgets(scene)
    canvas = find_canvas(row)
    assert main.corner(Qt.Corner.BottomRightCorner) == right
    places = [w.mapTo(main, QPoint(0, 0)).x() for w in (canvas, column, panel)]
    assert places == sorted(places)
    assert places[0] + canvas.width() <= places[1]
    assert row.mapTo(main, QPoint(0, 0)).y() >= canvas.mapTo(main, QPoint(0, canvas.height())).y()
    # the traces take little of it: fonts and styles of the machine move a few pixels
    assert canvas.width() > 2 * column.width()
    assert column.plot.height() > 0.9 * canvas.height()
    viewer.window.remove_dock_widget(find_dock(row))
    assert main.corner(Qt.Corner.BottomRightCorner) != right


@pytest.mark.needs_gl
def test_a_canvas_that_is_moved_is_followed(window):
    """Catches plots that stay behind when only the canvas moves."""
    row, _ = widgets(window)
    settle()
    drawn = []
    row.plot.update = lambda: drawn.append(True)
    canvas = find_canvas(row)
    canvas.move(canvas.x() + 5, canvas.y())
    assert drawn
    before = row.plot.area().axis.origin
    canvas.move(canvas.x() + 5, canvas.y())
    assert row.plot.area().axis.origin == before + 5


def test_three_dimensions_have_no_common_axes(scene):
    """Catches axes that pretend to be those of a canvas that is turned in space."""
    assert screen_axis(scene.viewer, scene.counts.layer, 1) is not None
    scene.viewer.dims.ndisplay = 3
    assert screen_axis(scene.viewer, scene.counts.layer, 1) is None


@pytest.mark.needs_gl
def test_both_curves_are_seen(window):
    """Catches an empty plot: the curves have to be where the axes say, in either theme."""
    row, _ = widgets(window)
    row.traces.pixel = (12, 20)
    window.counts.scale = "linear"
    for theme in ("dark", "light"):
        window.viewer.theme = theme
        settle()
        assert trace_colors(theme).expected.name() in row.title.text()
        picture = row.plot.grab().toImage()
        area, trace = row.plot.area(), row.traces.trace("row")
        x = round(float(area.axis.to_canvas(30)))
        values = ValueAxis("linear", trace.counts, trace.expected, trace.background)
        y = float(area.values(values.fractions(trace.expected[30])))
        colors = trace_colors(theme)
        seen = {
            picture.pixelColor(i, j).name()
            for i in range(round(area.axis.start), round(area.axis.stop))
            for j in range(round(area.top), round(area.bottom))
        }
        assert colors.counts.name() in seen
        assert colors.background.name() in seen
        near = [picture.pixelColor(x, round(y) + k) for k in (-1, 0, 1)]
        assert any(_distance(color, colors.expected) < 60 for color in near)


def _distance(first, second) -> int:
    pairs = zip(first.getRgb(), second.getRgb(), strict=True)
    return sum(abs(a - b) for a, b in pairs)


def test_saving_by_the_button(scene, qtbot, tmp_path, monkeypatch):
    """Catches a name without its ending, and errors that nobody sees."""
    widget = ColumnTrace(scene.viewer)
    qtbot.addWidget(widget)
    monkeypatch.setattr(widget, "ask_path", lambda: str(tmp_path / "a"))
    widget.save.click()
    assert QTable.read(tmp_path / "a.ecsv").meta["column"] == 40
    (tmp_path / "a.ecsv").write_text("mine")
    notification_manager.records.clear()
    widget.save.click()
    assert (tmp_path / "a.ecsv").read_text() == "mine"
    assert "exists" in str(notification_manager.records[-1].message)


def test_without_a_canvas_there_is_no_plot(scene, qtbot):
    """Catches an error where no canvas is found: a widget outside napari's window."""
    widget = RowTrace(scene.viewer)
    qtbot.addWidget(widget)
    assert widget.plot.area() is None
    widget.show()
    widget.plot.repaint()
    widget.hide()
    assert not Traces.watched.fget(widget.traces)

"""Everything by keyboard: the keys, the letters to underline, Tab, and the lists of them."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from qtpy.QtCore import Qt
from qtpy.QtGui import QShortcut
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QAbstractButton, QApplication, QLabel, QWidget
from small_scene import SMALL, few_sources

from napari_issis import simulate
from napari_issis.exposure import same_table
from napari_issis.plugin.canvas_geometry import find_canvas
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.keys import SHORTCUTS, KeysDialog, markdown_table
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.trace_docks import show_traces
from napari_issis.sources import DEFAULT_R_HALF

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
README = Path(__file__).parents[2] / "README.md"
SHIFT, CONTROL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier


@pytest.fixture(autouse=True)
def _no_key_held(qtbot):
    """Let go of Ctrl and Shift, which Qt holds for pressed after a key with a modifier."""
    yield
    widget = QWidget()
    qtbot.addWidget(widget)
    QTest.keyClick(widget, Qt.Key.Key_Control)


@pytest.fixture
def window(make_napari_viewer):
    """A viewer on the screen with panel, list and traces."""
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1300, 900)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    viewer.window.add_dock_widget(SimulatorWidget(viewer), name="panel")
    viewer.window.add_dock_widget(SourceList(viewer), name="list", area="bottom")
    show_traces(viewer)
    scene.wait()
    QTest.qWait(100)
    return scene


def panel_of(scene) -> SimulatorWidget:
    return scene.viewer.window.dock_widgets["panel"]


def list_of(scene) -> SourceList:
    return scene.viewer.window.dock_widgets["list"]


def press(scene, key, modifier=Qt.KeyboardModifier.NoModifier, times=1):
    """Press a key while the canvas has the focus."""
    for _ in range(times):
        QTest.keyClick(find_canvas(panel_of(scene)), key, modifier)
        QTest.qWait(5)


def as_napari_writes(key) -> str:
    text = str(key).replace("Ctrl+", "Control-").replace("Shift+", "Shift-").replace("Alt+", "Alt-")
    return text.replace("Arrow", "")


# ---------------------------------------------------------------- arrow keys


@pytest.mark.needs_gl
def test_the_arrows_move_what_is_selected(window):
    """Catches keys that go to napari's sliders, x and y exchanged, and one step for each key."""
    before = window.sources
    window.editor.select(window.editor.source_id[[0, 2]].tolist())
    steps = len(window.editor.history._past)
    press(window, Qt.Key.Key_Right, times=3)
    press(window, Qt.Key.Key_Up, times=2)
    press(window, Qt.Key.Key_Left, SHIFT)
    window.wait()
    moved = window.sources
    np.testing.assert_allclose(moved["x"] - before["x"], [2.9, 0, 2.9, 0], atol=1e-12)
    np.testing.assert_allclose(moved["y"] - before["y"], [2, 0, 2, 0], atol=1e-12)
    assert window.exposure == simulate(moved, SMALL)
    # the burst is over at once for whoever takes it back
    press(window, Qt.Key.Key_Z, CONTROL)
    assert same_table(window.sources, before)
    press(window, Qt.Key.Key_Z, CONTROL | SHIFT)
    assert same_table(window.sources, moved)
    assert len(window.editor.history._past) == steps + 1
    assert window.exposure == simulate(moved, SMALL)


@pytest.mark.needs_gl
def test_a_burst_ends_with_a_pause_or_another_selection(window, qtbot):
    """Catches moves of an hour that are taken back all at once."""
    first, _, third, _ = window.editor.source_id.tolist()
    history = window.editor.history
    window.editor.select([first])
    press(window, Qt.Key.Key_Down, times=2)
    qtbot.waitUntil(lambda: len(history._past) == 1, timeout=3000)
    assert history.last_step == "move 1 source"
    press(window, Qt.Key.Key_Down)
    window.editor.select([third])
    assert len(history._past) == 2
    press(window, Qt.Key.Key_Left)
    window.remove([third])
    assert len(history._past) == 4
    assert history.last_step == "remove 1 source"
    window.undo()
    assert window.sources["x"][2] == 39.0


@pytest.mark.needs_gl
def test_without_a_selection_the_arrows_are_naparis(window):
    """Catches arrows taken from the sliders of the user's own stack."""
    window.editor.select([])
    for layer in window.layers:
        assert not {"Left", "Shift+Left"} & {str(key) for key in layer.keymap}
    before, version = window.sources, window.editor.version
    press(window, Qt.Key.Key_Left)
    assert window.editor.version == version
    assert same_table(window.sources, before)


def test_the_arrows_do_nothing_while_the_mouse_holds_a_source(scene, mouse):
    """Catches a drag that is torn from the mouse."""
    mouse.press(20.25, 12.5)
    mouse.move(25.0, 12.5)
    scene.nudge(1, 1)
    mouse.move(26.0, 12.5)
    mouse.release(26.0, 12.5)
    scene.wait()
    assert (scene.sources["x"][0], scene.sources["y"][0]) == (26.0, 12.5)


def test_up_is_up_on_the_screen(viewer, mouse):
    """Catches arrows the wrong way round where the user's own images keep row 0 at the top."""
    viewer.add_image(np.zeros((9, 9)))
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.editor.select(scene.editor.source_id[:1].tolist())
    scene.nudge(0, 1)
    assert scene.sources["y"][0] == 11.5
    scene.wait()


@pytest.mark.needs_gl
def test_a_key_changes_the_kind_of_what_is_selected(window):
    """Catches other sources changed, a size that is lost or missing, a step for each source."""
    before, chosen = window.sources, window.editor.source_id[[1, 2]].tolist()
    steps = len(window.editor.history._past)
    window.editor.select(chosen)
    window.viewer.layers.selection.active = window.editor.points.layer
    kinds = ["uniform", "gaussian", "exponential", "devaucouleurs", "sersic", "point", "uniform"]
    for number, kind in enumerate(kinds, start=1):
        press(window, Qt.Key.Key_K, SHIFT)
        table = window.sources
        assert list(table["kind"]) == ["point", kind, kind, "sersic"]
        assert window.editor.selected_ids == set(chosen)
        assert len(window.editor.history._past) == steps + number
        for name in ("x", "y", "flux"):
            assert np.array_equal(table[name], before[name])
        assert table["r_half"][1].value == DEFAULT_R_HALF
        assert table["r_half"][2] == before["r_half"][2]
        assert table["pa"][2] == before["pa"][2]
        assert window.exposure == simulate(table, SMALL)
    for _ in kinds:
        press(window, Qt.Key.Key_Z, CONTROL)
    assert same_table(window.sources, before)
    window.editor.select([])
    press(window, Qt.Key.Key_K, SHIFT)
    assert same_table(window.sources, before)


# ---------------------------------------------------------------- the lists of keys


@pytest.mark.needs_gl
def test_the_list_of_keys_is_what_is_bound(window):
    """Catches a key that is bound and not listed, or listed and not bound."""
    window.editor.select(window.editor.source_id[:1].tolist())
    listed = {key for each in SHORTCUTS if each.canvas and each.ours for key in each.keys}
    for layer in window.layers:
        assert {as_napari_writes(key) for key in layer.keymap} == listed
    for widget, where in ((panel_of(window), "panel"), (list_of(window), "sources")):
        bound = {
            as_napari_writes(shortcut.key().toString()).replace("Del", "Delete")
            for shortcut in widget.findChildren(QShortcut)
            if shortcut.parent() is widget
        }
        assert bound == {
            key for each in SHORTCUTS if getattr(each, where) and each.ours for key in each.keys
        }


def test_readme_has_the_list_of_keys():
    """Catches a table in README that is older than the code."""
    assert markdown_table() in README.read_text(encoding="utf-8")


@pytest.mark.needs_gl
def test_the_panel_shows_the_list_of_keys(window):
    """Catches a button that opens nothing, or a window that stops the work."""
    QTest.mouseClick(panel_of(window).keys, Qt.MouseButton.LeftButton)
    dialog = panel_of(window).findChild(KeysDialog)
    assert dialog.isVisible()
    assert not dialog.isModal()
    text = dialog.findChild(QLabel).text()
    assert all(each.keys_text in text and each.action in text for each in SHORTCUTS)
    QTest.keyClick(dialog, Qt.Key.Key_Escape)
    assert not dialog.isVisible()


# ---------------------------------------------------------------- letters and Tab


def keys_of_napari(main: QWidget) -> set[str]:
    """The keys of what stands in the menus."""
    menus = [action.menu() for action in main.menuBar().actions()]
    for menu in menus:
        menu.aboutToShow.emit()  # when napari fills it
    return {key.toString() for menu in menus for each in menu.actions() for key in each.shortcuts()}


@pytest.mark.needs_gl
@pytest.mark.parametrize("page", [0, 1])
@pytest.mark.parametrize("mode", ["specific", "random", "cluster", "lens"])
def test_no_two_controls_have_one_letter(window, page, mode):
    """Catches Alt+S for two things, of which Qt then does neither: napari's keys count as well."""
    panel = panel_of(window)
    panel.pages.setCurrentIndex(page)
    panel.sources.mode.value = mode
    QTest.qWait(20)
    main = panel.window()
    texts = [action.text() for action in main.menuBar().actions()]
    texts += [
        widget.text()
        for widget in main.findChildren(QWidget)
        if isinstance(widget, QLabel | QAbstractButton) and widget.isVisible()
    ]
    letters = defaultdict(list)
    for text in texts:
        if "&" in text.replace("&&", "") and "<" not in text:
            letters[text.replace("&&", "").split("&")[1][0].lower()].append(text)
    taken = [key for key in keys_of_napari(main) if len(key) == 5 and key.startswith("Alt+")]
    assert {"Alt+S", "Alt+C"} <= set(taken)  # its screenshots
    for key in taken:
        letters[key[-1].lower()].append(key)
    assert {letter: found for letter, found in letters.items() if len(found) > 1} == {}
    assert len(letters) > 12


@pytest.mark.needs_gl
def test_tab_reaches_every_control(window, qtbot):
    """Catches a list or a plot that lets nobody out, and controls that only a mouse can reach."""
    panel, main = panel_of(window), panel_of(window).window()
    main.activateWindow()
    panel.undo.setEnabled(True)
    panel.redo.setEnabled(True)
    for page in (0, 1):
        panel.pages.setCurrentIndex(page)
        panel.pages.tabBar().setFocus()
        qtbot.waitUntil(lambda: QApplication.focusWidget() is not None, timeout=2000)
        reached = set()
        for _ in range(120):
            QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
            reached.add(QApplication.focusWidget())
        buttons = {panel.undo, panel.redo, panel.list, panel.keys, panel.save.native}
        forms = (panel.instrument, panel.sources) if page == 0 else (panel.display, panel.view)
        fields = {
            child
            for form in forms
            for child in form.findChildren(QWidget)
            if child.focusPolicy() == Qt.FocusPolicy.StrongFocus
            and child.isVisible()
            # the field of an editable list hands the focus to the list
            and child.focusProxy() is None
        }
        rows = {child for child in list_of(window).findChildren(QAbstractButton) if child.text()}
        assert len(fields) > 9
        assert buttons | fields | rows | {list_of(window).view} <= reached
    panel.display.scale.native.setFocus()
    QTest.keyClick(panel.display.scale.native, Qt.Key.Key_Tab, CONTROL)
    assert panel.pages.currentIndex() == 0

"""Stars and galaxies that are selected together, by mouse and key on the canvas."""

from __future__ import annotations

import numpy as np
import pytest
from qtpy.QtCore import QEvent, QPointF, Qt
from qtpy.QtGui import QMouseEvent
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis import simulate
from napari_issis.exposure import same_table
from napari_issis.plugin.canvas_geometry import find_canvas, to_view_box
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene

pytestmark = [
    pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning"),
    pytest.mark.needs_gl,
]
NONE, LEFT = Qt.MouseButton.NoButton, Qt.MouseButton.LeftButton
PLAIN, SHIFT = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
# places of the sources: two stars, two galaxies
STAR, OTHER_STAR, GALAXY, OTHER_GALAXY = (20.25, 12.5), (60.0, 50.0), (40.5, 30.5), (62.0, 21.0)


class Canvas:
    """The canvas of a real window, and a mouse over it."""

    def __init__(self, viewer) -> None:
        viewer.window.resize(1200, 800)
        self.scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
        panel = SimulatorWidget(viewer)
        viewer.window.add_dock_widget(panel, name="panel")
        self.scene.wait()
        QTest.qWait(100)
        viewer.reset_view()
        self.native = find_canvas(panel)

    def send(self, kind, place, button, buttons, modifier) -> None:
        at = to_view_box(self.scene.viewer, self.scene.counts.layer, place[::-1])
        local = QPointF(*at)
        QApplication.sendEvent(
            self.native,
            QMouseEvent(
                kind, local, self.native.mapToGlobal(local), button, buttons, modifier
            ),
        )  # fmt: skip
        # napari takes one move in 5 ms
        QTest.qWait(12)

    def drag(self, *places, modifier=PLAIN) -> None:
        self.send(QEvent.Type.MouseMove, places[0], NONE, NONE, modifier)
        self.send(QEvent.Type.MouseButtonPress, places[0], LEFT, LEFT, modifier)
        for place in places[1:]:
            self.send(QEvent.Type.MouseMove, place, NONE, LEFT, modifier)
        self.send(QEvent.Type.MouseButtonRelease, places[-1], LEFT, NONE, modifier)

    click = drag

    def selected(self) -> list[int]:
        scene = self.scene
        return np.flatnonzero(
            np.isin(scene.editor.source_id, list(scene.editor.selected_ids))
        ).tolist()

    def moves(self, before) -> np.ndarray:
        now = self.scene.sources
        return np.column_stack([now["x"] - before["x"], now["y"] - before["y"]])

    def is_consistent(self) -> bool:
        scene = self.scene
        scene.wait()
        return scene.exposure == simulate(scene.sources, SMALL)


@pytest.fixture
def canvas(make_napari_viewer):
    return Canvas(make_napari_viewer(show=True))


@pytest.mark.parametrize("grip", [STAR, GALAXY])
def test_what_is_selected_is_dragged_together(canvas, grip):
    """Catches a star that stays behind when the galaxy beside it is dragged, or two steps."""
    scene, before = canvas.scene, few_sources()
    canvas.click(STAR)
    canvas.click(GALAXY, modifier=SHIFT)
    assert canvas.selected() == [0, 2]
    x, y = grip
    canvas.drag(grip, (x + 2, y + 3), (x + 5, y + 4), (x + 7, y + 6))
    assert canvas.selected() == [0, 2]
    assert canvas.is_consistent()
    moved = canvas.moves(before)
    # to half a pixel of the screen
    np.testing.assert_allclose(moved[0], [7, 6], atol=0.2)
    np.testing.assert_allclose(moved[2], moved[0], atol=1e-4)
    assert not moved[[1, 3]].any()
    assert scene.sources["r_half"][2] == before["r_half"][2]
    assert len(scene.editor.history._past) == 1
    assert scene.editor.history.last_step == "move 2 sources"
    scene.undo()
    assert same_table(scene.sources, before)
    assert canvas.is_consistent()
    scene.redo()
    assert canvas.moves(before)[2].any()
    assert canvas.is_consistent()


def test_a_handle_changes_the_galaxies_alone(canvas):
    """Catches stars that creep when a galaxy selected with them is made larger."""
    scene = canvas.scene
    canvas.click(STAR)
    canvas.click(GALAXY, modifier=SHIFT)
    row, column = scene.editor.ellipses.layer._selected_box[4]
    canvas.drag((column, row), (column + 2, row + 2), (column + 4, row + 3))
    assert scene.sources["r_half"][2] != few_sources()["r_half"][2]
    assert not canvas.moves(few_sources())[[0, 1, 3]].any()
    assert canvas.is_consistent()


def test_a_click_on_one_of_them_selects_it_alone(canvas):
    """Catches a selection that cannot be reduced."""
    canvas.click(STAR)
    canvas.click(GALAXY, modifier=SHIFT)
    canvas.click(STAR)
    assert canvas.selected() == [0]


def test_a_box_selects_stars_and_galaxies(canvas):
    """Catches a box that sees one of the two layers, or adds to what was selected before."""
    canvas.click(OTHER_STAR)
    canvas.drag((5.0, 3.0), (30.0, 20.0), (50.0, 45.0))
    assert canvas.selected() == [0, 2]
    canvas.click(OTHER_GALAXY)
    canvas.drag((5.0, 3.0), (30.0, 20.0), (50.0, 45.0))
    assert canvas.selected() == [0, 2]
    canvas.drag((2.0, 55.0), (6.0, 60.0))
    assert canvas.selected() == []


@pytest.mark.parametrize("key", [Qt.Key.Key_Delete, Qt.Key.Key_Backspace])
def test_delete_removes_all_that_is_selected(canvas, key):
    """Catches stars that stay because the layer of the galaxies was active, or two steps."""
    scene = canvas.scene
    canvas.click(STAR)
    canvas.click(GALAXY, modifier=SHIFT)
    QTest.keyClick(canvas.native, key)
    assert same_table(scene.sources, few_sources()[[1, 3]])
    assert canvas.is_consistent()
    scene.undo()
    assert same_table(scene.sources, few_sources())

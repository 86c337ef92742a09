"""Undo and redo of everything that edits sources, and the double click that removes one."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from napari.utils.interactions import mouse_double_click_callbacks
from small_scene import few_sources
from test_scene_edit import assert_consistent

from napari_issis import random_sources, source
from napari_issis.exposure import same_table
from napari_issis.plugin.history import LEAST_STEPS, MOST_STEPS

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def edits(scene, mouse):
    """One of each kind of edit, by mouse, key and script, each with what it is called."""
    points, ellipses = scene.editor.points.layer, scene.editor.ellipses.layer
    yield "move 1 source", lambda: mouse.drag((20.25, 12.5), (25, 15), (30, 25), (33.25, 28.5))
    yield "move 1 source", lambda: mouse.drag((62, 20.5), (63, 22), (66, 24))

    def resize():
        corner = ellipses.data[0][2].astype(float)
        opposite = ellipses.data[0][0].astype(float)
        target = opposite + 1.5 * (corner - opposite)
        mouse.drag((40.0, 30.0), (40.0, 30.0))
        mouse.drag(tuple(corner[::-1]), tuple((corner + 1)[::-1]), tuple(target[::-1]))

    yield "change 1 source", resize

    def draw():
        scene.viewer.layers.selection.active = ellipses
        ellipses.mode = "add_ellipse"
        mouse.drag((10.0, 40.0), (14.0, 44.0), (20.0, 50.0))
        ellipses.mode = "select"

    yield "add 1 source", draw

    def paste():
        scene.viewer.layers.selection.active = points
        points.selected_data = {0}
        points._copy_data()
        points._paste_data()

    yield "add 1 source", paste

    def delete():
        points.selected_data = {1}
        points.remove_selected()

    yield "remove 1 source", delete
    yield "add 10 sources", lambda: scene.add(random_sources("gaussian", 10, seed=3))

    def kind():
        table = scene.sources
        table["kind"][0] = "uniform"
        scene.editor.change(table)
        scene._show_sources()

    yield "change 1 source", kind
    yield "remove 6 sources", lambda: scene.viewer.layers.remove(points) or scene._refresh()
    yield "replace", lambda: setattr(scene, "sources", few_sources()[:2])


def test_every_edit_is_one_step(scene, mouse):
    """Catches a drag that is many steps, an edit that is none, and a wrong way back."""
    scene.wait()
    history = scene.editor.history
    assert not history.last_step
    states = [(scene.sources, scene.editor.source_id.copy())]
    for name, edit in edits(scene, mouse):
        edit()
        scene.wait()
        assert len(history._past) == len(states), name
        states.append((scene.sources, scene.editor.source_id.copy()))
        if not name.startswith(("remove 6", "replace")):
            assert history.last_step == name
    for table, ids in states[-2::-1]:
        scene.undo()
        assert_consistent(scene)
        assert same_table(scene.sources, table)
        assert np.array_equal(scene.editor.source_id, ids)
    assert not history.last_step
    scene.undo()
    for table, ids in states[1:]:
        scene.redo()
        assert_consistent(scene)
        assert same_table(scene.sources, table)
        assert np.array_equal(scene.editor.source_id, ids)
    scene.redo()
    assert same_table(scene.sources, states[-1][0])


def test_an_edit_after_undo_forgets_what_was_undone(scene):
    """Catches a redo that brings sources of another branch."""
    scene.add(source("point", 1, 1))
    scene.undo()
    scene.add(source("point", 2, 2))
    scene.redo()
    assert list(scene.sources["x"][-2:]) == [61.5, 2.0]


def test_undo_gives_back_what_layers_cannot_hold(scene):
    """Catches values that went through the layers' float32 on the way."""
    exact = few_sources()
    exact["x"][2] += 1e-9
    scene.sources = exact
    scene.wait()
    scene.remove(scene.editor.source_id[[2]])
    assert len(scene.sources) == 3
    scene.undo()
    assert same_table(scene.sources, exact)


def test_the_keys_undo_on_our_layers_and_nowhere_else(scene):
    """Catches keys taken from the viewer or from the layers of others."""
    own = scene.viewer.add_points(np.zeros((1, 2)))
    scene.add(source("point", 5, 5))
    for layer in scene.layers:
        keys = {str(key): action for key, action in layer.keymap.items()}
        keys["Ctrl+Z"](layer)
        assert len(scene.sources) == 4
        keys["Ctrl+Shift+Z"](layer)
        assert len(scene.sources) == 5
    assert not own.keymap
    assert "Ctrl+Z" not in {str(key) for key in scene.viewer.keymap}


def test_nothing_is_undone_under_the_mouse(scene, mouse):
    """Catches an undo in the middle of a drag, after which the mouse holds another source."""
    scene.add(source("point", 5, 5))
    scene.wait()
    mouse.press(20.25, 12.5)
    mouse.move(25.0, 12.5)
    scene.undo()
    assert len(scene.sources) == 5
    mouse.release(25.0, 12.5)
    scene.wait()
    scene.undo()
    assert scene.sources["x"][0] == 20.25


def double_click(scene, mouse, x, y):
    mouse.drag((x, y), (x, y))
    mouse._send(mouse_double_click_callbacks, "mouse_double_click", x, y)
    scene.wait()


def test_a_double_click_removes_the_source(scene, mouse):
    """Catches a double click that removes all that is selected, nothing, or its neighbour."""
    zoom = scene.viewer.scene.camera.zoom
    double_click(scene, mouse, 60.0, 50.0)
    assert same_table(scene.sources, few_sources()[[0, 2, 3]])
    double_click(scene, mouse, 40.0, 30.0)
    assert same_table(scene.sources, few_sources()[[0, 3]])
    assert_consistent(scene)
    assert scene.viewer.scene.camera.zoom == zoom
    scene.undo()
    scene.undo()
    assert same_table(scene.sources, few_sources())
    double_click(scene, mouse, 5.0, 5.0)
    assert same_table(scene.sources, few_sources())


def test_a_double_click_while_drawing_or_elsewhere_removes_nothing(scene, mouse):
    """Catches a second click in add mode that takes the star just set, and others' layers."""
    points = scene.editor.points.layer
    scene.viewer.layers.selection.active = points
    points.mode = "add"
    mouse._send(mouse_double_click_callbacks, "mouse_double_click", 60.0, 50.0)
    assert len(scene.sources) == 4
    points.mode = "select"
    scene.viewer.add_points(np.zeros((1, 2)))
    mouse._send(mouse_double_click_callbacks, "mouse_double_click", 60.0, 50.0)
    assert len(scene.sources) == 4


def test_many_steps_and_bounded_memory(scene):
    """Catches fewer steps than promised, and a history that grows without end."""
    one = source("point", 0.0, 0.0)
    for _ in range(MOST_STEPS + 20):
        scene.editor.append(one)
    assert len(scene.editor.history._past) == MOST_STEPS
    for _ in range(MOST_STEPS):
        assert scene.editor.undo()
    assert not scene.editor.undo()
    many = vstack([random_sources("point", 60_000, seed=1)])
    for _ in range(LEAST_STEPS + 5):
        scene.editor.replace(many)
    assert len(scene.editor.history._past) == LEAST_STEPS

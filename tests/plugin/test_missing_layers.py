"""Layers that the user deletes: what goes with them, what the panel says, and the way back."""

from __future__ import annotations

import numpy as np
import pytest
from napari.utils.notifications import notification_manager
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QPushButton
from small_scene import SMALL, few_sources
from test_scene_edit import assert_consistent

from napari_issis import simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def panel(scene, qtbot):
    panel = SimulatorWidget(scene.viewer)
    qtbot.addWidget(panel)
    panel.show()
    scene.wait()
    return panel


def delete(scene, *layers):
    """Delete layers as napari's list of layers does, and let the scene see it."""
    scene.viewer.layers.selection = set(layers)
    scene.viewer.layers.remove_selected()
    QApplication.processEvents()
    scene.wait() if scene.layers else None


def click(button):
    QTest.mouseClick(button, LEFT)
    QApplication.processEvents()


def names(scene):
    return [layer.name for layer in scene.viewer.layers]


ALL = ["ISSIS counts", "ISSIS extended sources", "ISSIS point sources"]


def test_with_all_layers_there_is_nothing_to_say(scene, panel):
    assert scene.missing == ()
    assert not panel.missing.isVisible()


@pytest.mark.parametrize("role", ["points", "ellipses"])
def test_a_layer_of_sources(scene, panel, role):
    """Catches a layer that comes back unasked, sources that stay away or change their order."""
    before, ids = scene.sources, scene.editor.source_id.copy()
    view = getattr(scene.editor, role)
    delete(scene, view.layer)
    assert scene.missing == (role,)
    assert panel.missing.isVisible()
    assert "with 2 sources" in panel.missing.text.text()
    assert len(scene.sources) == 2
    # edits of the others bring nothing back
    table = scene.sources
    table["x"] += 1.5
    scene.change(table)
    scene.wait()
    scene.undo()
    scene.wait()
    assert view.layer is None
    click(panel.missing.button)
    assert names(scene) == ALL
    assert not panel.missing.isVisible()
    assert same_table(scene.sources, before)
    assert np.array_equal(scene.editor.source_id, ids)
    assert_consistent(scene)


def test_restoring_is_one_step_of_the_history(scene, panel):
    """Catches steps that undo to a scene that never was."""
    before = scene.sources
    delete(scene, scene.editor.points.layer)
    assert scene.editor.history.last_step == "remove 2 sources"
    without = scene.sources
    click(panel.missing.button)
    assert scene.editor.history.last_step == "add 2 sources"
    for table in (without, before):
        scene.undo()
        assert_consistent(scene)
        assert same_table(scene.sources, table)
    for table in (without, before):
        scene.redo()
        assert_consistent(scene)
        assert same_table(scene.sources, table)
    assert scene.missing == ()


def test_undo_brings_layer_and_sources_back(scene, panel):
    before = scene.sources
    delete(scene, scene.editor.ellipses.layer)
    scene.undo()
    assert_consistent(scene)
    assert same_table(scene.sources, before)
    assert names(scene) == ALL
    QApplication.processEvents()
    assert not panel.missing.isVisible()


def test_a_new_source_brings_its_layer_back(scene, panel):
    """Catches a star that is in the picture and on no layer; galaxies need no points."""
    delete(scene, scene.editor.points.layer)
    scene.add(source("gaussian", 9.0, 9.0, r_half=3.0))
    assert_consistent(scene)
    assert scene.editor.points.layer is None
    scene.add(source("point", 5.0, 6.0))
    assert_consistent(scene)
    assert names(scene) == ALL
    assert len(scene.editor.points.layer.data) == 1


def test_the_image(scene, panel, mouse):
    """Catches an image that returns with the next edit, or returns with an older picture."""
    delete(scene, scene.counts.layer)
    assert scene.missing == ("counts",)
    assert "the final image" in panel.missing.text.text()
    assert "with" not in panel.missing.text.text()
    mouse.drag((20.25, 12.5), (30.0, 20.0))
    scene.wait()
    scene.observation = SMALL.replace(shape=(48, 56))
    assert_consistent(scene)
    assert scene.counts.layer is None
    assert len(scene.viewer.layers) == 2
    click(panel.missing.button)
    assert_consistent(scene)
    assert names(scene) == ALL
    layer = scene.counts.layer
    assert layer.data.shape == (48, 56)
    assert layer.metadata["napari_issis"]["exposure"] == scene.exposure
    assert layer.contrast_limits[1] > scene.exposure.background


def test_all_three(scene, panel):
    before = scene.sources
    own = scene.viewer.add_points([[0.5, 0.5]])
    delete(scene, *scene.layers)
    assert scene.missing == ("counts", "ellipses", "points")
    assert "with 4 sources" in panel.missing.text.text()
    assert list(scene.viewer.layers) == [own]
    click(panel.missing.button)
    assert_consistent(scene)
    assert same_table(scene.sources, before)
    assert scene.missing == ()
    assert own in scene.viewer.layers


def test_a_user_who_does_without(scene, panel):
    """Catches a row that nobody gets rid of, and one that is silent about the next layer."""
    delete(scene, scene.editor.points.layer)
    click(panel.missing.leave)
    assert not panel.missing.isVisible()
    scene.new_noise()
    scene.wait()
    assert not panel.missing.isVisible()
    delete(scene, scene.counts.layer)
    assert panel.missing.isVisible()
    click(panel.missing.button)
    assert len(scene.sources) == 4
    assert_consistent(scene)


def test_a_panel_that_was_hidden_says_it_when_it_is_shown(scene, panel):
    panel.hide()
    delete(scene, scene.editor.points.layer)
    panel.show()
    assert panel.missing.isVisible()


def test_sources_that_have_no_light_in_the_new_channel(scene, panel, tmp_path):
    """Catches a restore that fails halfway."""
    path = tmp_path / "star.csv"
    path.write_text("wavelength_A,flux\n2000,1\n3000,1\n")
    table = scene.sources
    table["spectrum"] = np.array([f"table({path})", "flat", "flat", "flat"])
    scene.sources = table
    scene.wait()
    delete(scene, scene.editor.points.layer)
    scene.observation = scene.observation.replace(channel="FUV")
    scene.wait()
    notification_manager.records.clear()
    click(panel.missing.button)
    assert "FUV" in str(notification_manager.records[-1].message)
    assert scene.missing == ("points",)
    assert_consistent(scene)
    scene.observation = scene.observation.replace(channel="NUV")
    click(panel.missing.button)
    assert same_table(scene.sources, table)


@pytest.mark.needs_gl
def test_deleted_by_naparis_own_button(make_napari_viewer, qtbot):
    """The bin below the list of layers, as the user presses it."""
    viewer = make_napari_viewer(show=True)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    panel = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(panel)
    scene.wait()
    viewer.layers.selection = {scene.editor.points.layer}
    buttons = panel.window().findChildren(QPushButton)
    click(next(button for button in buttons if button.property("mode") == "delete_button"))
    qtbot.waitUntil(panel.missing.isVisible)
    click(panel.missing.button)
    scene.wait()
    assert scene.exposure == simulate(few_sources(), SMALL)

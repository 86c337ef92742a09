"""Two viewers at once; the widget closed, opened again, and closed while a picture is made."""

from __future__ import annotations

import subprocess
import sys
import threading

import numpy as np
import pytest
from napari.components import ViewerModel
from PIL import Image
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources
from test_scene_edit import assert_consistent

from napari_issis import random_sources, simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.png_menu import PngMenu
from napari_issis.plugin.scene import open_scene, scene_of
from napari_issis.plugin.side_by_side import SideBySide
from napari_issis.plugin.traces import traces_of

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def other(scene, mouse, qapp):
    """A second viewer with a scene of its own, and a mouse over it."""
    viewer = ViewerModel()
    table = random_sources("point", 5, shape=(64, 80), seed=4)
    second = open_scene(table, SMALL.replace(channel="FUV"), viewer=viewer, dock=False, seed=7)
    second.wait()
    yield second, type(mouse)(viewer)
    viewer.layers.clear()
    while second._live._jobs.busy:
        QApplication.processEvents()


def test_two_viewers_are_two_scenes(scene, mouse, other, qtbot):
    """Catches a panel, a history, units or a picture that two scenes share."""
    second, its_mouse = other
    assert scene_of(scene.viewer) is scene
    assert scene_of(second.viewer) is second
    panels = [SimulatorWidget(each.viewer) for each in (scene, second)]
    for panel, each in zip(panels, (scene, second), strict=True):
        qtbot.addWidget(panel)
        panel.show()
        assert panel.scene is each
    theirs = second.sources
    mouse.drag((20.25, 12.5), (22.0, 14.0), (30.0, 20.0))
    scene.units.flux = "AB mag"
    scene.counts.scale = "log"
    assert_consistent(scene)
    assert same_table(second.sources, theirs)
    assert (second.units.flux, second.counts.scale) != ("AB mag", "log")
    x, y = float(theirs["x"][0]), float(theirs["y"][0])
    its_mouse.drag((x, y), (x + 1, y), (40.5, 30.5))
    panels[1].instrument.channel.value = "NUV"
    assert_consistent(second)
    assert (scene.observation.channel, scene.seed, second.seed) == ("NUV", 0, 7)
    scene.undo()
    assert_consistent(scene)
    assert same_table(scene.sources, few_sources())
    assert second.sources["x"][0] == pytest.approx(40.5)
    assert traces_of(scene) is not traces_of(second)
    assert panels[0].undo.isEnabled() != panels[1].undo.isEnabled()
    for panel in panels:
        panel.hide()


@pytest.mark.needs_gl
def test_a_widget_opened_again_finds_its_scene(make_napari_viewer, qtbot):
    """Catches a second scene, a panel that shows the defaults, and an old panel that answers."""
    viewer = make_napari_viewer(show=True)
    first = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(first, name="panel")
    scene = first.scene
    scene.sources = few_sources()
    scene.observation = SMALL.replace(exposure=33.0, filters=("NF1", "open"))
    scene.wait()
    viewer.window.remove_dock_widget(first)
    scene.add(source("point", 9.0, 9.0))
    scene.wait()
    before = scene.sources
    second = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(second, name="panel")
    QTest.qWait(50)
    assert second.scene is scene
    assert second.instrument.exposure.number == 33.0
    assert second.instrument.wheel1.value == "NF1"
    assert len(viewer.layers) == 3
    assert same_table(scene.sources, before)
    assert second.undo.isEnabled()
    second.undo.click()
    scene.wait()
    assert same_table(scene.sources, few_sources())
    second.instrument.new_noise.native.click()
    scene.wait()
    assert scene.exposure == simulate(few_sources(), scene.observation, seed=1)


@pytest.mark.needs_gl
@pytest.mark.parametrize("what", ["widget", "layers"])
def test_closed_in_the_middle_of_a_render(make_napari_viewer, monkeypatch, qtbot, what):
    """Catches a picture that comes to a widget that is gone, and a thread that stays."""
    viewer = make_napari_viewer(show=True)
    panel = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(panel, name="panel")
    scene = panel.scene
    scene.sources, scene.observation = few_sources(), SMALL
    scene.wait()
    gate, final = threading.Event(), scene._live._maker.final
    monkeypatch.setattr(scene._live._maker, "final", lambda *args: gate.wait(20) and final(*args))
    scene.new_noise()
    qtbot.waitUntil(lambda: scene._live._jobs.busy)
    if what == "widget":
        viewer.window.remove_dock_widget(panel)
    else:
        viewer.layers.clear()
    gate.set()
    qtbot.waitUntil(lambda: not scene._live._jobs.busy, timeout=5000)
    # pytest-qt fails the test for an error in a slot
    QTest.qWait(100)
    # that of the autosave ends as well
    jobs = [thread for thread in threading.enumerate() if thread.name == "napari-issis job"]
    for job in jobs:
        job.join(60)
        assert not job.is_alive()
    if what == "widget":
        assert scene.settled
        assert scene.exposure == simulate(few_sources(), SMALL, seed=1)
    else:
        assert len(viewer.layers) == 0


def test_both_frames_are_saved_as_they_are_while_side_by_side(scene, qtbot, tmp_path, monkeypatch):
    """Catches pictures of a cell of the grid, or of the other one."""
    menu = PngMenu(scene, None)
    qtbot.addWidget(menu)
    for folder, beside in (("one", False), ("two", True)):
        SideBySide(scene).enabled = beside
        (tmp_path / folder).mkdir()
        monkeypatch.setattr(
            menu, "ask_path", lambda name, folder=folder: str(tmp_path / folder / name)
        )
        for action in menu.actions()[:2]:
            action.trigger()
    for name in ("image.png", "sources.png"):
        first, second = (np.asarray(Image.open(tmp_path / f / name)) for f in ("one", "two"))
        assert np.array_equal(first, second)
        assert first.std() > 0


@pytest.mark.needs_gl
def test_a_program_may_end_with_its_window_open():
    """Catches widgets that reach for what Qt has already taken away: Python was aborted."""
    program = """
import napari
from qtpy.QtTest import QTest
viewer = napari.Viewer()
for name in ("simulator", "sources", "exposure time", "monitoring", "row trace"):
    viewer.window.add_plugin_dock_widget("napari-issis", f"ISSIS {name}")
    QTest.qWait(100)
"""
    command = [sys.executable, "-W", "ignore", "-c", program]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert "Traceback" not in ended.stderr
    assert ended.returncode == 0, ended.stderr

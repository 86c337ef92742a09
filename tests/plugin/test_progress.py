"""What the panel says while a picture takes long, and how to do without it."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from qtpy.QtTest import QTest
from small_scene import few_sources

from napari_issis import simulate
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.live_picture import SLOW

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def panel(scene, qtbot):
    panel = SimulatorWidget(scene.viewer)
    qtbot.addWidget(panel)
    panel.show()
    scene.wait()
    return panel


@pytest.fixture
def gate(scene, monkeypatch):
    """Holds every picture back until it is set."""
    gate, final = threading.Event(), scene._live._maker.final

    def slow(*arguments):
        gate.wait(20)
        return final(*arguments)

    monkeypatch.setattr(scene._live._maker, "final", slow)
    yield gate
    gate.set()


def test_a_quick_picture_is_made_without_words(scene, panel, gate):
    """Catches a row that flickers at every edit."""
    seen = []
    scene.events.progress.connect(lambda event: seen.append(panel.progress.isVisible()))
    gate.set()
    for exposure in (60.0, 70.0, 80.0):
        scene.observation = scene.observation.replace(exposure=exposure)
        scene.wait()
        QTest.qWait(20)
    assert seen == []
    QTest.qWait(SLOW + 50)
    assert not panel.progress.isVisible()


def test_a_slow_picture_shows_that_it_is_made(scene, panel, gate, qtbot):
    """Catches a program that looks dead, and words that stay when the picture is there."""
    scene.new_noise()
    qtbot.waitUntil(panel.progress.isVisible, timeout=3000)
    assert panel.progress.text.text() == "Simulating…"
    gate.set()
    scene.wait()
    assert not panel.progress.isVisible()


def test_a_picture_that_is_cancelled(scene, panel, gate, qtbot):
    """Catches a result that comes all the same, a job that begins anew, a file that is old."""
    before = scene.exposure
    scene.new_noise()
    qtbot.waitUntil(panel.progress.isVisible, timeout=3000)
    panel.progress.button.click()
    assert scene.cancelled
    assert panel.progress.button.text() == "Simulate"
    gate.set()
    qtbot.waitUntil(lambda: not scene._live._jobs.busy, timeout=3000)
    # what happens at each selection
    scene._soon()
    QTest.qWait(SLOW + 50)
    assert scene.picture.exposure is before
    np.testing.assert_array_equal(scene.counts.layer.data, before.counts)
    assert panel.progress.isVisible()
    panel.progress.button.click()
    qtbot.waitUntil(lambda: scene.settled, timeout=3000)
    assert not panel.progress.isVisible()
    assert scene.picture.exposure == simulate(scene.sources, scene.observation, seed=1)


def test_saving_and_the_next_edit_simulate_what_was_cancelled(scene, panel, gate, qtbot):
    """Catches files that hold an older scene, and a scene that stands still for ever."""
    scene.new_noise()
    qtbot.waitUntil(panel.progress.isVisible, timeout=3000)
    panel.progress.button.click()
    gate.set()
    assert scene.exposure == simulate(few_sources(), scene.observation, seed=1)
    assert not panel.progress.isVisible()
    gate.clear()
    scene.new_noise()
    qtbot.waitUntil(panel.progress.isVisible, timeout=3000)
    panel.progress.button.click()
    scene.sources = few_sources()[:2]
    QTest.qWait(20)
    gate.set()
    scene.wait()
    assert not panel.progress.isVisible()
    assert scene.exposure == simulate(few_sources()[:2], scene.observation, seed=2)

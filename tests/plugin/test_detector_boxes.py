"""The detector's boxes on the instrument panel."""

import numpy as np
import pytest

from napari_issis import Detector, simulate
from napari_issis.plugin.instrument_form import InstrumentForm

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def test_boxes_and_scene_follow_each_other(scene, qtbot):
    """Catches a box that clears the other one, a picture without the effect, and a stale box."""
    form = InstrumentForm(scene)
    qtbot.addWidget(form)
    form.resume()
    assert not form.loss.value
    assert not form.rollover.value
    form.loss.value = True
    form.rollover.value = True
    detector = scene.observation.detector
    assert detector.dead_time == pytest.approx(0.01 / 0.99 / 22.0)
    assert detector.rollover
    scene.wait()
    wanted = simulate(scene.sources, scene.observation, seed=scene.seed)
    assert np.array_equal(scene.counts.layer.data, wanted.counts)
    form.loss.value = False
    assert scene.observation.detector == Detector(rollover=True)
    scene.observation = scene.observation.replace(detector=Detector(1e-3))
    assert form.loss.value
    assert not form.rollover.value
    assert scene.observation.detector.dead_time == 1e-3

"""A sequence of exposures with napari's slider."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from small_scene import SMALL, few_sources

from napari_issis import monitor, monitoring_tasks
from napari_issis.plugin import frames as frames_module

pytest.importorskip("dask")
PATIENCE = 60_000
pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def plan(epochs=3):
    return monitor(few_sources(), SMALL, range(epochs), light_curves={0: lambda t: 1 + t})


@pytest.fixture
def threads(monkeypatch):
    """Whether each frame was rendered in the GUI's thread."""
    in_gui = []
    real = monitoring_tasks.noise_ready_rate

    def noted(*args, **options):
        in_gui.append(threading.current_thread() is threading.main_thread())
        return real(*args, **options)

    monkeypatch.setattr(monitoring_tasks, "noise_ready_rate", noted)
    return in_gui


@pytest.fixture
def rendered(monkeypatch):
    """The epoch of each frame that was rendered, as the light curve of `plan` tells it."""
    first = plan(1).simulate(0).sources["flux"][0]
    epochs = []
    real = monitoring_tasks.noise_ready_rate

    def noted(sources, *args, **options):
        epochs.append(round(float(sources["flux"][0] / first)) - 1)
        return real(sources, *args, **options)

    monkeypatch.setattr(monitoring_tasks, "noise_ready_rate", noted)
    return epochs


def shown(layer):
    return np.asarray(layer._data_view)


def test_the_slider_goes_through_the_epochs(viewer, qtbot, threads):
    """Catches a frame of another epoch, one computed while the GUI waits, or one kept blank."""
    sequence = plan()
    layer = sequence.show(viewer)
    assert viewer.dims.range[0][:2] == (0.0, 2.0)
    assert viewer.dims.axis_labels[0] == "epoch"
    for epoch in (2, 0, 1, 2):
        viewer.dims.set_point(0, epoch)
        expected = sequence.simulate(epoch).counts
        qtbot.waitUntil(
            lambda expected=expected: np.array_equal(shown(layer), expected), timeout=PATIENCE
        )
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    assert threads
    assert not any(threads)
    low, high = layer.contrast_limits
    assert low == 0
    assert 10 < high < sequence.simulate(2).counts.max() * 3


def test_what_is_not_there_yet_is_dark_and_the_next_frames_are_prepared(viewer, qtbot, rendered):
    """Catches the frame before shown for the one that is asked for, and frames computed twice."""
    ahead = frames_module.AHEAD
    layer = plan(30).show(viewer)
    assert not shown(layer).any()
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    # napari may look at the middle of the sequence first
    assert set(range(ahead + 1)) <= set(rendered)
    for epoch in range(1, 2 * ahead):
        viewer.dims.set_point(0, epoch)
        assert shown(layer).any()
        qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    viewer.dims.set_point(0, 29)
    assert not shown(layer).any()
    qtbot.waitUntil(lambda: shown(layer).any(), timeout=PATIENCE)
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    assert 29 in rendered
    assert len(set(rendered)) == len(rendered)


def test_frames_are_dropped_when_there_are_too_many(viewer, qtbot, monkeypatch):
    monkeypatch.setattr(frames_module, "MOST_BYTES", 1.0)
    monkeypatch.setattr(frames_module, "AHEAD", 1)
    layer = plan(6).show(viewer)
    for epoch in range(6):
        viewer.dims.set_point(0, epoch)
        qtbot.waitUntil(lambda: shown(layer).any() and not layer.data.busy, timeout=PATIENCE)
        assert len(layer.data._kept) <= 2


def test_all_frames_at_once(viewer, qtbot, monkeypatch, threads):
    """Catches frames that are never asked for again, or that drive each other out for ever."""
    sequence = plan(4)
    layer = sequence.show(viewer)
    expected = sequence.stack().compute()
    qtbot.waitUntil(
        lambda: np.array_equal(layer.data[0:4, 3:9, 5], expected[:, 3:9, 5]), timeout=PATIENCE
    )
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    monkeypatch.setattr(frames_module, "MOST_BYTES", 1.0)
    monkeypatch.setattr(frames_module, "AHEAD", 1)
    crowded = sequence.show(viewer)
    for _ in range(5):
        part = crowded.data[:]
        qtbot.waitUntil(lambda: not crowded.data.busy, timeout=PATIENCE)
    assert np.array_equal(part[:2], expected[:2])
    assert not part[2:].any()


def test_the_whole_stack_for_whoever_saves_it(viewer, qtbot):
    """Catches blank frames in a file."""
    sequence = plan()
    layer = sequence.show(viewer)
    assert np.array_equal(np.asarray(layer.data), sequence.stack().compute())
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)


def test_a_layer_that_is_removed_computes_nothing_more(viewer, qtbot, threads):
    layer = plan(20).show(viewer)
    viewer.layers.clear()
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    assert len(threads) <= 2


def test_a_frame_that_fails_is_told(viewer, qtbot, monkeypatch):
    from napari.utils.notifications import notification_manager

    def fails(*args, **options):
        raise ValueError("no light today")

    monkeypatch.setattr(monitoring_tasks, "noise_ready_rate", fails)
    layer = plan().show(viewer)
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    assert "no light today" in str(notification_manager.records[-1].message)

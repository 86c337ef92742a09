"""The dock widget that monitors the scene."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import QTable
from napari.utils.notifications import notification_manager
from qtpy.QtWidgets import QFileDialog
from typed import enter

from napari_issis import fit_light_curves, monitoring_tasks
from napari_issis.monitoring_settings import MonitoringSettings
from napari_issis.plugin.monitoring_widget import MonitoringWidget

pytest.importorskip("dask")
pytest.importorskip("matplotlib")
pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
PATIENCE = 60_000


@pytest.fixture
def widget(scene, qtbot):
    notification_manager.records.clear()
    widget = MonitoringWidget(scene.viewer)
    qtbot.addWidget(widget)
    widget.form.epochs.native.setEditText("3")
    widget.form.exposures.native.setEditText("2")
    enter(widget.form.delays, "0, 40")
    enter(widget.form.amplitude, "0.7")
    yield widget
    qtbot.waitUntil(lambda: not widget.busy, timeout=PATIENCE)


def planned(widget):
    settings = MonitoringSettings(epochs=3, exposures=2, amplitude=0.7, delays=(0.0, 40.0))
    return settings.plan(widget.scene.sources, widget.scene.observation)


def click(widget, words, qtbot=None):
    button = next(one for one in widget.buttons if words in one.text().replace("&", ""))
    button.click()
    if qtbot is not None:
        qtbot.waitUntil(lambda: not widget.busy, timeout=PATIENCE)


def told():
    return [str(note.message) for note in notification_manager.records]


def test_the_stack_is_that_of_the_fields(widget, qtbot):
    """Catches a field that is shown and forgotten."""
    click(widget, "stack", qtbot)
    layer = widget.scene.viewer.layers["ISSIS monitoring, counts"]
    assert np.array_equal(np.asarray(layer.data), planned(widget).stack().compute())
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    for field, text in ((widget.form.roll, "30"), (widget.form.seed, "8")):
        enter(field, text)
    settings = widget.form.settings()
    assert (settings.roll, settings.seed, settings.cadence) == (30.0, 8, 5.0)


def test_the_scene_lives_on_under_the_slider(widget, scene, mouse, qtbot):
    """Catches a scene that takes the stack's first axis for its own."""
    click(widget, "stack", qtbot)
    layer = scene.viewer.layers["ISSIS monitoring, counts"]
    qtbot.waitUntil(lambda: not layer.data.busy, timeout=PATIENCE)
    scene.sources = scene.sources[:2]
    scene.wait()
    assert np.array_equal(scene.counts.layer.data.shape, (64, 80))
    before = scene.exposure.counts.copy()
    scene.observation = scene.observation.replace(exposure=70.0)
    scene.wait()
    assert not np.array_equal(scene.exposure.counts, before)


def test_a_cube_is_saved(widget, qtbot, tmp_path, monkeypatch):
    path = tmp_path / "cube"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(path), ""))
    click(widget, "cube", qtbot)
    assert np.array_equal(fits.getdata(tmp_path / "cube.fits"), planned(widget).stack().compute())
    assert f"Saved {path}.fits" in told()
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: ("", ""))
    click(widget, "cube")
    assert not widget.busy


def test_light_curves_are_shown_and_saved(widget, qtbot, tmp_path, monkeypatch):
    click(widget, "Light", qtbot)
    window, expected = widget.curves, fit_light_curves(planned(widget))
    assert window.isVisible()
    assert window.plot.pixmap().width() > 400
    assert np.array_equal(window.table["flux"], expected["flux"])
    for name in ("curves.ecsv", "curves.csv", "curves.png", "curves.pdf"):
        answer = (str(tmp_path / name), "")
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args, a=answer: a)
        window.ask()
        assert (tmp_path / name).stat().st_size > 200
    table = QTable.read(tmp_path / "curves.ecsv", format="ascii.ecsv")
    np.testing.assert_allclose(table["error"].value, expected["error"].value, rtol=1e-12)
    answer = (str(tmp_path / "curves.doc"), "")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: answer)
    window.ask()
    assert "curves.doc" in told()[-1]


def test_cancel(widget, qtbot, tmp_path, monkeypatch):
    """Catches a file that is written after all, and a job that goes on to its end."""
    path, rendered = tmp_path / "cube.fits", []
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *args: (str(path), ""))
    monkeypatch.setattr("napari_issis.fits_cube.BATCH", 1)
    real = monitoring_tasks.noise_ready_rate

    def counted(*args, **options):
        rendered.append(widget.stop() if not rendered else None)
        return real(*args, **options)

    # the button as if pressed at the first render
    monkeypatch.setattr(widget, "_idle", lambda: None)
    monkeypatch.setattr(monitoring_tasks, "noise_ready_rate", counted)
    click(widget, "cube", qtbot)
    assert not path.exists()
    assert len(rendered) == 2
    assert told() == []


def test_wrong_values_are_told_and_nothing_starts(widget):
    enter(widget.form.delays, "0 later")
    click(widget, "stack")
    assert "a delay is 'later'" in told()[-1]
    widget.form.epochs.native.setEditText("20000")
    enter(widget.form.delays, "")
    click(widget, "stack")
    assert "20000 epochs of 2 exposures are 40000, more than 10000" in told()[-1]
    assert not widget.busy


def test_a_plan_that_fails_is_told(widget, qtbot):
    enter(widget.form.delays, "1 2 3")
    click(widget, "stack", qtbot)
    assert "3 delays and 2 point sources" in told()[-1]
    assert all(button.isEnabled() for button in widget.buttons)
    assert "ISSIS monitoring, counts" not in widget.scene.viewer.layers


def test_rows_of_a_constant_source(widget):
    widget.show()
    widget.form.curve.value = "constant"
    assert not widget.form.delays.native.isVisible()
    widget.form.curve.value = "sinusoid"
    assert widget.form.delays.native.isVisible()


def test_every_control_says_what_it_is_for(widget):
    from qtpy.QtWidgets import QComboBox, QLineEdit, QPushButton

    for kind in (QPushButton, QComboBox):
        for control in widget.findChildren(kind):
            assert control.toolTip(), control
    for control in widget.findChildren(QLineEdit):
        assert control.toolTip() or control.parent().toolTip(), control


@pytest.mark.needs_gl
def test_it_fits_a_small_screen(make_napari_viewer, qtbot, tmp_path):
    viewer = make_napari_viewer(show=True)
    widget = MonitoringWidget(viewer)
    dock = viewer.window.add_dock_widget(widget, area="right")
    viewer.window.resize(1366, 768)
    qtbot.wait(50)
    assert widget.minimumSizeHint().height() < 500
    assert dock.width() < 460
    for button in widget.buttons:
        corner = button.mapTo(widget, button.rect().bottomRight())
        assert widget.rect().contains(corner)
    widget.scene.wait()

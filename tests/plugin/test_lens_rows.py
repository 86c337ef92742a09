"""Lensed quasars in the form that adds sources."""

from __future__ import annotations

import numpy as np
import pytest
from napari.utils.notifications import notification_manager
from typed import enter

from napari_issis import lensed_quasar
from napari_issis.exposure import same_table
from napari_issis.lensed_quasars import quasar_library
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.source_form import SourceForm

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def form(scene, qtbot):
    form = SourceForm(scene)
    qtbot.addWidget(form)
    form.resume()
    form.mode.value = "lens"
    yield form
    form.pause()


def test_a_press_adds_the_system_and_one_undo_takes_it_back(scene, form):
    """Catches a field that is shown and forgotten, and a system added image by image."""
    scene.observation = scene.observation.replace(roll=30.0)
    before = scene.sources.copy()
    form.lens.system.value = "HE0435-1223"
    for field, text in (
        (form.x, "30"),
        (form.y, "20.5"),
        (form.lens.flux, "3e-16"),
        (form.lens.ratios, "1, 0.5 0.25 2"),
    ):
        enter(field, text)
    form.button.native.click()
    expected = lensed_quasar(
        "HE0435-1223",
        scene.observation,
        flux=3e-16,
        ratios=(1, 0.5, 0.25, 2),
        centre=(30, 20.5),
    )
    assert len(scene.sources) == len(before) + 5
    for name in ("x", "y", "flux", "pa"):
        assert np.array_equal(scene.sources[name][-5:], expected[name])
    form.lens.galaxy.value = False
    assert same_table(form.table(), expected[:4])
    scene.undo()
    assert same_table(scene.sources, before)


def test_every_system_can_be_chosen_with_what_is_known_of_it(form):
    """Catches ratios of the system chosen before."""
    for name, system in quasar_library().items():
        form.lens.system.value = name
        shown = [float(word) for word in form.lens.ratios.value.split()]
        np.testing.assert_allclose(shown, system.ratios or (), atol=5e-3)
        assert form.lens.flux.number == pytest.approx(system.flux or 1e-15, rel=5e-3, abs=0)
        assert system.references[0] in form.lens.system.tooltip


def test_unknown_ratios_are_asked_for_and_nothing_is_added(scene, form):
    form.lens.system.value = "HE2149-2745"
    form.button.native.click()
    message = str(notification_manager.records[-1].message)
    assert "no flux ratios of HE2149-2745 are known here" in message
    assert len(scene.sources) == 4
    enter(form.lens.ratios, "1 0.2")
    form.button.native.click()
    assert len(scene.sources) == 7


def test_magnitudes(form):
    form.flux_unit.value = "AB mag"
    enter(form.lens.flux, "19")
    f_nu = 10 ** (-0.4 * (19 + 48.6))
    expected = f_nu * 2.99792458e18 / form.scene.observation.pivot**2
    assert form.table()["flux"][0].value == pytest.approx(expected, rel=1e-9, abs=0)


@pytest.mark.needs_gl
def test_the_rows_fit_the_dock(make_napari_viewer, qtbot, tmp_path):
    """Catches rows that are wider than the panel of a small screen."""
    viewer = make_napari_viewer(show=True)
    widget = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(widget, area="right")
    widget.sources.mode.value = "lens"
    viewer.window.resize(1366, 768)
    qtbot.wait(50)
    form, rows = widget.sources, widget.sources.lens
    for field in (rows.system, rows.flux, rows.ratios, rows.galaxy):
        corner = field.native.mapTo(form, field.native.rect().bottomRight())
        assert form.rect().contains(corner)
    viewer.window._qt_window.grab().save(str(tmp_path / "lens.png"))

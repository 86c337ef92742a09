"""The spectrum in the form of new sources."""

from __future__ import annotations

import astropy.units as u
import pytest
from astropy.table import QTable
from napari.utils.notifications import notification_manager
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from small_scene import SMALL

from napari_issis.plugin.source_form import SourceForm
from napari_issis.plugin.spectrum_field import FROM_FILE

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def form(scene, qtbot):
    form = SourceForm(scene)
    qtbot.addWidget(form)
    form.resume()
    yield form
    form.pause()


def choose(field, text):
    """Choose an entry of the list by keys, as a user does."""
    box = field.native
    box.setFocus()
    while box.currentIndex() > 0:
        QTest.keyClick(box, Qt.Key.Key_Up)
    for _ in range(box.findText(text)):
        QTest.keyClick(box, Qt.Key.Key_Down)


def type_in(field, text):
    line = field.native.lineEdit()
    line.selectAll()
    QTest.keyClicks(line, text)


@pytest.mark.parametrize("mode", ["specific", "random", "cluster"])
def test_new_sources_have_the_spectrum_that_was_typed(scene, form, mode):
    """Catches a spectrum that some way of adding sources forgets, and one that others get."""
    form.mode.value = mode
    form.number.number = 3
    type_in(form.spectrum, "blackbody(25000 K, z=0.5)")
    form.button.native.click()
    new = len(scene.sources) - 4
    assert new == (1 if mode == "specific" else 3)
    assert list(scene.sources["spectrum"]) == ["flat"] * 4 + ["blackbody(25000 K, z=0.5)"] * new
    scene.wait()
    type_in(form.spectrum, "flat")
    form.button.native.click()
    assert scene.sources["spectrum"][-1] == "flat"


def test_lensed_quasars_have_none_to_choose(form):
    form.mode.value = "lens"
    assert form.spectrum.native.isHidden()
    form.mode.value = "specific"
    assert not form.spectrum.native.isHidden()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("blackbdy(3e4)", "spectrum: 'blackbdy(3e4)' is unknown; known: flat"),
        ("powerlaw(x)", "index is 'x'; it must be a number"),
        ("blackbody(10 K)", "temperature is 10; it must be in"),
        ('table("not there.ecsv")', "cannot read not there.ecsv"),
        ("flat(z=0.1, z=0.2)", "z is given twice"),
    ],
)
def test_wrong_text_is_refused_by_name(scene, form, text, message):
    """Catches sources that are added flat, silently, and text that is lost."""
    notification_manager.records.clear()
    type_in(form.spectrum, text)
    assert message in form.spectrum.native.toolTip()
    assert "#b00020" in form.spectrum.native.styleSheet()
    form.button.native.click()
    assert message in str(notification_manager.records[-1].message)
    assert len(scene.sources) == 4
    assert form.spectrum.native.currentText() == text
    type_in(form.spectrum, "powerlaw(-2)")
    assert form.spectrum.native.styleSheet() == ""


def test_what_is_not_installed_is_named(form, monkeypatch):
    """Catches an error that nobody sees."""

    def missing(*_):
        raise ImportError('pip install "napari-issis[extinction]"')

    monkeypatch.setattr("napari_issis.spectra.transmitted", missing)
    type_in(form.spectrum, "flat(ebv=0.1)")
    assert "napari-issis[extinction]" in form.spectrum.native.toolTip()
    with pytest.raises(ValueError, match="extinction"):
        form.table()


def test_a_magnitude_is_at_the_wavelength_of_the_spectrum(scene, form):
    """Catches a magnitude that is read at the channel's wavelength although at= is given."""
    form.kind.value = "point"
    form.flux_unit.value = "AB mag"
    form.flux.value = "20"
    type_in(form.spectrum, "powerlaw(-1, at=1500)")
    assert form.flux.value == "20"
    form.button.native.click()
    # m_AB = -2.5 lg F_nu - 48.6, F_lambda = F_nu c / lambda^2
    expected = 10 ** (-0.4 * (20 + 48.6)) * 2.99792458e18 / 1500.0**2
    assert scene.sources["flux"][-1].to_value("erg / (s cm2 AA)") == pytest.approx(
        expected, rel=1e-9, abs=0
    )


def test_a_file_is_chosen_by_a_dialog(scene, form, tmp_path, monkeypatch):
    """Catches a dialog whose answer is dropped, and one that was cancelled and leaves rubbish."""
    path = tmp_path / "star, hot.ecsv"
    QTable({"wavelength": [1000, 4000] * u.AA, "flux": [2.0, 1.0]}).write(path)
    asked = iter([None, str(path)])
    monkeypatch.setattr(form.spectrum, "ask_path", lambda: next(asked))
    type_in(form.spectrum, "powerlaw(-2)")
    field = form.spectrum
    for text in ("powerlaw(-2)", f'table("{path}")'):
        field.native.setCurrentIndex(field.native.findText(FROM_FILE))
        field.native.activated.emit(field.native.currentIndex())
        assert field.native.currentText() == text
    form.button.native.click()
    assert scene.sources["spectrum"][-1] == f'table("{path}")'


def test_sources_drawn_by_hand_have_it_too(scene, form, mouse):
    """Catches a form that says one thing and draws another."""
    form.kind.value = "gaussian"
    choose(form.spectrum, "powerlaw(-1.5)")
    layer = scene.editor.ellipses.layer
    scene.viewer.layers.selection.active = layer
    layer.mode = "add_ellipse"
    mouse.drag((10.0, 40.0), (14.0, 44.0), (20.0, 50.0))
    layer.mode = "select"
    scene.wait()
    assert scene.sources["spectrum"][-1] == "powerlaw(-1.5)"
    form.flux.value = "2e-"
    assert scene.new_source["spectrum"] == "powerlaw(-1.5)"
    form.flux.value = "2e-15"
    type_in(form.spectrum, "flat")
    assert scene.new_source["spectrum"] is None


def test_what_has_no_light_in_the_channel_is_marked_and_drawn_flat(scene, form, mouse, tmp_path):
    """Catches a source that stops the simulation, and a mark that does not follow the channel."""
    path = tmp_path / "far.ecsv"
    QTable({"wavelength": [1200, 1700] * u.AA, "flux": [2.0, 1.0]}).write(path)
    scene.observation = SMALL.replace(channel="FUV")
    type_in(form.spectrum, f'table("{path}")')
    assert scene.new_source["spectrum"] == f'table("{path}")'
    scene.observation = SMALL
    assert "has no light in NUV" in form.spectrum.native.toolTip()
    with pytest.raises(ValueError, match="has no light in NUV"):
        form.table()
    layer = scene.editor.ellipses.layer
    scene.viewer.layers.selection.active = layer
    layer.mode = "add_ellipse"
    mouse.drag((10.0, 40.0), (14.0, 44.0), (20.0, 50.0))
    layer.mode = "select"
    scene.wait()
    assert len(scene.sources) == 5
    assert "spectrum" not in scene.sources.colnames
    scene.observation = SMALL.replace(channel="FUV")
    assert form.spectrum.native.styleSheet() == ""
    assert scene.new_source["spectrum"] == f'table("{path}")'

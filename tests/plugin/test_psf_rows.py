"""The PSF on the instrument panel: edited, measured, undone, kept."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from napari.utils.notifications import notification_manager
from small_scene import SMALL, few_sources
from typed import enter

from napari_issis import Exposure, GaussianPSF, ImagePSF, Observation, TelescopePSF, simulate
from napari_issis.plugin import psf_rows
from napari_issis.plugin.crash_guard import CrashGuard
from napari_issis.plugin.instrument_form import InstrumentForm

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
OWN = SMALL.replace(psf=None)


@pytest.fixture
def panel(scene, qtbot):
    scene.observation = OWN
    form = InstrumentForm(scene)
    qtbot.addWidget(form)
    form.resume()
    form.show()
    yield form
    form.pause()
    qtbot.waitUntil(lambda: not form.psf._jobs.busy, timeout=60000)


def nuv(**blurs) -> TelescopePSF:
    return TelescopePSF(1.7, 0.33, (1850, 3200), **{"blur_fwhm": 0.0888, **blurs})


def test_the_section_is_folded_and_begins_with_the_channels_own(panel):
    """Catches a panel that grew, and fields that do not show what is in use."""
    rows = panel.psf
    assert not rows.jitter.native.isVisible()
    rows.unfold.click()
    for field, value in ((rows.jitter, 0), (rows.blur, 0.0888), (rows.share, 0), (rows.width, 0)):
        assert field.native.isVisible()
        assert field.number == value
        assert "FWHM" in field.native.toolTip() or "Share" in field.native.toolTip()
    panel.channel.value = "FUV"
    assert rows.blur.number == 0.0945
    assert not rows.own.enabled


def test_an_edit_reaches_the_picture_and_is_undone(panel, scene):
    """Catches fields that change nothing, an edit that is no step, and a button that lies."""
    rows = panel.psf
    rows.unfold.click()
    enter(rows.jitter, "0.06")
    assert scene.observation == OWN.replace(psf=nuv(jitter_fwhm=0.06))
    scene.wait()
    wanted = simulate(scene.sources, OWN.replace(psf=nuv(jitter_fwhm=0.06)), seed=scene.seed)
    np.testing.assert_array_equal(scene.counts.layer.data, wanted.counts)
    assert scene.editor.history.last_step == "change the PSF"
    enter(rows.blur, "0.12")
    scene.add(few_sources()[:1])
    scene.undo()
    assert scene.observation.psf == nuv(jitter_fwhm=0.06, blur_fwhm=0.12)
    scene.undo()
    assert scene.observation.psf == nuv(jitter_fwhm=0.06)
    assert rows.blur.number == 0.0888
    scene.undo()
    assert scene.observation == OWN
    assert rows.jitter.number == 0
    for _ in range(2):
        scene.redo()
    assert scene.observation.psf == nuv(jitter_fwhm=0.06, blur_fwhm=0.12)
    rows.own.native.click()
    assert scene.observation == OWN
    assert rows.blur.number == 0.0888


def test_undo_of_the_psf_keeps_the_channel(panel, scene):
    """Catches a PSF with the band of the channel in which it was edited."""
    enter(panel.psf.jitter, "0.06")
    panel.channel.value = "FUV"
    fuv = TelescopePSF(1.7, 0.33, (1150, 1750), blur_fwhm=0.0945, jitter_fwhm=0.06)
    assert scene.observation == OWN.replace(channel="FUV", psf=fuv)
    scene.undo()
    assert scene.observation == OWN.replace(channel="FUV")
    scene.redo()
    assert scene.observation == OWN.replace(channel="FUV", psf=fuv)


def test_a_halo_needs_share_and_width_in_either_order(panel, scene):
    """Catches a share that is refused, with a pop-up, before its width can be typed."""
    rows = panel.psf
    notification_manager.records.clear()
    enter(rows.share, "0.1")
    assert scene.observation == OWN
    assert rows.share.number == 0.1
    assert "halo_fwhm is 0" in rows.width.native.toolTip()
    enter(rows.width, "1.5")
    assert scene.observation.psf == nuv(halo_share=0.1, halo_fwhm=1.5)
    assert rows.width.native.styleSheet() == ""
    assert not notification_manager.records


@pytest.mark.parametrize("text", ["-0.1", "x", "0,1", "nan", ""])
def test_what_is_no_width_changes_nothing(panel, scene, text):
    enter(panel.psf.jitter, "0.05")
    field = panel.psf.jitter
    field.native.clear()
    enter(field, text)
    panel.exposure.native.editingFinished.emit()
    assert scene.observation.psf == nuv(jitter_fwhm=0.05)
    assert field.native.text() == text
    assert "jitter_fwhm" in field.native.toolTip()


def test_width_and_encircled_energy_of_a_gaussian(panel, scene, qtbot):
    """1 - 2^-(d / FWHM)^2: catches a radius for a diameter, and a pixel that is put in."""
    panel.psf.unfold.click()
    scene.observation = OWN.replace(psf=GaussianPSF(0.2))
    told = panel.psf.read_out
    qtbot.waitUntil(lambda: "FWHM 0.2000″" in told.text(), timeout=60000)
    assert "0.1″ 15.9 %, 0.2″ 50.0 %, 0.5″ 98.7 %, 1″ 100.0 %; FWHM" in told.text()
    assert "GaussianPSF, given by a script" in panel.psf.text.text()
    assert not panel.psf.jitter.enabled
    panel.psf.own.native.click()
    assert scene.observation == OWN
    qtbot.waitUntil(lambda: "FWHM 0.0998″" in told.text(), timeout=60000)
    array = np.zeros((9, 9))
    array[3:6, 3:6] = 1.0
    scene.observation = OWN.replace(psf=ImagePSF(array, 0.036))
    assert "image" in told.text()


def test_it_is_measured_in_the_background_once_and_only_in_sight(panel, scene, qtbot, monkeypatch):
    """Catches work in the GUI's thread, twice for a PSF, or for a section that is folded."""
    measured = []

    def table(psf, diameters):
        measured.append((psf.jitter_fwhm, threading.current_thread()))
        return real(psf, diameters)

    real = psf_rows.psf_table
    monkeypatch.setattr(psf_rows, "psf_table", table)
    psf_rows.psf_text.cache_clear()
    enter(panel.psf.jitter, "0.061")
    assert not panel.psf._jobs.busy
    panel.psf.unfold.click()
    for jitter in ("0.062", "0.063", "0.064", "0.061"):
        enter(panel.psf.jitter, jitter)
    qtbot.waitUntil(lambda: not panel.psf._jobs.busy, timeout=60000)
    assert [jitter for jitter, _ in measured] == [0.061]
    for jitter in ("0.065", "0.061"):
        enter(panel.psf.jitter, jitter)
        qtbot.waitUntil(lambda: not panel.psf._jobs.busy, timeout=60000)
    assert [jitter for jitter, _ in measured] == [0.061, 0.065]
    assert panel.psf.read_out.isEnabled()
    assert all(thread is not threading.main_thread() for _, thread in measured)
    panel.hide()
    panel.pause()
    scene.observation = OWN
    assert not panel.psf._jobs.busy
    assert len(measured) == 2


def test_the_psf_comes_back_from_file_and_crash(panel, scene, qtbot, tmp_path):
    """Catches a PSF edited after the last source that is lost."""
    guard = CrashGuard(scene)
    qtbot.addWidget(guard)
    enter(panel.psf.share, "0.1")
    enter(panel.psf.width, "1.5")
    guard.save()
    qtbot.waitUntil(lambda: guard._file.path.exists() and not guard._jobs.busy, timeout=60000)
    scene.exposure.write(tmp_path / "x.fits")
    edited = nuv(halo_share=0.1, halo_fwhm=1.5)
    assert Exposure.read(tmp_path / "x.fits").observation == OWN.replace(psf=edited)
    from napari_issis.autosave import CrashedScene

    left = CrashedScene(guard._file.path, None)
    assert left.read()[1] == OWN.replace(psf=edited)
    panel.psf.own.native.click()
    guard._left = [left]
    guard._restore()
    assert scene.observation == OWN.replace(psf=edited)
    assert panel.psf.share.number == 0.1
    assert isinstance(scene.observation, Observation)

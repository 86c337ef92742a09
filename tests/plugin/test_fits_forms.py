"""The file types of the panel's dialog: the whole exposure, or one image of it."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.io import fits
from napari.utils.notifications import notification_manager
from qtpy.QtWidgets import QFileDialog

from napari_issis import Exposure
from napari_issis.plugin.dock import FITS_FORMS, SimulatorWidget

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def panel(scene, qtbot):
    panel = SimulatorWidget(scene.viewer)
    qtbot.addWidget(panel)
    return panel


def answer(monkeypatch, path, form):
    """Let the dialog be answered as by a user who chooses a file type and types a name."""

    def choose(dialog):
        assert f"{form} (*.fits)" in dialog.nameFilters()
        dialog.selectNameFilter(f"{form} (*.fits)")
        dialog.selectFile(str(path))
        return True

    monkeypatch.setattr(QFileDialog, "exec", choose)


@pytest.mark.parametrize("form", FITS_FORMS)
def test_each_file_type_writes_what_it_says(panel, tmp_path, monkeypatch, form):
    """Catches one image written for another, and a scene lost behind the word whole."""
    path = tmp_path / "x.fits"
    answer(monkeypatch, path, form)
    panel.save_fits()
    exposure = panel.scene.exposure
    if form.startswith("Whole"):
        assert Exposure.read(path) == exposure
        with fits.open(path) as hdus:
            assert isinstance(hdus[1], fits.CompImageHDU) == form.endswith("compressed")
        return
    values = {
        "Counts alone": exposure.counts,
        "Counts alone, as floats": exposure.counts,
        "Count rate alone": exposure.counts / exposure.observation.exposure,
        "Expected counts alone": exposure.expected,
        "SNR alone": exposure.snr,
    }[form]
    with fits.open(path) as hdus:
        assert len(hdus) == 1
        assert np.array_equal(hdus[0].data, values)
        assert hdus[0].data.dtype.kind == ("i" if form == "Counts alone" else "f")


def test_the_file_type_is_kept_and_nothing_is_lost_by_its_name(panel, tmp_path, monkeypatch):
    """Catches a type that changes by itself, and a file about which nobody was asked."""
    answer(monkeypatch, tmp_path / "x.fits", "SNR alone")
    panel.save_fits()
    offered = []
    monkeypatch.setattr(QFileDialog, "exec", lambda d: offered.append(d.selectedNameFilter()))
    panel.save_fits()
    assert offered == ["SNR alone (*.fits)"]
    before = (tmp_path / "x.fits").read_bytes()
    notification_manager.records.clear()
    monkeypatch.setattr(panel, "ask_path", lambda: str(tmp_path / "x"))
    panel.save_fits()
    assert (tmp_path / "x.fits").read_bytes() == before
    assert "exists already" in str(notification_manager.records[-1].message)

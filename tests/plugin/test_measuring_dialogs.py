"""The proposal sheet and aperture photometry, from the widgets."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import QTable
from napari.utils.notifications import notification_manager
from qtpy.QtCore import Qt
from qtpy.QtWidgets import QFileDialog

import napari_issis as ni
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.source_list import SourceList

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def answer(monkeypatch, path):
    """Let the file dialog be answered; None as by a user who changed his mind."""

    def choose(dialog):
        if path is None:
            return False
        dialog.selectFile(str(path))
        return True

    monkeypatch.setattr(QFileDialog, "exec", choose)


def finished(qtbot, job):
    qtbot.waitUntil(lambda: not job.busy, timeout=60_000)


@pytest.fixture
def panel(scene, qtbot):
    panel = SimulatorWidget(scene.viewer)
    qtbot.addWidget(panel)
    panel.show()
    return panel


@pytest.fixture
def dialog(panel, qtbot):
    qtbot.mouseClick(panel.sheet, Qt.MouseButton.LeftButton)
    assert panel._sheet_dialog.isVisible()
    return panel._sheet_dialog


def test_the_sheet_is_that_of_the_scene(dialog, scene, tmp_path, monkeypatch, qtbot):
    """Catches a sheet of another seed, and title, notes or goal that are forgotten."""
    scene.seed = 5
    scene.editor.select([int(scene.editor.source_id[1])])
    dialog.open_for_selection()
    assert dialog.snr.isEnabled()
    assert "selected source" in dialog.who.text()
    qtbot.keyClicks(dialog.title_, "Two stars")
    dialog.notes.setPlainText("and two galaxies")
    dialog.snr.setValue(20)
    answer(monkeypatch, tmp_path / "x.html")
    notification_manager.records.clear()
    dialog.save()
    finished(qtbot, dialog.job)
    assert not dialog.isVisible()
    goals = [{"rows": [1], "snr": 20.0}]
    ni.proposal_sheet(
        scene.sources,
        scene.observation,
        tmp_path / "y.html",
        seed=5,
        goals=goals,
        title="Two stars",
        notes="and two galaxies",
    )
    assert (tmp_path / "x.html").read_bytes() == (tmp_path / "y.html").read_bytes()
    assert "Saved" in str(notification_manager.records[-1].message)


def test_no_file_no_sheet_and_errors_are_told(dialog, tmp_path, monkeypatch, qtbot):
    answer(monkeypatch, None)
    dialog.save()
    assert dialog.isVisible()
    assert not dialog.job.busy
    assert not dialog.snr.isEnabled()
    monkeypatch.setattr(dialog, "ask_path", lambda: str(tmp_path / "nowhere" / "x.html"))
    notification_manager.records.clear()
    dialog.save()
    finished(qtbot, dialog.job)
    assert "does not exist" in str(notification_manager.records[-1].message)


@pytest.fixture
def source_list(scene, qtbot):
    sources = SourceList(scene.viewer)
    qtbot.addWidget(sources)
    return sources


@pytest.fixture
def photometry(source_list):
    source_list.photometry()
    return source_list._photometry


def test_photometry_of_all_and_of_the_selected(photometry, scene, tmp_path, monkeypatch, qtbot):
    """Catches options that are forgotten, and the wrong rows."""
    scene.wait()
    photometry.radius.setValue(3.0)
    photometry.sky.setCurrentText("mean")
    qtbot.mouseClick(photometry.measure_button, Qt.MouseButton.LeftButton)
    finished(qtbot, photometry.job)
    expected = ni.aperture_photometry(scene.exposure, radius=3.0, sky="mean")
    assert len(photometry.table) == len(scene.sources) == photometry.view.rowCount()
    assert np.array_equal(photometry.table["counts"], expected["counts"])
    header = [photometry.view.horizontalHeaderItem(i).text() for i in range(12)]
    for row in range(len(expected)):
        cell = photometry.view.item(row, header.index("bias (%)")).text()
        assert float(cell) == pytest.approx(expected["bias_percent"][row], rel=6e-3, abs=1e-9)
    answer(monkeypatch, tmp_path / "x.ecsv")
    photometry.save()
    read = QTable.read(tmp_path / "x.ecsv", format="ascii.ecsv")
    assert np.array_equal(read["counts"], expected["counts"])
    scene.editor.select([int(scene.editor.source_id[2])])
    photometry.measure()
    finished(qtbot, photometry.job)
    assert photometry.table["row"].tolist() == [2]
    assert "1 sources" not in photometry.text.text()


def test_photometry_s_errors_are_told(photometry, scene, qtbot):
    scene.wait()
    photometry.inner.setValue(3.0)
    photometry.outer.setValue(2.0)
    notification_manager.records.clear()
    photometry.measure()
    finished(qtbot, photometry.job)
    assert "annulus is (3.0, 2.0)" in str(notification_manager.records[-1].message)
    assert photometry.table is None
    assert photometry.text.text() == ""


def test_closing_in_the_middle_of_a_job_is_quiet(scene, qtbot):
    """Catches a result that is brought to a widget that is gone; pytest-qt shows the error."""
    scene.wait()
    sources = SourceList(scene.viewer)
    sources.photometry()
    job = sources._photometry.job
    sources._photometry.measure()
    assert job.busy
    sources.deleteLater()
    del sources
    finished(qtbot, job)
    qtbot.wait(50)

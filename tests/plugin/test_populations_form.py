"""Populations and units in the form that adds sources."""

from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from astropy.io import fits
from astropy.table import QTable
from napari.utils.notifications import notification_manager
from qtpy.QtCore import QPoint, QPointF, Qt
from qtpy.QtGui import QWheelEvent
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QLabel
from small_scene import SMALL, few_sources
from typed import enter

from napari_issis import random_sources, source, star_cluster
from napari_issis.exposure import same_table
from napari_issis.fits_table import table_hdu
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.source_form import SourceForm
from napari_issis.sources import check_sources

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
MAGNITUDES = np.array([20.0, 21.0, 22.0]) * u.ABmag


@pytest.fixture
def form(scene, qtbot):
    form = SourceForm(scene)
    qtbot.addWidget(form)
    form.resume()
    yield form
    form.pause()


def last_message():
    return str(notification_manager.records[-1].message)


def test_cluster_defaults_are_the_librarys(form):
    """Catches a form and a library that disagree on what a cluster is."""
    form.mode.value = "cluster"
    form.cluster.profile.value = "king"
    assert same_table(form.table(), star_cluster(100, centre=(40, 32), seed=1))


def test_every_field_of_a_cluster_is_used(scene, form):
    """Catches a field that is shown and forgotten, and a press that adds more than once."""
    form.mode.value = "cluster"
    form.number.native.lineEdit().selectAll()
    QTest.keyClicks(form.number.native.lineEdit(), "37")
    form.cluster.profile.value = "king"
    for field, text in (
        (form.x, "30"),
        (form.y, "20.5"),
        (form.cluster.concentration, "0.7"),
        (form.cluster.radius, "12"),
        (form.cluster.ellipticity, "0.3"),
        (form.cluster.pa, "70"),
        (form.cluster_fluxes.limits.low, "2e-16"),
        (form.cluster_fluxes.limits.high, "3e-15"),
        (form.cluster_fluxes.slope, "2.5"),
        (form.seed, "11"),
    ):
        enter(field, text)
    expected = star_cluster(
        37,
        profile="king",
        centre=(30, 20.5),
        radius=12,
        concentration=0.7,
        ellipticity=0.3,
        pa=70,
        flux=(2e-16, 3e-15),
        flux_slope=2.5,
        seed=11,
    )
    assert same_table(form.table(), expected)
    form.button.native.click()
    assert len(scene.sources) == 4 + 37
    assert np.array_equal(scene.sources["x"][4:], expected["x"])
    assert form.seed.number == 12
    enter(form.seed, "11")
    form.button.native.click()
    assert np.array_equal(scene.sources["y"][-37:], expected["y"])


@pytest.mark.parametrize("distribution", ["log", "power"])
def test_galaxies_have_distributions_too(form, distribution):
    form.mode.value = "random"
    form.fluxes.distribution.value = distribution
    enter(form.fluxes.slope, "1.7")
    expected = random_sources(
        "exponential",
        100,
        shape=SMALL.shape,
        flux_distribution=distribution,
        flux_slope=1.7,
        seed=1,
    )
    assert same_table(form.table(), expected)


def test_any_number_can_be_typed_or_chosen(form):
    """Catches a list that allows its own numbers only, or text that is taken for another."""
    box = form.number.native
    offered = [box.itemText(row) for row in range(box.count())]
    assert offered == ["1", "10", "100"]
    form.mode.value = "random"
    for row, number in enumerate((1, 10, 100)):
        box.setCurrentIndex(row)
        assert len(form.table()) == number
    form.number.number = 250
    assert len(form.table()) == 250
    assert box.styleSheet() == ""
    for text in ("2.5", "0", "-3", "1e3", "", "many", "1000001"):
        box.setEditText(text)
        with pytest.raises(ValueError, match=f"number of sources is '{text}'"):
            form.table()
        assert "#b00020" in box.styleSheet()
        assert text in box.toolTip()


def test_the_wheel_does_not_change_the_number(form):
    """Catches 100 sources that become 10 while the panel is scrolled."""
    box = form.number.native
    box.setCurrentIndex(1)
    form.mode.value = "random"
    form.show()
    for widget in (box, box.lineEdit()):
        point = QPointF(widget.rect().center())
        event = QWheelEvent(
            point,
            widget.mapToGlobal(point),
            QPoint(0, 0),
            QPoint(0, -120),
            Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier,
            Qt.ScrollPhase.NoScrollPhase,
            False,
        )
        QApplication.sendEvent(widget, event)
        assert form.number.number == 10


def shown(form):
    """Labels of the rows in sight."""
    return {
        label.text().replace("&", "")
        for label in form.findChildren(QLabel)
        if label.buddy() and not label.isHidden()
    }


def test_rows_are_shown_where_they_apply(form):
    """Catches rows that take room though they have no effect, and rows that are missing."""
    always = {"Units", "Mode", "Spectrum"}
    form.kind.value = "point"
    flux = "F (erg/s/cm²/Å)"
    assert shown(form) == always | {"Kind", "x, y (px)", flux}
    form.mode.value = "random"
    assert shown(form) == always | {"Kind", "Number", "Fluxes", flux, "Seed"}
    form.fluxes.distribution.value = "power"
    assert shown(form) == always | {"Kind", "Number", "Fluxes", flux, "Slope α", "Seed"}
    form.mode.value = "cluster"
    form.cluster.profile.value = "gaussian"
    place = {"Number", "x, y (px)", "Radius R½ (px)", "ε, PA (°)", "Fluxes", "Seed"}
    assert shown(form) == always | place | {"Profile", flux, "Slope α"}
    assert form.cluster.concentration.native.isHidden()
    form.cluster.profile.value = "king"
    assert not form.cluster.concentration.native.isHidden()
    form.cluster_fluxes.distribution.value = "table"
    form.length_unit.value = "arcsec"
    place = {text.replace("½ (px)", "½ (″)") for text in place}
    assert shown(form) == always | place | {"Profile, c", "Flux table"}


@pytest.mark.parametrize("name", ["fluxes.ecsv", "fluxes.fits"])
def test_fluxes_from_a_table(scene, form, tmp_path, monkeypatch, name):
    """Catches magnitudes taken for fluxes, and a table that is read and not used."""
    path = tmp_path / name
    table = QTable({"star": [1, 2, 3], "flux": MAGNITUDES})
    if path.suffix == ".fits":
        fits.HDUList([fits.PrimaryHDU(), table_hdu(table, "STARS")]).writeto(path)
    else:
        table.write(path)
    form.mode.value = "cluster"
    rows = form.cluster_fluxes
    rows.distribution.value = "table"
    notification_manager.records.clear()
    form.button.native.click()
    assert "no flux table is chosen" in last_message()
    monkeypatch.setattr(rows, "ask_path", lambda: str(path))
    rows.file.native.click()
    assert rows.file.text.endswith("(3)")
    expected = star_cluster(100, centre=(40, 32), flux_sample=MAGNITUDES, seed=1)
    assert same_table(form.table(), expected)
    form.button.native.click()
    # The scene's own unit is kept.
    added = scene.sources[4:]
    assert added["flux"].unit == few_sources()["flux"].unit
    pivot = SMALL.channel_data.pivot
    fluxes = check_sources(expected, pivot=pivot).flux
    assert added["flux"].value == pytest.approx(fluxes, rel=1e-12, abs=0)


def test_a_bad_table_is_told_and_changes_nothing(form, tmp_path, monkeypatch):
    rows = form.cluster_fluxes
    form.mode.value = "cluster"
    rows.distribution.value = "table"
    (tmp_path / "a.csv").write_text("brightness\n1e-15\n")
    (tmp_path / "b.csv").write_text("flux\n1e-15\nbright\n")
    (tmp_path / "c.csv").write_text("flux,x\n1e-15,1\n-2,1\n")
    (tmp_path / "d.csv").write_text("")
    (tmp_path / "e.fits").write_text("nothing")
    (tmp_path / "g.csv").write_text("flux,x\n1e-15,1\n,1\n")
    (tmp_path / "h.csv").write_text("flux,x\n1e-15,1\n1e-15,1\n7,1\n")
    for name, message in (
        ("a.csv", "no column flux; its columns are: brightness"),
        ("b.csv", "does not hold numbers"),
        ("c.csv", "row 1, flux: -2"),
        ("d.csv", "d.csv"),
        ("e.fits", "not a FITS file"),
        ("f.csv", "cannot read"),
        ("g.csv", "row 1, flux: nan"),
        ("h.csv", "row 2, flux: 7 is not allowed"),
        ("i.txt", "its name must end in"),
    ):
        notification_manager.records.clear()
        monkeypatch.setattr(rows, "ask_path", lambda name=name: str(tmp_path / name))
        rows.file.native.click()
        assert message in last_message()
        with pytest.raises(ValueError, match="no flux table is chosen"):
            form.table()
    notification_manager.records.clear()
    monkeypatch.setattr(rows, "ask_path", lambda: None)
    rows.file.native.click()
    assert not notification_manager.records


def test_magnitudes_and_fluxes_make_the_same_source(scene, form):
    """Catches a magnitude that is added at another wavelength than the channel's."""
    for channel in ("NUV", "FUV"):
        scene.observation = SMALL.replace(channel=channel)
        form.flux_unit.value = "AB mag"
        enter(form.flux, "21.5")
        form.button.native.click()
        form.flux_unit.value = "flux"
        form.button.native.click()
        typed, converted = scene.sources["flux"][-2:]
        flux = check_sources(
            source("point", 0, 0, 21.5 * u.ABmag), pivot=scene.observation.channel_data.pivot
        ).flux[0]
        assert typed.value == converted.value == pytest.approx(flux, rel=1e-12, abs=0)
        assert scene.new_source["flux"] == typed.value


def test_a_scene_in_magnitudes_takes_fluxes_and_magnitudes(scene, form):
    """Catches numbers that are appended to a column of another unit."""
    scene.sources = source("point", 10, 10, 20 * u.ABmag)
    enter(form.flux, "1e-15")
    form.button.native.click()
    form.flux_unit.value = "AB mag"
    enter(form.flux, "22.25")
    form.button.native.click()
    pivot = SMALL.channel_data.pivot
    fluxes = check_sources(scene.sources, pivot=pivot).flux
    assert scene.sources["flux"].unit == u.ABmag
    assert fluxes[1] == pytest.approx(1e-15, rel=1e-12, abs=0)
    assert scene.sources["flux"][2].value == pytest.approx(22.25)


def test_the_scenes_units_are_followed_and_set(scene, form):
    """Catches two places that show different units, and labels that stay."""
    scene.units.flux = "AB mag"
    scene.units.length = "arcsec"
    assert (form.flux_unit.value, form.length_unit.value) == ("AB mag", "arcsec")
    assert {"F (AB mag)", "R½ (″)"} <= shown(form)
    assert form.r_half.value == "0.72"
    form.mode.value = "random"
    assert form.r_limits.low.value == "0.36"
    assert same_table(form.table(), random_sources("exponential", 100, shape=SMALL.shape, seed=1))
    form.pause()
    scene.units.length = "px"
    assert form.r_half.value == "0.72"
    assert form.r_half.number == 20.0
    form.resume()
    assert form.r_half.value == "20"
    form.length_unit.value = "arcsec"
    form.flux_unit.value = "flux"
    assert (scene.units.length, scene.units.flux) == ("arcsec", "flux")
    form.mode.value = "cluster"
    enter(form.cluster.radius, "0.9")
    assert form.cluster.radius.number == pytest.approx(25.0)
    stars = form.table()
    expected = star_cluster(100, centre=(40, 32), radius=25.0, seed=1)["x"]
    assert np.allclose(stars["x"], expected)


def test_drawn_sources_follow_the_channel_of_a_typed_magnitude(scene, form):
    """Catches ellipses drawn by hand with the flux of another channel."""
    form.flux_unit.value = "AB mag"
    enter(form.flux, "20")
    before = scene.new_source["flux"]
    scene.observation = SMALL.replace(channel="FUV")
    assert scene.new_source["flux"] == form.flux.number != before


def test_wrong_cluster_values_are_marked_and_told(scene, form):
    """Catches errors that show only after the button was pressed, or add some sources."""
    form.mode.value = "cluster"
    form.cluster.profile.value = "king"
    for field, wrong, right, name in (
        (form.cluster.radius, "0", "10", "radius"),
        (form.cluster.concentration, "9", "1", "concentration"),
        (form.cluster.ellipticity, "1", "0", "ellipticity"),
        (form.cluster.pa, "up", "0", "position angle"),
        (form.cluster_fluxes.slope, "1,4", "1.4", "slope"),
        (form.cluster_fluxes.limits.low, "-1", "1e-16", "flux"),
    ):
        notification_manager.records.clear()
        enter(field, wrong)
        assert field.native.styleSheet()
        form.button.native.click()
        assert name in last_message()
        enter(field, right)
        assert field.native.styleSheet() == ""
    assert len(scene.sources) == 4


@pytest.mark.needs_gl
def test_everything_fits_the_dock(make_napari_viewer):
    """Catches labels and choices that are clipped, and rows wider than the dock."""
    viewer = make_napari_viewer(show=True)
    open_scene(few_sources(), SMALL, viewer=viewer)
    viewer.window.resize(1366, 738)
    widget = next(iter(viewer.window.dock_widgets.values()))
    assert isinstance(widget, SimulatorWidget)
    form = widget.sources
    for mode, flux, length in (
        ("specific", "flux", "px"),
        ("random", "flux", "px"),
        ("cluster", "AB mag", "arcsec"),
    ):
        form.mode.value, form.flux_unit.value, form.length_unit.value = mode, flux, length
        QApplication.processEvents()
        for label in form.findChildren(QLabel):
            if label.isVisible():
                assert label.width() >= label.sizeHint().width(), label.text()
        for box in (form.flux_unit, form.length_unit, form.mode, form.number, form.cluster.profile):
            native = box.native
            if native.isVisible():
                text = native.fontMetrics().horizontalAdvance(native.currentText())
                # napari's arrow and padding take 32 pixels.
                assert native.width() >= text + 32, native.currentText()
        assert form.width() <= widget.width()


def test_labels_lead_to_their_fields(form):
    """Catches labels without a buddy, and two that share a key."""
    keys = [
        label.text().split("&")[1][0] for label in form.findChildren(QLabel) if "&" in label.text()
    ]
    assert sorted(keys) == sorted(set(keys)) == ["K", "M", "U", "b", "d"]
    assert all(label.buddy() is not None for label in form.findChildren(QLabel))
    assert all(label.toolTip() for label in form.findChildren(QLabel))


def test_tab_goes_from_row_to_row(form, qtbot):
    """Catches a Tab key that jumps about, or stops at what is hidden."""
    form.mode.value = "cluster"
    form.show()
    fluxes = form.cluster_fluxes
    rows = [
        form.flux_unit,
        form.length_unit,
        form.mode,
        form.number,
        form.x,
        form.y,
        form.cluster.profile,
        form.cluster.concentration,
        form.cluster.radius,
        form.cluster.ellipticity,
        form.cluster.pa,
        fluxes.distribution,
        fluxes.limits.low,
        fluxes.limits.high,
        fluxes.slope,
        form.seed,
    ]
    chain, widget = [], form
    for _ in range(200):
        widget = widget.nextInFocusChain()
        if widget is form:
            break
        if widget.isVisibleTo(form) and widget.focusPolicy() & Qt.FocusPolicy.TabFocus:
            chain.append(widget)
    fields = [row.native for row in rows]
    assert [widget for widget in chain if widget in fields] == fields

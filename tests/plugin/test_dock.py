"""The widgets in a real napari window, and the samples."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from napari.utils.notifications import notification_manager
from npe2 import PluginManifest
from qtpy.QtCore import QPoint, QPointF, Qt
from qtpy.QtGui import QWheelEvent
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources
from typed import enter

from napari_issis import SKIES, Exposure, Filter, random_sources, simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin import exposure_layers, samples
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.instrument_form import InstrumentForm
from napari_issis.plugin.scene import open_scene, scene_of
from napari_issis.plugin.source_form import SourceForm
from napari_issis.scenes import SCENES, example_scene

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
ROOT = Path(__file__).parents[2]


@pytest.fixture
def form(scene, qtbot):
    form = SourceForm(scene)
    qtbot.addWidget(form)
    return form


@pytest.fixture
def instrument(scene, qtbot):
    form = InstrumentForm(scene)
    qtbot.addWidget(form)
    return form


def test_defaults_are_the_papers(form):
    """Catches other defaults than those of the paper's forms."""
    assert same_table(form.table(), source("exponential", 40, 32))
    form.mode.value = "random"
    form.seed.value = "7"
    assert same_table(form.table(), random_sources("exponential", 100, shape=(64, 80), seed=7))


def test_every_kind_and_mode_can_be_added(scene, form):
    for kind in ("point", "uniform", "gaussian", "exponential", "devaucouleurs", "sersic"):
        form.kind.value = kind
        form.mode.value = "specific"
        form.button.native.click()
        form.mode.value = "random"
        form.number.number = 10
        form.button.native.click()
    kinds, numbers = np.unique(scene.sources["kind"][4:], return_counts=True)
    assert list(numbers) == [11] * 6
    assert len(kinds) == 6
    assert form.seed.number == 7
    scene.wait()
    assert scene.exposure == simulate(scene.sources, SMALL)


def test_only_fields_that_matter_are_shown(form):
    """Catches rows that push others out of sight though they have no effect."""
    shown = {
        "point": "",
        "exponential": "r_half ellipticity pa",
        "sersic": "r_half ellipticity pa n",
    }
    for kind, names in shown.items():
        form.kind.value = kind
        form.mode.value = "specific"
        for name in ("r_half", "ellipticity", "pa", "n"):
            assert getattr(form, name).native.isHidden() == (name not in names.split())
        assert form.r_limits.low.native.parent().isHidden()
        form.mode.value = "random"
        assert form.r_half.native.isHidden()
        assert form.r_limits.low.native.parent().isHidden() == (kind == "point")
        assert form.n_limits.low.native.parent().isHidden() == (kind != "sersic")


def test_the_place_offered_is_the_centre_of_the_frame(scene, form):
    """Catches sources that are added outside a small frame, and typed places that are lost."""
    form.resume()
    assert (form.x.number, form.y.number) == (40, 32)
    scene.observation = SMALL.replace(shape=(512, 512))
    assert (form.x.number, form.y.number) == (256, 256)
    enter(form.y, "10.5")
    scene.observation = SMALL.replace(shape=(256, 256))
    assert (form.x.number, form.y.number) == (256, 10.5)
    form.pause()


def wheel(widget):
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


def test_the_wheel_changes_no_field_it_passes_over(scene, instrument, form, monkeypatch):
    """Catches channels and frames that change while the panel is scrolled."""
    before = scene.observation
    boxes = [instrument.channel, instrument.wheel1, instrument.frame, form.kind, form.mode]
    values = [box.value for box in boxes]
    for box in boxes:
        wheel(box.native)
    assert [box.value for box in boxes] == values
    assert scene.observation == before
    monkeypatch.setattr(instrument.wheel1.native, "hasFocus", lambda: True)
    wheel(instrument.wheel1.native)
    assert scene.observation.filters == ("NF1", "open")


def test_a_wrong_value_is_shown_and_adds_nothing(scene, form):
    notification_manager.records.clear()
    form.flux.value = "1e-14 Jy"
    form.button.native.click()
    form.flux.value = "-1"
    form.button.native.click()
    form.mode.value = "random"
    form.e_limits.high.value = "1.5"
    form.button.native.click()
    texts = [str(note.message) for note in notification_manager.records]
    assert len(texts) == 3
    for text, name in zip(texts, ("'1e-14 Jy'", "flux", "ellipticity"), strict=True):
        assert name in text
    assert len(scene.sources) == 4


def test_the_form_says_what_is_drawn_by_hand(scene, form):
    form.kind.value = "sersic"
    form.n.value = "3.5"
    form.flux.value = "2e-15"
    assert scene.new_source["kind"] == "sersic"
    assert scene.new_source["n"] == 3.5
    form.flux.value = "2e-"
    assert scene.new_source["flux"] == 2e-15


def test_the_instrument_form_sets_the_observation(scene, instrument):
    instrument.channel.value = "FUV"
    instrument.wheel2.value = "NF1"
    enter(instrument.exposure, "250")
    instrument.frame.value = (256, 256)
    enter(instrument.seed, "3")
    instrument.new_noise.native.click()
    assert scene.observation == SMALL.replace(
        channel="FUV", filters=("open", "NF1"), exposure=250.0, shape=(256, 256)
    )
    assert scene.seed == 4
    assert instrument.seed.number == 4
    # 4.9e-3 and 7.2e-12 cps per pixel behind NF1.
    assert "0.00049 cps/px" in instrument.sky.text()
    assert "geocorona 0.00049" in instrument.sky.text()
    assert "7.2e-13" in instrument.sky.text()


@pytest.mark.parametrize(
    ("typed", "seconds"), [("1e3", 1000.0), ("1000", 1000.0), (" 12.5 ", 12.5), (".004", 0.004)]
)
def test_an_exposure_is_read_as_typed(scene, instrument, typed, seconds):
    """Catches 1e3 that is read as 13: fields that drop keys."""
    enter(instrument.exposure, typed)
    assert scene.observation.exposure == seconds


@pytest.mark.parametrize("typed", ["12,5", "1,000", "1_000", "1e", "nan", "1e999", "0", "-3", ""])
def test_what_is_no_exposure_changes_nothing(scene, instrument, typed):
    """Catches 12,5 that is read as 125; the text stays, red, until it is corrected."""
    enter(instrument.exposure, "7")
    field = instrument.exposure.native
    field.clear()
    enter(instrument.exposure, typed)
    instrument.channel.value = "FUV"
    assert scene.observation == SMALL.replace(exposure=7.0, channel="FUV")
    assert field.text() == typed
    assert "exposure" in field.toolTip()
    assert "#b00020" in field.styleSheet()
    enter(instrument.exposure, "8")
    assert scene.observation.exposure == 8.0
    assert field.styleSheet() == ""


@pytest.mark.parametrize("name", ["x", "y", "flux", "r_half", "ellipticity", "pa", "n"])
def test_source_parameters_are_read_as_typed(scene, form, name):
    """Catches 5e-1 that is read as 51, and 0,5 as 5 or 0.5: nobody knows which is meant."""
    notification_manager.records.clear()
    form.kind.value = "sersic"
    field = getattr(form, name)
    enter(field, "5e-1")
    form.button.native.click()
    assert getattr(scene.sources[-1][name], "value", scene.sources[-1][name]) == 0.5
    enter(field, "0,5")
    form.button.native.click()
    assert len(scene.sources) == 5
    assert f"{name} is '0,5'" in str(notification_manager.records[-1].message)
    assert field.native.styleSheet()


def test_limits_outside_the_allowed_are_marked(form):
    """Catches a form that shows its errors only when the button is pressed."""
    form.kind.value = "sersic"
    for field, text in (
        (form.flux, "-1"),
        (form.ellipticity, "1"),
        (form.r_half, "0"),
        (form.n, "9"),
        (form.e_limits.high, "1.5"),
        (form.seed, "1.5"),
    ):
        assert field.native.styleSheet() == ""
        enter(field, text)
        assert "#b00020" in field.native.styleSheet()
        assert text in field.native.toolTip()


@pytest.mark.parametrize("exposure", [123.4567, 0.0042, 1.23456789012345678e9])
def test_the_panel_keeps_what_a_script_set(scene, instrument, exposure):
    """Catches a panel that rounds the exposure, or refuses it, when the channel changes."""
    instrument.resume()
    scene.observation = SMALL.replace(exposure=exposure)
    instrument.channel.value = "FUV"
    instrument.exposure.native.editingFinished.emit()
    assert scene.observation == SMALL.replace(exposure=exposure, channel="FUV")
    assert instrument.exposure.number == exposure
    instrument.pause()


def test_any_value_set_by_a_script_is_shown(scene, instrument):
    """Catches a panel that raises in the event of a seed or an exposure beyond its range."""
    instrument.resume()
    scene.seed = 2**63
    scene.observation = SMALL.replace(exposure=3e7)
    assert instrument.seed.number == 2**63
    assert instrument.exposure.number == 3e7
    instrument.new_noise.native.click()
    assert scene.seed == 2**63 + 1
    instrument.pause()


def test_the_instrument_form_follows_scripts_only_while_shown(scene, instrument):
    """Catches forms that work while nobody sees them."""
    instrument.resume()
    scene.observation = SMALL.replace(exposure=7.0)
    assert instrument.exposure.number == 7.0
    instrument.pause()
    scene.observation = SMALL.replace(exposure=8.0)
    assert instrument.exposure.number == 7.0
    instrument.resume()
    assert instrument.exposure.number == 8.0
    assert "given by a script" in instrument.psf.text.text()
    scene.observation = SMALL.replace(psf=None)
    assert "assumed" in instrument.psf.text.text()
    instrument.pause()


def test_count_rate_warnings_are_shown_in_place(scene, instrument):
    instrument.resume()
    scene.add(source("point", 30, 30, flux=1e-12))
    scene.wait()
    assert instrument.warning.text().startswith("Too bright: ")
    assert "row 4" in instrument.warning.text()
    assert len(instrument.warning.text()) < 120
    # at length where the pointer rests
    for sentence in scene.picture.warnings:
        assert escape(sentence) in instrument.warning.toolTip()
    assert "linear" in instrument.warning.toolTip()
    assert not instrument.warning.isHidden()
    scene.sources = few_sources()[:0]
    scene.wait()
    assert instrument.warning.isHidden()
    instrument.pause()


def test_save_fits(scene, qtbot, tmp_path, monkeypatch):
    widget = SimulatorWidget(scene.viewer)
    qtbot.addWidget(widget)
    assert widget.scene is scene
    monkeypatch.setattr(widget, "ask_path", lambda: str(tmp_path / "x.fits"))
    scene.add(source("point", 30, 30))
    widget.save.native.click()
    assert Exposure.read(tmp_path / "x.fits") == scene.exposure
    assert len(scene.exposure.sources) == 5
    notification_manager.records.clear()
    monkeypatch.setattr(widget, "ask_path", lambda: str(tmp_path / "no" / "x.fits"))
    widget.save.native.click()
    assert "does not exist" in str(notification_manager.records[-1].message)
    monkeypatch.setattr(widget, "ask_path", lambda: None)
    widget.save.native.click()


def test_save_fits_appends_the_suffix(scene, qtbot, tmp_path, monkeypatch):
    """Catches names such as field.v2 that are refused, and overwriting without a question."""
    widget = SimulatorWidget(scene.viewer)
    qtbot.addWidget(widget)
    monkeypatch.setattr(widget, "ask_path", lambda: str(tmp_path / "field.v2"))
    widget.save.native.click()
    assert Exposure.read(tmp_path / "field.v2.fits") == scene.exposure
    (tmp_path / "field.v2.fits").write_text("mine")
    widget.save.native.click()
    assert (tmp_path / "field.v2.fits").read_text() == "mine"


def test_what_was_typed_is_saved(scene, qtbot, tmp_path, monkeypatch):
    """Catches a file with another exposure than the panel shows: typed, but without Enter."""
    widget = SimulatorWidget(scene.viewer)
    qtbot.addWidget(widget)
    monkeypatch.setattr(widget, "ask_path", lambda: str(tmp_path / "x.fits"))
    widget.instrument.exposure.native.setText("11")
    widget.save.native.click()
    assert Exposure.read(tmp_path / "x.fits").observation == SMALL.replace(exposure=11.0)


@pytest.mark.needs_gl
def test_the_buttons_are_in_sight_and_have_keys_of_their_own(make_napari_viewer, qtbot):
    """Catches a button below the fold on a small screen, and keys that napari has already."""
    viewer = make_napari_viewer(show=True)
    scene = open_scene(few_sources(), SMALL, viewer=viewer)
    viewer.window.resize(1366, 738)
    widget = next(iter(viewer.window.dock_widgets.values()))
    scene.add(source("point", 30, 30, flux=1e-11))
    scene.wait()
    widget.sources.kind.value = "sersic"
    widget.sources.mode.value = "random"
    QApplication.processEvents()
    for button in (widget.sources.button.native, widget.save.native):
        assert button.visibleRegion().boundingRect().size() == button.size()
    menus = [action.text() for action in viewer.window._qt_window.menuBar().actions()]
    taken = {text[text.index("&") + 1].upper() for text in menus if "&" in text} | {"S", "C"}
    for button in (widget.sources.button, widget.save, widget.instrument.new_noise):
        text = button.native.text()
        key = text[text.index("&") + 1].upper()
        assert key not in taken
        taken.add(key)


def test_the_menu_makes_a_scene_in_its_viewer(make_napari_viewer_proxy, npe2pm):
    """Catches a widget that needs a script, or that uses what plugins may not."""
    viewer = make_napari_viewer_proxy()
    with npe2pm.tmp_plugin(manifest=PluginManifest.from_file(ROOT / "napari.yaml")):
        _, widget = viewer.window.add_plugin_dock_widget("napari-issis", "ISSIS simulator")
        assert [layer.name for layer in viewer.layers] == [
            "ISSIS counts",
            "ISSIS extended sources",
            "ISSIS point sources",
        ]
        scene = scene_of(viewer)
        assert widget.scene is scene
        scene.observation = SMALL
        widget.sources.button.native.click()
        scene.wait()
        assert scene.exposure == simulate(source("exponential", 256, 256), SMALL)
        assert open_scene(viewer=viewer) is scene
        assert len(viewer.window.dock_widgets) == 1


def test_open_sample_gives_a_live_scene(make_napari_viewer, npe2pm, qtbot, monkeypatch):
    """Catches samples that are dead pictures, and a scene lost without a question."""
    viewer = make_napari_viewer()
    monkeypatch.setattr(samples.napari, "current_viewer", lambda: viewer)
    small = {
        "q2237": replace(example_scene("q2237"), sources=few_sources(), observation=SMALL),
        "blend": replace(example_scene("blend"), observation=SMALL.replace(channel="FUV")),
    }
    monkeypatch.setattr(samples, "example_scene", small.get)
    asked = []
    monkeypatch.setattr(exposure_layers, "may_replace", lambda count: asked.append(count) or False)
    with npe2pm.tmp_plugin(manifest=PluginManifest.from_file(ROOT / "napari.yaml")):
        viewer.open_sample("napari-issis", "q2237")
        assert len(viewer.layers) == 3
        qtbot.waitUntil(lambda: scene_of(viewer) is not None, timeout=5000)
        scene = scene_of(viewer)
        scene.wait()
        assert scene.exposure == simulate(few_sources(), SMALL)
        assert scene.layers == list(viewer.layers)
        viewer.open_sample("napari-issis", "blend")
        qtbot.waitUntil(lambda: asked == [4], timeout=5000)
        assert len(viewer.layers) == 3
        assert len(scene.sources) == 4
        # else neither mouse nor keys reach the scene that was kept
        assert viewer.layers.selection.active is scene.layers[-1]
        monkeypatch.setattr(exposure_layers, "may_replace", lambda count: True)
        viewer.open_sample("napari-issis", "blend")
        qtbot.waitUntil(lambda: len(viewer.layers) == 3, timeout=5000)
        scene.wait()
        assert len(scene.sources) == 2
        assert scene.observation == SMALL.replace(channel="FUV")


def test_each_builtin_scene_is_a_sample():
    keys = {
        sample.key
        for sample in PluginManifest.from_file(ROOT / "napari.yaml").contributions.sample_data
    }
    assert keys == set(SCENES)


@pytest.mark.needs_gl
def test_the_picture_on_the_screen(make_napari_viewer):
    """Catches a frame upside down or mirrored, and markers off their sources.

    One star near the lower left corner: in the window its light and its red marker have to be
    in the lower left quarter, one around the other.
    """
    viewer = make_napari_viewer(show=True)
    scene = open_scene(
        source("point", 60, 40, 1e-13), SMALL.replace(shape=(256, 256)), viewer=viewer, dock=False
    )
    scene.wait()
    for _ in range(5):
        QApplication.processEvents()
    points = scene.editor.points.layer
    points.visible = False
    light = viewer.screenshot(flash=False)[..., :3].astype(float)
    points.visible = True
    marked = viewer.screenshot(flash=False)[..., :3].astype(float)
    height, width = light.shape[:2]
    bright = np.argwhere(light.min(axis=-1) > 200)
    y, x = bright.mean(axis=0)
    assert y > 0.6 * height
    assert x < 0.5 * width
    red = np.argwhere((marked[..., 0] > 150) & (marked[..., 1] < 60))
    assert red.mean(axis=0) == pytest.approx([y, x], abs=3)


def test_filters_with_a_curve_and_skies(scene, instrument, tmp_path, monkeypatch):
    """Catches a curve that the picture ignores, and a channel that keeps a filter it cannot use."""
    instrument.wheel2.value = "N2500"
    instrument.sky_model.value = SKIES["HST high"]
    scene.wait()
    observation = SMALL.replace(filters=("open", "N2500"), sky=SKIES["HST high"])
    assert scene.exposure == simulate(few_sources(), observation)
    assert "zodiacal light" in instrument.sky.text()
    assert "N1550" not in instrument.wheel1.choices
    instrument.channel.value = "FUV"
    assert scene.observation.filters == ("open", "open")
    assert "N1550" in instrument.wheel1.choices
    path = tmp_path / "mine.csv"
    path.write_text("wavelength_A,transmission\n1200,0\n1300,0.5\n1500,0.5\n1600,0\n")
    monkeypatch.setattr(instrument, "ask_path", lambda: str(path))
    instrument.wheel1.value = "load"
    scene.wait()
    own = Filter.read(path)
    assert scene.observation.filters == (own, "open")
    assert instrument.wheel1.value == own
    assert scene.exposure == simulate(few_sources(), scene.observation)


def test_a_wrong_curve_leaves_the_wheel(scene, instrument, tmp_path, monkeypatch):
    """Catches a wheel that shows a filter which is not in it."""
    notification_manager.records.clear()
    (tmp_path / "wrong.csv").write_text("nonsense\n1\n")
    for path in (str(tmp_path / "wrong.csv"), None):
        monkeypatch.setattr(instrument, "ask_path", lambda path=path: path)
        instrument.wheel1.value = "load"
        assert instrument.wheel1.value == "open"
        assert scene.observation.filters == ("open", "open")
    assert len(notification_manager.records) == 1


def test_the_frames_place_on_the_sky(scene, instrument):
    """Catches a position that is rounded because it was shown, and a wrong one that is taken."""
    exact = SkyCoord(340.12612345678, 3.3586123456789, unit="deg")
    scene.observation = SMALL.replace(pointing=exact, roll=12.5)
    instrument.show_observation()
    assert instrument.position.value == "22:40:30.270 +03:21:31.004"
    enter(instrument.roll, "40")
    assert scene.observation.roll == 40.0
    assert scene.observation.pointing is exact or scene.observation.pointing.ra == exact.ra
    enter(instrument.position, "340.1 95")
    assert scene.observation.pointing.dec == exact.dec
    assert "-90 to 90" in instrument.position.native.toolTip()
    enter(instrument.position, "20h13m15s -60d30m10s")
    assert scene.observation.pointing.ra.deg == pytest.approx(303.3125, abs=1e-9)
    enter(instrument.position, " ")
    assert scene.observation.pointing is None
    scene.wait()
    assert scene.exposure == simulate(few_sources(), SMALL.replace(roll=40.0))

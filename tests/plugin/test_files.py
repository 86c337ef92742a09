"""Files through napari: exposures come back as live scenes, images and catalogues join them."""

from __future__ import annotations

from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.wcs import WCS
from napari.utils.notifications import notification_manager
from npe2 import PluginManifest
from PIL import Image
from qtpy.QtWidgets import QVBoxLayout, QWidget
from small_scene import SMALL, few_sources

from napari_issis import read_rgba, simulate, write_sources
from napari_issis.autosave import Autosave, CrashedScene, crashed_scenes
from napari_issis.exposure import same_table
from napari_issis.plugin import crash_guard, exposure_layers, reader
from napari_issis.plugin.crash_guard import CrashGuard
from napari_issis.plugin.png_menu import PngMenu
from napari_issis.plugin.scene import open_scene, scene_of

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")
ROOT = Path(__file__).parents[2]
POINTING = SkyCoord("20h13m15s -60d30m10s")


@pytest.fixture
def window(make_napari_viewer, npe2pm, monkeypatch):
    viewer = make_napari_viewer()
    monkeypatch.setattr(reader.napari, "current_viewer", lambda: viewer)
    notification_manager.records.clear()
    with npe2pm.tmp_plugin(manifest=PluginManifest.from_file(ROOT / "napari.yaml")):
        yield viewer
    viewer.layers.clear()


def told():
    return "\n".join(str(note.message) for note in notification_manager.records)


def test_a_saved_exposure_comes_back_as_a_live_scene(window, tmp_path, qtbot):
    """Catches a file that opens as a dead picture, or with another instrument or seed."""
    observation = SMALL.replace(channel="FUV", filters=("NF1", "open"), pointing=POINTING, roll=33)
    exposure = simulate(few_sources(), observation, seed=77)
    exposure.write(tmp_path / "field.fits")
    window.open(str(tmp_path / "field.fits"), plugin="napari-issis")
    qtbot.waitUntil(lambda: scene_of(window) is not None, timeout=5000)
    scene = scene_of(window)
    scene.wait()
    assert scene.exposure == exposure
    assert np.array_equal(scene.counts.layer.data, exposure.counts)
    assert scene.layers == list(window.layers)
    assert not scene.editor.history.last_step


def test_over_a_scene_it_is_asked_first(window, tmp_path, qtbot, monkeypatch):
    """Catches a scene that is lost because a file was opened; undo brings its sources back."""
    simulate(few_sources()[:1], SMALL, seed=3).write(tmp_path / "one.fits")
    scene = open_scene(few_sources(), SMALL, viewer=window, dock=False)
    scene.wait()
    for answer, left in ((False, 4), (True, 1)):
        asked = []
        monkeypatch.setattr(
            exposure_layers, "may_replace", lambda n, a=asked, yes=answer: a.append(n) or yes
        )
        window.open(str(tmp_path / "one.fits"), plugin="napari-issis")
        qtbot.waitUntil(lambda a=asked: a == [4], timeout=5000)
        scene.wait()
        assert len(scene.sources) == left
        assert len(window.layers) == 3
    scene.undo()
    assert same_table(scene.sources, few_sources())


@pytest.mark.parametrize("roll", [0.0, 50.0])
def test_an_observation_lies_under_the_scene(window, tmp_path, roll):
    """Catches an image mirrored, turned the wrong way or shifted by a pixel: a star at a known
    place on the sky is where the frame has that place."""
    observation = SMALL.replace(pointing=POINTING, roll=roll)
    scene = open_scene(few_sources(), observation, viewer=window, dock=False)
    wcs = WCS(naxis=2)
    wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
    wcs.wcs.crval = [POINTING.ra.deg, POINTING.dec.deg]
    wcs.wcs.crpix = [21.0, 11.0]
    wcs.wcs.cdelt = [-0.1 / 3600, 0.1 / 3600]
    image = np.zeros((30, 40), dtype=np.float32)
    image[18, 27] = 100.0
    fits.PrimaryHDU(image, wcs.to_header()).writeto(tmp_path / "hst.fits")
    (layer,) = window.open(str(tmp_path / "hst.fits"), plugin="napari-issis")
    # 7 pixels right and 8 up of the reference pixel (20, 10): 0.7 arcsec west, 0.8 north
    north, east = 0.8, -0.7
    turn = np.radians(roll)
    up = north * np.cos(turn) + east * np.sin(turn)
    left = east * np.cos(turn) - north * np.sin(turn)
    y, x = layer.data_to_world((18, 27))
    assert y == pytest.approx(31.5 * 0.036 + up, abs=1e-3)
    assert x == pytest.approx(39.5 * 0.036 - left, abs=1e-3)
    assert [str(unit) for unit in layer.units] == [str(unit) for unit in scene.layers[0].units]
    assert scene.settled or scene.wait() is None


def test_any_other_image_opens_too(window, tmp_path):
    """Catches an image without coordinates, or of constants, that is refused."""
    fits.PrimaryHDU(np.full((5, 6), np.nan)).writeto(tmp_path / "plain.fits")
    (layer,) = window.open(str(tmp_path / "plain.fits"), plugin="napari-issis")
    assert layer.data.shape == (5, 6)


@pytest.mark.parametrize("suffix", ["ecsv", "vot", "fits"])
def test_a_catalogue_joins_the_scene(window, tmp_path, suffix):
    """Catches a catalogue that replaces the scene, or opens as a layer of its own."""
    path = tmp_path / f"sources.{suffix}"
    write_sources(few_sources()[:2], path)
    scene = open_scene(few_sources(), SMALL, viewer=window, dock=False)
    window.open(str(path), plugin="napari-issis")
    assert len(scene.sources) == 6
    assert len(window.layers) == 3
    assert f"2 source(s) added from {path}" in told()
    scene.undo()
    assert len(scene.sources) == 4


def test_what_was_understood_is_told(window, tmp_path):
    """Catches positions on the sky put elsewhere, and columns guessed in silence."""
    path = tmp_path / "sky.ecsv"
    place = POINTING.directional_offset_by(0 * u.deg, 0.36 * u.arcsec)
    path.write_text(
        "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: ra, unit: deg, datatype: float64}\n"
        "# - {name: dec, unit: deg, datatype: float64}\n# - {name: mag, datatype: float64}\n"
        f"ra dec mag\n{float(place.ra.deg)!r} {float(place.dec.deg)!r} 20.0\n"
    )
    scene = open_scene(observation=SMALL.replace(pointing=POINTING), viewer=window, dock=False)
    window.open(str(path), plugin="napari-issis")
    assert scene.sources["x"][0] == pytest.approx(39.5, abs=1e-4)
    assert scene.sources["y"][0] == pytest.approx(41.5, abs=1e-4)
    assert "mag" in told()


def test_a_broken_file_changes_nothing(window, tmp_path):
    """Catches a failed load that destroys layers."""
    scene = open_scene(few_sources(), SMALL, viewer=window, dock=False)
    scene.wait()
    path = tmp_path / "broken.fits"
    simulate(few_sources(), SMALL).write(path)
    path.write_bytes(path.read_bytes()[:4000])
    with pytest.raises((ValueError, OSError)):
        window.open(str(path), plugin="napari-issis")
    assert len(window.layers) == 3
    assert same_table(scene.sources, few_sources())


def test_files_of_others_are_left_alone():
    assert reader.get_reader("notes.txt") is None
    assert reader.get_reader("picture.png") is None
    assert reader.get_reader(["a.fits", "b.txt"]) is None
    assert reader.get_reader(["a.fits", "b.FITS.gz"]) is not None


# ---------------------------------------------------------------- pictures


@pytest.fixture
def menu(scene, qtbot, tmp_path, monkeypatch):
    menu = PngMenu(scene, None)
    qtbot.addWidget(menu)
    monkeypatch.setattr(menu, "ask_path", lambda name: str(tmp_path / name))
    return menu


def test_the_menu_writes_all_of_them(scene, menu, tmp_path):
    """Catches a picture that is upside down, in other limits, or RGBA data of what is shown."""
    scene.counts.scale = "log"
    scene.counts.set_limits((2.0, 50.0))
    scene.counts.layer.colormap = "viridis"
    for action in menu.actions():
        action.trigger()
    picture = Image.open(tmp_path / "image.png")
    assert picture.text["Scale"] == "log C"
    assert picture.text["Limits"] == "2 50"
    pixels = np.asarray(picture)[::-1]
    zoom = pixels.shape[1] // 80
    assert pixels.shape == (64 * zoom, 80 * zoom, 3)
    counts = scene.exposure.counts
    dark, bright = counts <= 2, counts >= 50
    small = pixels[::zoom, ::zoom]
    # the ends of viridis
    assert np.abs(small[dark].astype(int) - [68, 1, 84]).max() <= 2
    assert np.abs(small[bright].astype(int) - [253, 231, 37]).max() <= 2
    assert np.array_equal(read_rgba(tmp_path / "counts.png"), counts)
    model = np.asarray(Image.open(tmp_path / "sources.png").convert("RGB"))
    assert model.shape == pixels.shape
    assert model.any()
    both = np.asarray(Image.open(tmp_path / "both.png").convert("RGB"))
    assert np.array_equal(both[:, : model.shape[1]], model)
    assert np.array_equal(both[:, -model.shape[1] :], pixels[::-1])


def test_counts_too_large_for_colours(scene, menu, tmp_path):
    """Catches counts that wrap around in silence."""
    notification_manager.records.clear()
    scene.observation = SMALL.replace(exposure=1e9)
    scene.wait()
    menu.actions()[3].trigger()
    assert "16,777,215" in told() or "16777215" in told()
    assert not (tmp_path / "counts.png").exists()


# ---------------------------------------------------------------- after a crash


def test_a_scene_is_kept_while_it_is_edited(scene, qtbot, monkeypatch):
    """Catches a scene that is lost, a file per edit, and a file that stays behind."""
    monkeypatch.setattr(crash_guard, "DELAY", 50)
    guard = CrashGuard(scene)
    qtbot.addWidget(guard)
    assert guard.isHidden()
    scene.add(few_sources()[:1])
    scene.wait()
    qtbot.waitUntil(lambda: guard._file.path.exists(), timeout=5000)
    qtbot.waitUntil(lambda: not guard._jobs.busy, timeout=5000)
    kept = CrashedScene(guard._file.path, None).read()
    assert same_table(kept[0], scene.sources)
    assert kept[1:] == (scene.observation, scene.seed)
    # this process runs: nobody else is offered its scene
    assert crashed_scenes() == []
    guard.end()
    assert not guard._file.path.exists()


def test_what_a_crash_left_is_offered(scene, qtbot, monkeypatch):
    """Catches an offer that replaces the present scene, or comes again when it was taken."""
    observation = SMALL.replace(channel="FUV", exposure=7.0)
    file = Autosave()
    file.write(few_sources()[2:], observation, 5)
    monkeypatch.setattr(
        "napari_issis.autosave._alive", lambda path: path != file.path, raising=True
    )
    guard = CrashGuard(scene)
    parent = QWidget()
    qtbot.addWidget(parent)
    QVBoxLayout(parent).addWidget(guard)
    parent.show()
    assert guard.isVisible()
    assert "left by a crash" in guard.text.text()
    guard.restore.click()
    scene.wait()
    assert len(scene.sources) == 6
    assert (scene.observation, scene.seed) == (observation, 5)
    assert guard.isHidden()
    assert not file.path.exists()


def test_a_damaged_autosave_is_told(scene, qtbot, monkeypatch):
    """Catches a crash because of a crash."""
    notification_manager.records.clear()
    file = Autosave()
    file.path.write_bytes(b"nonsense")
    monkeypatch.setattr("napari_issis.autosave._alive", lambda path: False)
    guard = CrashGuard(scene)
    qtbot.addWidget(guard)
    guard.restore.click()
    assert told()
    assert len(scene.sources) == 4
    guard.forget.click()
    assert guard.isHidden()

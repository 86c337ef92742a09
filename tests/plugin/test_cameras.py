"""Another camera in the panel: choices, layers, and what is saved."""

import warnings

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import vstack
from small_scene import SMALL

import napari_issis as ni
from napari_issis.instruments import ISSIS
from napari_issis.plugin.instrument_form import LOAD, InstrumentForm
from napari_issis.plugin.side_by_side import FRAME_NAME, SideBySide
from napari_issis.plugin.writer import write_fits

pytestmark = pytest.mark.needs_gl


@pytest.fixture
def scene(make_napari_viewer):
    stars = ni.random_sources("point", 3, shape=SMALL.shape, seed=1)
    galaxies = ni.random_sources("exponential", 2, shape=SMALL.shape, seed=2)
    galaxies["r_half"] = [3.0, 4.0] * galaxies["r_half"].unit
    return ni.show(vstack([stars, galaxies]), SMALL, viewer=make_napari_viewer(), dock=False)


@pytest.fixture
def form(scene, qtbot):
    form = InstrumentForm(scene)
    qtbot.addWidget(form)
    form.resume()
    yield form
    form.pause()


def camera(scene, name):
    return ni.Observation(instrument=name).instrument


def test_the_panel_offers_what_the_camera_has(scene, form):
    scene.observation = scene.observation.replace(filters=("NF1", "open"), psf=None)
    form.camera.value = camera(scene, "ACS/SBC")
    observation = scene.observation
    assert (observation.instrument.name, observation.channel) == ("ACS/SBC", "FUV")
    assert observation.filters == ("open", "open")
    assert observation.shape == SMALL.shape
    assert list(form.channel.choices) == ["FUV"]
    assert list(form.wheel1.choices) == ["open", "F125LP", "F140LP", "F150LP", LOAD]
    assert (1024, 1024) in form.frame.choices
    assert (2048, 2048) not in form.frame.choices
    labels = [form.frame.native.itemText(i) for i in range(form.frame.native.count())]
    assert "1024 × 1024 (32.8″)" in labels
    assert "1700 Å" in form.channel.native.currentText()
    assert "FUV  1150–1700 Å" in form.channel.tooltip
    assert "ACS/SBC" in form.psf.text.text()
    assert "28 %" in form.psf.text.toolTip()
    form.camera.value = ISSIS
    assert list(form.channel.choices) == ["FUV", "NUV"]
    assert "NF1" in form.wheel1.choices


def test_a_camera_from_a_file(scene, form, tmp_path, monkeypatch):
    path = tmp_path / "mine.toml"
    path.write_text(
        "name = 'Mine'\n[channels.V]\n"
        "band = { value = [2000, 3000], unit = 'Angstrom', status = 'assumed', source = 'x' }\n"
        "pixel_scale = { value = 0.5, unit = 'arcsec / pix', status = 'assumed', source = 'x' }\n"
        "detector_size = { value = [64, 80], unit = 'pix', status = 'assumed', source = 'x' }\n"
        "diameter = { value = 0.2, unit = 'm', status = 'assumed', source = 'x' }\n"
        "effective_area = { value = [30], unit = 'cm2', status = 'assumed', source = 'x' }\n"
    )
    monkeypatch.setattr(form, "ask_camera_path", lambda: str(path))
    form.camera.value = LOAD
    assert scene.observation.instrument.name == "Mine"
    assert form.camera.native.currentText() == "Mine"
    assert scene.observation.channel == "V"

    told = []
    monkeypatch.setattr("napari_issis.plugin.instrument_form.show_error", told.append)
    path.write_text("name = 'Other'")
    before = scene.observation
    form.camera.value = LOAD
    assert scene.observation == before
    assert "mine.toml: there is no channel" in told[0]
    assert form.camera.native.currentText() == "Mine"

    form.loss.value = True
    assert "dead time of this camera's detector is not known" in told[1]
    assert not form.loss.value
    assert scene.observation.detector == ni.Detector()
    monkeypatch.setattr(form, "ask_camera_path", lambda: None)
    form.camera.value = LOAD
    assert scene.observation == before


def test_the_layers_follow_the_pixel_scale(scene, form, qtbot):
    """The picture is that of a fresh simulation; nothing of the sources moves in pixels."""
    before = scene.sources
    scene.wait()
    other = SideBySide(scene)
    other.enabled = True
    form.camera.value = camera(scene, "FCU")
    scene.wait()
    assert len(scene.layers) == 3
    for layer in scene.layers:
        np.testing.assert_allclose(layer.scale, (0.047, 0.047))
    frame = scene.viewer.layers[FRAME_NAME]
    np.testing.assert_allclose(frame.scale, 0.047 * np.array(SMALL.shape))
    np.testing.assert_allclose(frame.translate, 0.047 * (np.array(SMALL.shape) - 1) / 2)
    assert all((before[name] == scene.sources[name]).all() for name in ("x", "y", "flux"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ni.CountRateWarning)
        fresh = ni.simulate(scene.sources, scene.observation, seed=scene.seed)
    assert scene.exposure == fresh
    corner = scene.counts.layer.data_to_world(np.array(SMALL.shape) - 1)
    np.testing.assert_allclose(corner, 0.047 * (np.array(SMALL.shape) - 1))
    # layers that are made anew have it too
    scene.viewer.layers.remove(scene.editor.points.layer)
    scene.sources = before
    np.testing.assert_allclose(scene.editor.points.layer.scale, (0.047, 0.047))
    other.enabled = False


def test_the_writer_uses_the_cameras_pixels(scene, form, tmp_path, monkeypatch):
    """A layer of others, one arcsec a sample, lies with its corner on the frame's first pixel."""
    scene.observation = scene.observation.replace(instrument="FCU")
    layer = scene.viewer.add_image(np.ones((4, 5)), units=("arcsec", "arcsec"))
    monkeypatch.setattr("napari.current_viewer", lambda: scene.viewer)
    data, meta, _ = layer.as_layer_data_tuple()
    write_fits(str(tmp_path / "x.fits"), data, meta)
    header = fits.getheader(tmp_path / "x.fits")
    ny, nx = SMALL.shape
    # one sample is 1/0.047 pixels, and the frame's centre is at FITS pixel 1 + 0.047 (n - 1) / 2
    assert header["CRPIX1"] == pytest.approx(1 + 0.047 * (nx - 1) / 2)
    assert header["CRPIX2"] == pytest.approx(1 + 0.047 * (ny - 1) / 2)
    assert abs(header["CDELT1"] * header.get("PC1_1", 1)) == pytest.approx(1.0)


def test_an_exposure_of_another_camera_is_opened_at_its_scale(make_napari_viewer, tmp_path):
    observation = ni.Observation(instrument="FCU", shape=(20, 30))
    ni.simulate(ni.source("point", 9, 8), observation).write(tmp_path / "x.fits")
    viewer = make_napari_viewer()
    viewer.open(tmp_path / "x.fits", plugin="napari-issis")
    for layer in viewer.layers:
        np.testing.assert_allclose(layer.scale, (0.047, 0.047))

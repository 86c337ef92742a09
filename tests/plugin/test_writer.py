from __future__ import annotations

import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.wcs import WCS
from small_scene import SMALL, few_sources

from napari_issis import Exposure
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.writer import write_fits

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def save(layer, path):
    data, meta, _ = layer.as_layer_data_tuple()
    return write_fits(str(path), data, meta)


def test_our_image_is_saved_as_a_whole_exposure(scene, tmp_path):
    path = tmp_path / "a.fits"
    assert save(scene.counts.layer, path) == [str(path)]
    assert Exposure.read(path) == scene.exposure


def test_an_image_that_was_changed_is_saved_as_it_is(scene, tmp_path):
    """Catches an exposure written in the place of what the user sees."""
    layer = scene.counts.layer
    layer.data = layer.data * 2
    save(layer, tmp_path / "b.fits")
    with fits.open(tmp_path / "b.fits") as hdus:
        assert len(hdus) == 1
        assert np.array_equal(hdus[0].data, layer.data)


@pytest.mark.parametrize("dtype", [bool, np.uint16, np.int32, np.float16, np.float64])
def test_images_of_others_are_plain(viewer, tmp_path, dtype):
    layer = viewer.add_image(np.eye(7, 5).astype(dtype))
    save(layer, tmp_path / "c.fits")
    assert np.array_equal(fits.getdata(tmp_path / "c.fits"), np.eye(7, 5))


def test_what_fits_cannot_hold_is_refused(tmp_path):
    """Catches an existing file that is lost by an error."""
    path = tmp_path / "d.fits"
    path.write_text("mine")
    with pytest.raises(ValueError, match="complex128"):
        write_fits(str(path), np.ones((3, 3), complex), {"name": "c", "metadata": {}})
    assert path.read_text() == "mine"
    with pytest.raises(OSError, match="nowhere"):
        write_fits(str(tmp_path / "nowhere" / "e.fits"), np.ones((3, 3)), {"metadata": {}})


@pytest.mark.parametrize("roll", [0.0, 40.0])
def test_an_image_in_the_frame_is_saved_with_its_place_on_the_sky(
    scene, viewer, tmp_path, monkeypatch, roll
):
    """Catches coordinates left out, mirrored, turned the wrong way or off by a pixel: the pixel
    of a layer and the pixel of our image that lie on each other have one place on the sky."""
    monkeypatch.setattr("napari.current_viewer", lambda: viewer)
    pointing = SkyCoord("20h13m15s -60d30m10s")
    scene.observation = SMALL.replace(pointing=pointing, roll=roll)
    scene.wait()
    layer = viewer.add_image(
        np.ones((9, 7)),
        scale=(0.1, 0.05),
        translate=(0.7, 0.4),
        rotate=25,
        affine=[[1.0, 0.2, 0.3], [0.0, 1.1, 0.1], [0.0, 0.0, 1.0]],
        units=("arcsec", "arcsec"),
        metadata={"header": {"BUNIT": "ct/s"}},
    )
    save(layer, tmp_path / "laid.fits")
    save(scene.counts.layer, tmp_path / "ours.fits")
    header = fits.getheader(tmp_path / "laid.fits")
    assert header["BUNIT"] == "ct/s"
    theirs, ours = (WCS(fits.getheader(tmp_path / f"{name}.fits")) for name in ("laid", "ours"))
    for y, x in ((0, 0), (8, 0), (3.5, 6)):
        here = theirs.pixel_to_world(x, y)
        row, column = np.array(layer.data_to_world((y, x))) / 0.036
        assert here.separation(ours.pixel_to_world(column, row)).arcsec < 1e-6
    offset = WCS(header, key="A").wcs_pix2world([[3, 2]], 0)[0]
    up, right = np.array(layer.data_to_world((2, 3))) - 0.036 * np.array([31.5, 39.5])
    assert offset == pytest.approx([-right, up], abs=1e-9)


def test_an_image_in_a_frame_without_a_position_has_offsets(scene, viewer, tmp_path, monkeypatch):
    monkeypatch.setattr("napari.current_viewer", lambda: viewer)
    layer = viewer.add_image(np.ones((9, 7)), scale=(0.1, 0.05), units=("arcsec", "arcsec"))
    save(layer, tmp_path / "laid.fits")
    wcs = WCS(fits.getheader(tmp_path / "laid.fits"))
    assert wcs.wcs_pix2world([[0, 0]], 0)[0] == pytest.approx([39.5 * 0.036, -31.5 * 0.036])
    assert [str(unit) for unit in wcs.wcs.cunit] == ["arcsec", "arcsec"]
    other = viewer.add_image(np.ones((9, 7)))
    save(other, tmp_path / "apart.fits")
    assert "CTYPE1" not in fits.getheader(tmp_path / "apart.fits")


def test_pictures_and_several_resolutions(viewer, tmp_path):
    """Catches colours taken for columns, and a list of images that is refused."""
    colours = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    save(viewer.add_image(colours, rgb=True), tmp_path / "rgb.fits")
    assert np.array_equal(fits.getdata(tmp_path / "rgb.fits")[1], colours[..., 1])
    fine = np.arange(64.0).reshape(8, 8)
    save(viewer.add_image([fine, fine[::2, ::2]], multiscale=True), tmp_path / "fine.fits")
    assert np.array_equal(fits.getdata(tmp_path / "fine.fits"), fine)


@pytest.mark.parametrize("name", ["field", "field.v2"])
def test_a_name_without_suffix_gets_one(scene, viewer, tmp_path, name):
    """Catches names that are refused, and a file lost about which nobody was asked."""
    other = viewer.add_image(np.eye(3))
    for layer in (scene.counts.layer, other):
        path = tmp_path / f"{layer.name} {name}"
        assert save(layer, path) == [f"{path}.fits"]
        before = (tmp_path / f"{path.name}.fits").read_bytes()
        with pytest.raises(FileExistsError, match="exists already"):
            save(layer, path)
        assert (tmp_path / f"{path.name}.fits").read_bytes() == before
        save(layer, f"{path}.fits")


def test_layers_with_our_mark_become_a_scene(viewer, scene, tmp_path):
    """Catches marked layers (a sample's) that the next scene does not recognise."""
    from napari.components import ViewerModel

    other = ViewerModel()
    for layer in scene.layers:
        data, meta, kind = layer.as_layer_data_tuple()
        meta["name"] = "renamed"
        getattr(other, f"add_{kind}")(data, **meta)
    copy = open_scene(viewer=other, dock=False)
    assert copy.layers == list(other.layers)
    assert copy is not scene
    assert other.camera.orientation2d == ("up", "right")
    assert copy.observation == SMALL
    copy.wait()
    assert copy.exposure == scene.exposure
    assert len(copy.sources) == len(few_sources())
    other.layers.clear()

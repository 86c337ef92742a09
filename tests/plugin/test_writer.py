from __future__ import annotations

import numpy as np
import pytest
from astropy.io import fits
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

"""The built-in scenes, against the paper and CASTLES."""

import astropy.units as u
import numpy as np
import pytest

from napari_issis import Exposure, Observation, source
from napari_issis.catalogue import write_sources
from napari_issis.exposure import same_table
from napari_issis.fits_header import wcs_header
from napari_issis.scenes import SCENES, example_scene, load_scene
from napari_issis.sources import check_sources


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_is_whole_and_the_same_each_time(name):
    scene = example_scene(name)
    assert scene.name == name
    assert scene.title
    assert scene.note
    assert len(check_sources(scene.sources)) > 0
    assert same_table(scene.sources, example_scene(name).sources)


def test_blend_is_example_1():
    """Two exponential galaxies, F = 1e-14, R = 20, ellipticity 0.7, crossed at right angles."""
    scene = example_scene("blend")
    arrays = check_sources(scene.sources)
    assert list(arrays.kind) == ["exponential"] * 2
    assert arrays.pa.tolist() == [45, 135]
    values = np.array([arrays.x, arrays.y, arrays.flux, arrays.r_half, arrays.ellipticity])
    np.testing.assert_array_equal(values.T, [[256, 256, 1e-14, 20, 0.7]] * 2)
    assert scene.observation == Observation("NUV", ("open", "open"), 100.0, (512, 512))


@pytest.mark.parametrize(
    ("name", "kind", "number"), [("stars500", "point", 500), ("galaxies100", "exponential", 100)]
)
def test_random_scenes_have_the_papers_ranges(name, kind, number):
    arrays = check_sources(example_scene(name).sources)
    assert list(arrays.kind) == [kind] * number
    ranges = {"x": (-0.5, 511.5), "y": (-0.5, 511.5), "flux": (1e-15, 1e-14)}
    if kind != "point":
        ranges |= {"r_half": (10, 30), "ellipticity": (0, 0.8), "pa": (0, 180)}
    for column, (low, high) in ranges.items():
        values = getattr(arrays, column)
        assert low <= values.min() < low + 0.1 * (high - low)
        assert high - 0.1 * (high - low) < values.max() <= high


def test_q2237_lies_on_the_sky_as_castles_has_it():
    """Catches east drawn to the right, and offsets divided by a wrong pixel scale.

    The positions go through the WCS of the frame, not through the formula that placed them.
    """
    from astropy.wcs import WCS

    scene = example_scene("q2237")
    arrays = check_sources(scene.sources)
    assert list(arrays.kind) == ["point"] * 4 + ["devaucouleurs"]
    wcs = WCS(wcs_header(scene.observation))
    sky = wcs.pixel_to_world(arrays.x, arrays.y)
    centre = scene.observation.pointing
    assert centre.separation(sky[4]).arcsec == pytest.approx(0, abs=1e-6)
    assert (centre.ra.hms.h, centre.dec.dms.d) == (22, 3)
    # east and north of image A, arcsec
    castles = [(-0.673, 1.697), (0.635, 1.210), (-0.866, 0.528), (-0.075, 0.939)]
    for position, offset in zip(sky[1:], castles, strict=True):
        east, north = sky[0].spherical_offsets_to(position)
        np.testing.assert_allclose(
            [east.to_value(u.arcsec), north.to_value(u.arcsec)], offset, atol=1e-5
        )
    # the widest pair of images is A and B, 1.83 arcsec apart
    assert sky[0].separation(sky[1]).arcsec == pytest.approx(1.826, abs=1e-3)
    assert np.argsort(-arrays.flux[:4]).tolist() == [0, 2, 1, 3]


def test_unknown_scene():
    with pytest.raises(ValueError, match="no scene 'blnd'; known: blend, stars500, galaxies100"):
        example_scene("blnd")
    with pytest.raises(ValueError, match=r"no scene 'blnd'; known: .* or give a source table"):
        load_scene("blnd")


def test_load_scene_by_name():
    sources, observation = load_scene("q2237")
    assert same_table(sources, example_scene("q2237").sources)
    assert observation == example_scene("q2237").observation


def test_load_a_source_table(tmp_path):
    for ending in (".ecsv", ".fits", ".csv"):
        write_sources(source("point", 1, 2), tmp_path / f"t{ending}")
        sources, observation = load_scene(tmp_path / f"t{ending}")
        assert same_table(sources, source("point", 1, 2))
        assert observation == Observation()


def test_load_an_exposure_with_its_observation(tmp_path):
    """Catches an exposure opened as a mere catalogue, its instrument forgotten."""
    image = np.zeros((3, 4))
    observation = Observation("FUV", shape=(3, 4), exposure=7.0)
    Exposure(image.astype(int), image, source("point", 1, 2), observation, 0).write(
        tmp_path / "x.fits"
    )
    sources, loaded = load_scene(str(tmp_path / "x.fits"))
    assert loaded == observation
    assert same_table(sources, source("point", 1, 2))


def test_load_missing_or_odd_files(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.csv"):
        load_scene(tmp_path / "none.csv")
    (tmp_path / "scene.txt").write_text("hello")
    with pytest.raises(ValueError, match=r"scene\.txt is no source table"):
        load_scene(tmp_path / "scene.txt")

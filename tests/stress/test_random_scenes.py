"""The promised tolerance over random scenes: all kinds, PSFs and tolerances mixed."""

import numpy as np
import pytest
from plain_scene import CPS, PIXEL, psf_of, table_of
from random_scene import exact_rate, promised_error, random_scene

import napari_issis as ni
from napari_issis.render import painting


@pytest.mark.parametrize("fewest", [0.0, np.inf], ids=["compiled", "plain"])
def test_tolerance_is_kept(scene_seed, fewest, monkeypatch):
    """Catches a kernel cut too short, a coarse filter, a wrong bound where sources of very
    different brightness or size meet, an aperture that is refused."""
    monkeypatch.setattr(painting, "FEWEST_COMPILED", fewest)
    scene = random_scene(scene_seed)
    observation = ni.Observation(shape=scene.shape, psf=psf_of(*scene.psf))
    image = ni.count_rate(table_of(scene.sources), observation, tolerance=scene.tolerance)
    rng = np.random.default_rng(scene_seed)
    pixels = {tuple(int(i) for i in np.unravel_index(image.argmax(), image.shape))}
    pixels |= {tuple(int(rng.integers(n)) for n in scene.shape) for _ in range(3)}
    pixels = sorted(pixels)
    expected = CPS * exact_rate(scene, pixels, PIXEL).sum(axis=0)
    got = np.array([image[p] for p in pixels])
    allowed = promised_error(scene, image.max(), CPS, PIXEL)
    assert np.abs(got - expected).max() <= allowed, (scene, pixels)

"""No source, one, and a hundred thousand."""

import numpy as np
import pytest
from plain_scene import CPS, psf_of

import napari_issis as ni
from quadrature import pixel_share

SIGMA = 2.0 / np.sqrt(8 * np.log(2))


@pytest.mark.parametrize("count", [1, 100_000])
def test_stars(count):
    """Catches batches that lose their last rows, and errors that add up over many stars."""
    observation = ni.Observation(shape=(300, 277), psf=psf_of("gaussian", (2.0,)))
    stars = ni.random_sources(
        "point", count, shape=(300, 277), flux=(1e-20, 1e-14), flux_distribution="log", seed=8
    )
    image = ni.count_rate(stars, observation, tolerance=1e-7)
    x, y, flux = np.array(stars["x"]), np.array(stars["y"]), stars["flux"].value
    pixels = [(round(y[-1]) % 300, round(x[-1]) % 277), (0, 0), (299, 276), (151, 88)]
    pixels += [tuple(int(i) for i in np.unravel_index(image.argmax(), image.shape))]
    for py, px in pixels:
        expected = CPS * np.sum(flux * pixel_share(py - y, px - x, SIGMA))
        assert abs(image[py, px] - expected) <= 1e-7 * image.max()


def test_no_source_is_exactly_nothing_but_sky():
    """Catches a sky drawn from a rate with rounding in it, and a failure on empty columns."""
    observation = ni.Observation(shape=(13, 7), exposure=1e4)
    exposure = ni.simulate(ni.random_sources("point", 0), observation)
    assert np.all(exposure.expected == observation.sky_rate * 1e4)
    assert exposure.clipped == 0


def test_many_copies_are_one_bright_source():
    """Catches sources that are merged, or dropped as too faint beside the sum of the others."""
    observation = ni.Observation(shape=(20, 23), psf=psf_of("gaussian", (2.0,)))
    copies = ni.random_sources("point", 30_000, flux=(1e-20, 1e-20), seed=1)
    copies["x"], copies["y"] = 11.3, 9.6
    image = ni.count_rate(copies, observation, tolerance=1e-8)
    y, x = np.arange(20)[:, None] - 9.6, np.arange(23) - 11.3
    expected = 30_000 * 1e-20 * CPS * pixel_share(y, x, SIGMA)
    assert np.abs(image - expected).max() <= 1e-8 * expected.max()

"""Sources on corners, on edges and far outside; frames of any shape. Closed forms throughout."""

import moffat_star
import numpy as np
import pytest
from astropy.table import vstack
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import CPS, psf_of
from scipy import special

import napari_issis as ni

SIGMA_PER_FWHM = 1 / np.sqrt(8 * np.log(2))


def gaussian_image(shape, x, y, sigma_y, sigma_x):
    """Gaussian along the axes, integrated over every pixel, of unit flux."""
    sides = []
    for n, centre, sigma in ((shape[0], y, sigma_y), (shape[1], x, sigma_x)):
        d = np.abs(np.arange(n) - centre)
        scale = 1 / (np.sqrt(2) * sigma)
        sides.append(0.5 * (special.erfc((d - 0.5) * scale) - special.erfc((d + 0.5) * scale)))
    return np.outer(*sides)


@pytest.mark.parametrize("x", [-0.5, 0.0, 8.5, 12.0, 23.5])
@pytest.mark.parametrize("y", [-0.5, 5.5, 18.0, 18.5])
def test_stars_on_corners_and_edges(x, y):
    """Catches a star given to one of the pixels that share it, or lost at the frame's edge."""
    observation = ni.Observation(shape=(19, 24), psf=psf_of("gaussian", (0.8,)))
    image = ni.count_rate(ni.source("point", x, y, 1e-14), observation, tolerance=1e-9)
    sigma = 0.8 * SIGMA_PER_FWHM
    expected = 1e-14 * CPS * gaussian_image((19, 24), x, y, sigma, sigma)
    assert np.abs(image - expected).max() <= 1e-9 * expected.max()


@pytest.mark.parametrize(
    "shape",
    [(1, 1), (1, 2), (2, 1), (1, 300), (7, 2048), (2048, 7), (127, 211), (509, 13), (2, 4099)],
)
def test_frames_of_any_shape(shape):
    """Catches axes exchanged, sides rounded to a fast length, an error that grows with x.

    Two Gaussians along the axes and stars at both ends: the whole image in closed form.
    """
    ny, nx = shape
    fwhm = 2.2
    sigma = fwhm * SIGMA_PER_FWHM
    observation = ni.Observation(shape=shape, psf=psf_of("gaussian", (fwhm,)))
    rows, expected = [], np.zeros(shape)
    for x, y in ((0.2, 0.4), (nx - 1.3, ny - 0.9), (0.5 * nx, 0.5 * ny)):
        rows.append(ni.source("point", x, y, 1e-14))
        expected += gaussian_image(shape, x, y, sigma, sigma)
    for x, pa in ((0.8 * nx, 0.0), (0.1 * nx, 90.0)):
        rows.append(ni.source("gaussian", x, 0.3 * ny, 1e-14, 5.0, 0.6, pa))
        along = np.hypot(5.0 / np.sqrt(2 * np.log(2)), sigma)
        across = np.hypot(2.0 / np.sqrt(2 * np.log(2)), sigma)
        axes = (along, across) if pa == 0 else (across, along)
        expected += gaussian_image(shape, x, 0.3 * ny, *axes)
    image = ni.count_rate(vstack(rows), observation, tolerance=1e-8)
    assert image.shape == shape
    assert np.abs(image - 1e-14 * CPS * expected).max() <= 1e-8 * image.max()


def test_long_frame_through_a_moffat():
    """Catches wings cut or wrapped along the frame's long side: a star at one end of 2048."""
    observation = ni.Observation(shape=(7, 2048), psf=psf_of("moffat", (20.0, 1.3)))
    table = ni.source("point", 3.4, 2.7, 1e-14)
    image = ni.count_rate(table, observation, tolerance=1e-9)
    for y, x in [(3, 3), (0, 40), (6, 300), (3, 1024), (6, 2047)]:
        expected = 1e-14 * CPS * moffat_star.rate(y - 2.7, x - 3.4, 20.0, 1.3)
        assert abs(image[y, x] - expected) <= 1e-9 * image.max()


@given(st.floats(0, 360), st.floats(2, 6), st.sampled_from(["point", "exponential", "uniform"]))
def test_a_bright_source_far_outside(angle, log_distance, kind):
    """Catches light wrapped around the frame, positions rounded in single precision.

    The brightest source sends nothing, the faint star in the frame is as if alone; the
    documented floor is 1e-14 of the bright one's peak, here 1e-8 of the faint one's.
    """
    fwhm = 2.0
    sigma = fwhm * SIGMA_PER_FWHM
    distance = 10**log_distance
    far_x = 10 + distance * np.cos(np.radians(angle))
    far_y = 10 + distance * np.sin(np.radians(angle))
    observation = ni.Observation(shape=(21, 21), psf=psf_of("gaussian", (fwhm,)))
    table = vstack(
        [ni.source(kind, far_x, far_y, 1e-8, 0.5, 0.3, 10.0), ni.source("point", 9.7, 10.2, 1e-14)]
    )
    image = ni.count_rate(table, observation, tolerance=1e-7)
    # an exponential of 0.5 pixel falls by exp(-330) on the way, a disc ends
    expected = 1e-14 * CPS * gaussian_image((21, 21), 9.7, 10.2, sigma, sigma)
    assert np.abs(image - expected).max() <= 1e-7 * expected.max()


@pytest.mark.parametrize("distance", [1e3, 1e4, 1e5])
def test_the_wing_of_a_star_far_outside(distance):
    """Catches a wing cut at some distance: only it is in the frame, above the floor of 1e-14."""
    observation = ni.Observation(shape=(5, 6), psf=psf_of("moffat", (20.0, 1.3)))
    image = ni.count_rate(ni.source("point", -distance, 2.3, 1e-10), observation, tolerance=1e-4)
    peak = moffat_star.rate(0, 0, 20.0, 1.3)
    for y, x in [(0, 0), (4, 5)]:
        expected = moffat_star.rate(y - 2.3, x + distance, 20.0, 1.3)
        error = abs(image[y, x] / (1e-10 * CPS) - expected)
        assert error <= max(1e-4 * image.max() / (1e-10 * CPS), 1e-14 * peak)


@pytest.mark.parametrize("shift", [2.0**-20, 1e-5])
def test_a_small_step_moves_the_light(shift):
    """Catches positions rounded to a table's step: the derivative in closed form, to 1 %."""
    observation = ni.Observation(shape=(15, 15), psf=psf_of("gaussian", (2.0,)))
    sigma = 2.0 * SIGMA_PER_FWHM
    before, after = (
        ni.count_rate(ni.source("point", x, 7.2, 1e-14), observation, tolerance=1e-10)
        for x in (7.3, 7.3 + shift)
    )
    first, second = (gaussian_image((15, 15), x, 7.2, sigma, sigma) for x in (7.3, 7.3 + shift))
    moved = 1e-14 * CPS * (second - first)
    assert np.abs(after - before - moved).max() <= 2e-10 * before.max()
    assert np.abs(moved).max() > 100 * 2e-10 * before.max()

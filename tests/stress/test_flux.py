"""Light inside the frame plus light outside it is the source's light."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import CPS, psf_of
from scipy import special

import napari_issis as ni

SIGMA = 2.0 / np.sqrt(8 * np.log(2))


def share(n, centre, sigma):
    """Share of a Gaussian between -0.5 and n - 0.5."""
    return special.ndtr((n - 0.5 - centre) / sigma) - special.ndtr((-0.5 - centre) / sigma)


@given(
    st.integers(1, 60),
    st.integers(1, 60),
    st.floats(-5, 65),
    st.floats(-5, 65),
    st.floats(-3, 2),
    st.floats(0, 0.9),
    st.sampled_from([0.0, 90.0, 180.0, -90.0]),
)
def test_light_in_the_frame(ny, nx, x, y, log_r, ellipticity, pa):
    """Catches flux lost at the frame's edge or brought back from beyond it: closed form.

    A Gaussian along the axes; the error of the sum is at most that of its pixels together.
    """
    observation = ni.Observation(shape=(ny, nx), psf=psf_of("gaussian", (2.0,)))
    table = ni.source("gaussian", x, y, 1e-14, 10**log_r, ellipticity, pa)
    image = ni.count_rate(table, observation, tolerance=1e-8)
    one = 10**log_r / np.sqrt(2 * np.log(2))
    along, across = np.hypot(one, SIGMA), np.hypot(one * (1 - ellipticity), SIGMA)
    if pa in (90.0, -90.0):
        along, across = across, along
    expected = 1e-14 * CPS * share(ny, y, along) * share(nx, x, across)
    peak = 1e-14 * CPS / (2 * np.pi * along * across)
    assert abs(image.sum() - expected) <= ny * nx * max(1e-8 * image.max(), 1e-14 * peak)


@pytest.mark.parametrize("kind", ["point", "uniform", "exponential"])
@pytest.mark.parametrize("psf", [("gaussian", (0.4,)), ("moffat", (2.0, 4.0))], ids=lambda p: p[0])
def test_all_light_arrives_in_a_large_frame(kind, psf):
    """Catches a profile or PSF normalised where it is cut: 1e-12 of this Moffat is outside."""
    observation = ni.Observation(shape=(401, 401), psf=psf_of(*psf))
    table = ni.source(kind, 200.2, 199.7, 1e-14, 3.0, 0.4, 30.0)
    image = ni.count_rate(table, observation, tolerance=1e-9)
    assert abs(image.sum() - 1e-14 * CPS) <= 401**2 * 1e-9 * image.max()


@pytest.mark.parametrize("kind", ["uniform", "exponential", "devaucouleurs"])
def test_four_frames_make_one(kind):
    """Catches light counted twice or not at all where two frames meet: tiles of one field."""
    psf = psf_of("moffat", (2.5, 2.2))
    table = ni.source(kind, 30.4, 29.1, 1e-14, 9.0, 0.6, 40.0)
    whole = ni.count_rate(table, ni.Observation(shape=(60, 64), psf=psf), tolerance=1e-8)
    tiles = np.zeros((60, 64))
    for top in (0, 30):
        for left in (0, 32):
            part = table.copy()
            part["x"] -= left
            part["y"] -= top
            image = ni.count_rate(part, ni.Observation(shape=(30, 32), psf=psf), tolerance=1e-8)
            tiles[top : top + 30, left : left + 32] = image
    assert np.abs(tiles - whole).max() <= 2e-8 * whole.max()

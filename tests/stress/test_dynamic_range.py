"""Faint stars beside and far from one up to 1e12 times brighter, with `simulate` as it stands.

The exact image is the sum of both stars: closed form through a Gaussian PSF. The default
promise: the error of the rate is below 1 % of the sky in every pixel, but not below 1e-10 of
the image's peak. Where that floor is below 1 % of the sky, or of a pixel's Poisson noise, the
faint star's own light is right wherever it could be seen.
"""

import fourier_quadrature
import numpy as np
import pytest
from astropy.table import vstack
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import CPS, PIXEL, psf_of

import napari_issis as ni
from quadrature import pixel_share

SHAPE = (96, 101)
FWHM = 2.5
SIGMA = FWHM / np.sqrt(8 * np.log(2))
BRIGHT_AT = (20.3, 15.8)
SKY = 3.5e-4

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.limits.CountRateWarning")


def star_rate(flux, y, x):
    dy, dx = np.arange(SHAPE[0])[:, None] - y, np.arange(SHAPE[1]) - x
    return flux * CPS * pixel_share(dy, dx, SIGMA)


def scene(bright, faint, distance, angle):
    y = BRIGHT_AT[0] + distance * np.sin(angle)
    x = BRIGHT_AT[1] + distance * np.cos(angle)
    table = vstack([ni.source("point", *BRIGHT_AT[::-1], bright), ni.source("point", x, y, faint)])
    return table, star_rate(bright, *BRIGHT_AT), star_rate(faint, y, x)


@given(st.floats(-25, -5), st.floats(-12, 0), st.floats(1, 80), st.floats(0, np.pi / 2))
def test_the_default_promise(log_bright, log_ratio, distance, angle):
    """Catches a tolerance that is not tightened, or a tightening that goes by the wrong peak."""
    bright = 10**log_bright
    table, of_bright, of_faint = scene(bright, max(bright * 10**log_ratio, 1e-25), distance, angle)
    observation = ni.Observation(shape=SHAPE, psf=psf_of("gaussian", (FWHM,)), exposure=1.0)
    rate = ni.simulate(table, observation).expected - SKY
    expected = of_bright + of_faint
    # the subtraction of the sky rounds
    allowed = max(0.01 * SKY, 1e-12 * expected.max()) + 1e-13 * SKY
    assert np.abs(rate - expected).max() <= allowed


BEYOND = pytest.mark.xfail(reason="1e-12 of the peak, the documented floor, exceeds 1 % of the sky")


@pytest.mark.parametrize("distance", [4.0, 8.0, 20.0, 60.0])
@pytest.mark.parametrize(
    "bright",
    [1e-14, 1e-12, 1e-10, 1e-8, pytest.param(1e-6, marks=BEYOND)],
)
def test_a_faint_star_wherever_it_could_be_seen(bright, distance):
    """Catches light of the faint star lost in the bright one's rendering error.

    The faint star is 1e12 times fainter, or as faint as one signal-to-noise ratio of 1 in its
    brightest pixel in 1e5 s asks for, whichever is brighter. Its own light is the image less
    the exact bright star's; it is right to 1 % of the sky or of a pixel's Poisson noise.
    """
    exposure_time = 1e5
    peak = star_rate(1.0, 48, 50).max()
    there = star_rate(bright, *BRIGHT_AT)[
        tuple(np.round(np.array(BRIGHT_AT) + distance / np.sqrt(2)).astype(int))
    ]
    seen = np.sqrt((there + SKY) / exposure_time) / peak
    table, of_bright, of_faint = scene(bright, max(1e-12 * bright, seen), distance, np.pi / 4)
    # the rate does not depend on the exposure; at 1 s no pixel exceeds 1e15 counts
    observation = ni.Observation(shape=SHAPE, psf=psf_of("gaussian", (FWHM,)), exposure=1.0)
    own = ni.simulate(table, observation).expected - SKY - of_bright
    noise = np.sqrt((of_bright + of_faint + SKY) / exposure_time)
    # double precision itself: the bright star's own pixels hold no more digits
    allowed = 0.01 * np.maximum(SKY, noise) + 4e-16 * of_bright
    excess = np.abs(own - of_faint) / allowed
    where = np.unravel_index(excess.argmax(), SHAPE)
    assert excess.max() <= 1, f"{excess.max():.3g} times too much at {where}"


@pytest.mark.parametrize("flux", [1e-14, 1e-11])
def test_the_default_promise_through_the_channels_own_psf(flux):
    """Catches wings of the real PSF cut where they still exceed 1 % of the sky."""
    observation = ni.Observation(shape=SHAPE, exposure=1.0)
    y, x = BRIGHT_AT
    rate = ni.simulate(ni.source("point", x, y, flux), observation).expected - observation.sky_rate
    pixels = [(20, 16), (26, 10), (50, 16), (0, 60), (95, 100)]
    system = fourier_quadrature.telescope(1.7, 0.33, 1850.0, 3200.0, 0.0888, PIXEL)
    star = ("point", x, y, 0.0, 0.0, 0.0, 1.0)
    expected = flux * CPS * fourier_quadrature.rate(star, pixels, system)
    got = np.array([rate[p] for p in pixels])
    allowed = max(0.01 * SKY, 1e-12 * expected.max()) + 1e-13 * SKY
    assert np.abs(got - expected).max() <= allowed

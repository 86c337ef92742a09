"""Forecasts where they are hard: confused stars, no sky, image PSFs, many sources."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from scipy import special

import napari_issis as ni
from napari_issis import fisher
from test_forecast import FWHM, SCALE, SHAPE, SIGMA, SKY, errors, observation, star_image, table

PIXELS = FWHM / SCALE


def exact_slopes(stars) -> np.ndarray:
    """Derivatives of pixel integrals of Gaussian stars by rate, x and y, in closed form."""

    def along(centre, n):
        edges = np.arange(n + 1) - 0.5 - centre
        value = np.diff(0.5 * special.erf(edges / (np.sqrt(2) * SIGMA)))
        density = np.exp(-(edges**2) / (2 * SIGMA**2)) / (np.sqrt(2 * np.pi) * SIGMA)
        return value, -np.diff(density)

    result = []
    for rate, x, y in stars:
        (vx, sx), (vy, sy) = along(x, SHAPE[1]), along(y, SHAPE[0])
        result += [np.outer(vy, vx), rate * np.outer(vy, sx), rate * np.outer(sy, vx)]
    return np.array([each.ravel() for each in result])


def exact_errors(stars, sky=SKY, exposure=100.0) -> np.ndarray:
    slopes = exact_slopes(stars)
    mean = (sum(star_image(*one) for one in stars) + sky).ravel()
    # pixels without light and sky tell nothing
    seen = mean > 1e-12 * mean.max()
    slopes, mean = slopes[:, seen], mean[seen]
    information = exposure * (slopes / mean) @ slopes.T
    norm = np.sqrt(np.diag(information))
    return np.sqrt(np.diag(np.linalg.inv(information / norm / norm[:, None]))) / norm


CONFUSED = {
    "a tenth of a FWHM": [(400.0, 17.5, 15.4), (300.0, 17.5 + 0.1 * PIXELS, 15.4)],
    "a faint one in the core": [(900.0, 17.5, 15.4), (0.9, 17.5 + 0.2 * PIXELS, 15.6)],
    "three in a FWHM": [
        (400.0, 17.5, 15.4),
        (30.0, 17.5 + 0.4 * PIXELS, 15.3),
        (3.0, 17.6, 15.4 + 0.4 * PIXELS),
    ],
}


@pytest.mark.parametrize("name", CONFUSED)
def test_confused_stars(name):
    """Catches a singular combination that is none, and rounding taken for information."""
    stars = CONFUSED[name]
    np.testing.assert_allclose(errors(stars), exact_errors(stars), rtol=3e-3)


def moffat_errors(stars, shape, beta=1.5, exposure=100.0) -> np.ndarray:
    """Errors under a Moffat PSF, pixels integrated by 8 x 8 Gauss nodes."""
    a = PIXELS / 2 / np.sqrt(2 ** (1 / beta) - 1)
    node, weight = np.polynomial.legendre.leggauss(8)
    slopes, mean = [], np.full(shape, SKY)
    for rate, x, y in stars:
        own = np.zeros((3, *shape))
        for p, wp in zip(node / 2, weight / 2, strict=True):
            for q, wq in zip(node / 2, weight / 2, strict=True):
                dy, dx = np.arange(shape[0])[:, None] + p - y, np.arange(shape[1]) + q - x
                base = 1 + (dx**2 + dy**2) / a**2
                value = wp * wq * (beta - 1) / (np.pi * a**2) * base**-beta
                slope = rate * value * 2 * beta / a**2 / base
                own += np.stack([value, slope * dx, slope * dy])
        mean += rate * own[0]
        slopes += [each.ravel() for each in own]
    slopes = np.array(slopes)
    information = exposure * (slopes / mean.ravel()) @ slopes.T
    norm = np.sqrt(np.diag(information))
    return np.sqrt(np.diag(np.linalg.inv(information / norm / norm[:, None]))) / norm


@pytest.mark.parametrize("separation", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("ratio", [1.0, 1e-3])
def test_stars_with_wide_wings(separation, ratio):
    """Catches windows whose edges tell apart what the stars' light does not.

    With windows cut sharply, each at its own star's flux, errors were up to 98 % too small.
    """
    shape = (141, 151)
    stars = [(9000.0, 74.7, 70.4), (9000.0 * ratio, 74.7 + separation * PIXELS, 70.6)]
    where = observation(psf=ni.MoffatPSF(FWHM, 1.5), shape=shape)
    result = ni.forecast(table(stars), where)
    found = [result["flux_error"].value * where.cps_per_flux]
    found += [result["x_error"].value, result["y_error"].value]
    expected = moffat_errors(stars, shape)
    np.testing.assert_allclose(np.stack(found, axis=1).ravel(), expected, rtol=2e-2)


def test_galaxy_wider_than_the_frame():
    """Catches light from beyond the window that wraps into it.

    The own pixels are of an elliptical Gaussian under a Gaussian PSF, of which the frame shows
    the inner part; errors of flux and size were tens of per cent too small.
    """
    truth = np.array([300.0, 18.2, 15.4, 18.0, 0.3, 30.0])

    def image(p):
        rate, x, y, r_half, ellipticity, pa = p
        own = r_half / 1.1774100225154747
        along = np.array([-np.sin(np.radians(pa)), np.cos(np.radians(pa))])
        across = np.array([along[1], -along[0]])
        wide = (SIGMA**2 + 1 / 12) * np.eye(2) + own**2 * (
            np.outer(along, along) + (1 - ellipticity) ** 2 * np.outer(across, across)
        )
        yy, xx = np.indices(SHAPE)
        d = np.stack([xx - x, yy - y], axis=-1)
        q = np.einsum("...i,ij,...j", d, np.linalg.inv(wide), d)
        return rate * np.exp(-q / 2) / (2 * np.pi * np.sqrt(np.linalg.det(wide)))

    slopes = []
    for i, step in enumerate([0.1, 1e-3, 1e-3, 1e-3, 1e-4, 1e-2]):
        shift = np.eye(6)[i] * step
        slopes.append(((image(truth + shift) - image(truth - shift)) / (2 * step)).ravel())
    slopes = np.array(slopes)
    expected = np.linalg.inv(100.0 * (slopes / (image(truth) + SKY).ravel()) @ slopes.T)
    rate, x, y, *structure = truth
    one = ni.source("gaussian", x, y, rate / observation().cps_per_flux, *structure)
    result = ni.forecast(one, observation())[0]
    found = [result["flux_error"].value * observation().cps_per_flux]
    found += [result[f"{name}_error"].value for name in ("x", "y", "r_half")]
    found += [result["ellipticity_error"], result["pa_error"].value]
    np.testing.assert_allclose(found, np.sqrt(np.diag(expected)), rtol=2e-3)


def test_no_sky():
    """Catches dark pixels that tell too much or nothing: an error is the root of the counts."""
    stars = [(200.0, 18.2, 15.4)]
    where = observation(background=0.0)
    found = ni.forecast(table(stars), where)[0]
    assert found["snr"] == pytest.approx(np.sqrt(200.0 * 100.0), rel=2e-3)
    pair = [(200.0, 16.5, 15.4), (0.5, 16.5 + 1.5 * PIXELS, 15.9)]
    result = ni.forecast(table(pair), where)
    expected = exact_errors(pair, sky=0.0)
    rate = result["flux_error"].value * where.cps_per_flux
    np.testing.assert_allclose(rate, expected[[0, 3]], rtol=4e-3)
    np.testing.assert_allclose(result["x_error"].value, expected[[1, 4]], rtol=4e-3)


@pytest.mark.parametrize("includes_pixel", [False, True])
def test_image_psf(includes_pixel):
    """Catches an image PSF's derivatives of a wrong sign or shift, and its ringing cut off.

    Of the samples of a Gaussian the sinc interpolation is that Gaussian; as integrated by the
    pixel it is the pixel integrals of `star_image`.
    """
    n, step = 41, SCALE / 2
    offset = (np.arange(n) - (n - 1) / 2) * step / SCALE
    line = np.exp(-(offset**2) / (2 * SIGMA**2))
    if includes_pixel:
        edge = np.sqrt(2) * SIGMA
        line = special.erf((offset + 0.5) / edge) - special.erf((offset - 0.5) / edge)
    psf = ni.ImagePSF(np.outer(line, line), step, includes_pixel=includes_pixel)
    stars = [(200.0, 16.5, 15.4), (120.0, 16.5 + PIXELS, 15.9)]
    where = observation(psf=psf)
    result = ni.forecast(table(stars), where)
    found = [result["flux_error"].value * where.cps_per_flux]
    found += [result["x_error"].value, result["y_error"].value]
    np.testing.assert_allclose(np.stack(found, axis=1).ravel(), exact_errors(stars), rtol=3e-3)


def test_coincident_stars_leave_their_neighbour_its_errors():
    """Catches an infinite error that spreads.

    Two stars at one place span the same images as one with the flux of both: what is known of
    a third one, half a FWHM away, is the same.
    """
    third = (150.0, 16.0 + 0.5 * PIXELS, 15.7)
    twins = [(200.0, 16.0, 15.0), (200.0, 16.0, 15.0), third]
    single = [(400.0, 16.0, 15.0), third]
    found, expected = errors(twins), exact_errors(single)
    assert np.all(np.isinf(found[:6]))
    np.testing.assert_allclose(found[6:], expected[3:], rtol=3e-3)


def test_parts_of_a_large_scene_are_inverted_apart(monkeypatch):
    """Catches parts that forget what surrounds them, and rows that are mixed up."""
    stars = ni.random_sources("point", 180, shape=(96, 96), flux=(1e-17, 1e-15), seed=3)
    galaxies = ni.random_sources("exponential", 6, shape=(96, 96), r_half=(3, 9), seed=4)
    scene = vstack([galaxies, stars])
    where = ni.Observation(shape=(96, 96), exposure=1000)
    whole = ni.forecast(scene, where)
    monkeypatch.setattr(fisher, "MOST", 40)
    parts = ni.forecast(scene, where)
    for name in ("flux_error", "x_error", "y_error", "r_half_error", "pa_error"):
        np.testing.assert_allclose(parts[name].value, whole[name].value, rtol=1e-3)
    np.testing.assert_allclose(parts["flux_correlation"], whole["flux_correlation"], atol=2e-3)
    clear = np.abs(whole["flux_correlation"]) > 0.05
    np.testing.assert_array_equal(parts["neighbour"][clear], whole["neighbour"][clear])

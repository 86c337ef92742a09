"""Forecast errors against fits to simulated exposures and against a pixel model of our own."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from scipy import optimize, special, stats

import napari_issis as ni

SCALE = 0.036
FWHM = 0.1
SIGMA = FWHM / SCALE / 2.3548200450309493
SKY = 0.02
SHAPE = (31, 37)
FALSE_ALARM = 1e-6


def star_image(rate: float, x: float, y: float) -> np.ndarray:
    """Pixel integrals of a Gaussian star, from the error function."""

    def along(centre, n):
        edges = np.arange(n + 1) - 0.5 - centre
        return np.diff(0.5 * special.erf(edges / (np.sqrt(2) * SIGMA)))

    return rate * np.outer(along(y, SHAPE[0]), along(x, SHAPE[1]))


def model(parameters: np.ndarray) -> np.ndarray:
    return sum(star_image(*one) for one in parameters.reshape(-1, 3)) + SKY


def derivatives(parameters: np.ndarray) -> np.ndarray:
    result = []
    for one in parameters.reshape(-1, 3):
        for shift in np.diag([0.05, 1e-4, 1e-4]):
            change = star_image(*(one + shift)) - star_image(*(one - shift))
            result.append(change.ravel() / (2 * shift.sum()))
    return np.array(result)


def observation(**changes) -> ni.Observation:
    return ni.Observation(psf=ni.GaussianPSF(FWHM), background=SKY, shape=SHAPE).replace(**changes)


def table(stars):
    per_flux = observation().cps_per_flux
    return vstack([ni.source("point", x, y, rate / per_flux) for rate, x, y in stars])


def errors(stars, exposure=100.0):
    """Errors of rate, x, y of each star, in that order, shape (3 n,)."""
    result = ni.forecast(table(stars), observation(exposure=exposure))
    rate = result["flux_error"].value * observation().cps_per_flux
    return np.stack([rate, result["x_error"].value, result["y_error"].value], axis=1).ravel()


SCENES = {
    "isolated": [(200.0, 18.2, 15.4)],
    "half a FWHM": [(400.0, 17.5, 15.4), (300.0, 17.5 + 0.5 * FWHM / SCALE, 15.4)],
    "one FWHM": [(200.0, 16.5, 15.4), (120.0, 16.5 + FWHM / SCALE, 15.9)],
    "five FWHM": [(200.0, 11.0, 15.4), (20.0, 11.0 + 5 * FWHM / SCALE, 15.1)],
    "four": [(90.0, 18.0, 19.3), (80.0, 18.4, 11.5), (60.0, 13.9, 15.4), (30.0, 21.6, 16.2)],
}


@pytest.mark.parametrize("name", SCENES)
def test_information_of_own_pixels(name):
    """Catches a wrong derivative, scale or sign, a lost neighbour and lost pixels of a window."""
    truth = np.array(SCENES[name]).ravel()
    slopes = derivatives(truth)
    information = 100.0 * (slopes / model(truth).ravel()) @ slopes.T
    np.testing.assert_allclose(
        errors(SCENES[name]), np.sqrt(np.diag(np.linalg.inv(information))), rtol=2e-3
    )


@pytest.mark.parametrize("name", SCENES)
def test_fits_scatter_as_forecast(name):
    """Catches errors that are no standard deviations of maximum-likelihood fits.

    500 exposures; the scatter's square over the forecast's follows chi squared with 499
    degrees of freedom. All parameters together raise a false alarm once in 10^6.
    """
    stars, exposure = SCENES[name], 100.0
    truth = np.array(stars).ravel()
    forecast = errors(stars, exposure)
    rng = np.random.default_rng(7)
    fits = []
    for _ in range(500):
        counts = rng.poisson(model(truth) * exposure).ravel()

        def residual(scaled, counts=counts):
            """Signed roots of the Poisson deviance, whose squares add up to -2 ln L."""
            mean = np.maximum(model(truth + scaled * forecast).ravel() * exposure, 1e-9)
            half = mean - counts + special.xlogy(counts, np.maximum(counts, 1) / mean)
            return np.sign(mean - counts) * np.sqrt(2 * np.maximum(half, 0.0))

        # Fisher scoring: the slope of the root deviance is that of mean / sqrt(mean)
        def slope(scaled):
            point = truth + scaled * forecast
            mean = np.maximum(model(point).ravel(), 1e-9)
            return (derivatives(point) * forecast[:, None] * np.sqrt(exposure / mean)).T

        start = np.zeros(truth.size)
        for _ in range(3):
            jacobian = slope(start)
            mean = model(truth + start * forecast).ravel() * exposure
            pull = (counts - mean) / np.sqrt(mean)
            start = start + np.linalg.solve(jacobian.T @ jacobian, jacobian.T @ pull)
        fits.append(start)
        if len(fits) <= 2:
            best = optimize.minimize(lambda p: np.sum(residual(p) ** 2), start, method="BFGS")
            np.testing.assert_allclose(best.x, start, atol=5e-3)
    ratio = np.var(fits, axis=0, ddof=1)
    alarm = FALSE_ALARM / truth.size / 2
    low, high = stats.chi2.ppf([alarm, 1 - alarm], 499) / 499
    assert np.all((ratio > low) & (ratio < high)), ratio


def test_shape_errors_of_a_gaussian():
    """Catches a wrong derivative by r_half, ellipticity or pa, and degrees taken as radians."""
    r_half, ellipticity, pa, rate = 4.0, 0.4, 30.0, 300.0
    shape = (61, 61)

    def image(p):
        rate, x, y, r, e, angle = p
        # the convolved Gaussian, integrated over pixels by 5 x 5 Gauss nodes
        node, weight = np.polynomial.legendre.leggauss(5)
        own = r / 1.1774100225154747
        along = np.array([-np.sin(np.radians(angle)), np.cos(np.radians(angle))])
        across = np.array([along[1], -along[0]])
        matrix = SIGMA**2 * np.eye(2) + own**2 * (
            np.outer(along, along) + (1 - e) ** 2 * np.outer(across, across)
        )
        inverse, determinant = np.linalg.inv(matrix), np.linalg.det(matrix)
        result = np.zeros(shape)
        yy, xx = np.indices(shape)
        for a, wa in zip(node, weight, strict=True):
            for b, wb in zip(node, weight, strict=True):
                dx, dy = xx + a / 2 - x, yy + b / 2 - y
                q = inverse[0, 0] * dx**2 + 2 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy**2
                result += wa * wb / 4 * np.exp(-q / 2)
        return rate * result / (2 * np.pi * np.sqrt(determinant))

    truth = np.array([rate, 30.2, 29.7, r_half, ellipticity, pa])
    slopes = []
    for i, step in enumerate([0.1, 1e-3, 1e-3, 1e-3, 1e-4, 1e-2]):
        shift = np.eye(6)[i] * step
        slopes.append(((image(truth + shift) - image(truth - shift)) / (2 * step)).ravel())
    slopes = np.array(slopes)
    expected = np.linalg.inv(100.0 * (slopes / (image(truth) + SKY).ravel()) @ slopes.T)
    where = observation(shape=shape)
    one = ni.source("gaussian", 30.2, 29.7, rate / where.cps_per_flux, r_half, ellipticity, pa)
    result = ni.forecast(one, where)[0]
    found = [
        result["flux_error"].value * where.cps_per_flux,
        result["x_error"].value,
        result["y_error"].value,
        result["r_half_error"].value,
        result["ellipticity_error"],
        result["pa_error"].value,
    ]
    np.testing.assert_allclose(found, np.sqrt(np.diag(expected)), rtol=2e-3)


def test_what_cannot_be_measured_is_infinite_and_spreads_no_nan():
    """Catches a singular matrix that crashes or that spoils the errors of other sources."""
    stars = [(200.0, 8.0, 15.0), (200.0, 8.0, 15.0), (200.0, 28.0, 15.0), (0.0, 20.0, 25.0)]
    stars.append((200.0, 5000.0, 15.0))
    result = ni.forecast(table(stars), observation())
    for name in ("flux_error", "x_error", "y_error"):
        assert np.all(np.isinf(result[name][[0, 1, 4]]))
        assert np.isfinite(result[name][2])
    assert np.isfinite(result["flux_error"][3])
    assert np.isinf(result["x_error"][3])
    assert list(result["snr"][[0, 1, 3, 4]]) == [0, 0, 0, 0]
    assert list(result["neighbour"][:2]) == [1, 0]
    assert result["flux_correlation"][0] == pytest.approx(-1)
    assert not np.isnan(result["flux_correlation"]).any()
    assert result["neighbour"][4] == -1
    alone = ni.forecast(table(stars[2:3]), observation())["x_error"][0]
    np.testing.assert_allclose(result["x_error"][2].value, alone.value, rtol=1e-3)
    assert len(ni.forecast(table(stars)[:0], observation())) == 0


def test_errors_of_a_source_with_a_spectrum():
    """Catches flux errors by the flat spectrum's counts: the S/N is that of as many counts."""
    plain = ni.source("point", 18.0, 15.0, 2e-15)
    red = ni.source("point", 18.0, 15.0, 2e-15, spectrum="powerlaw(2, at=3200)")
    counts = [ni.expected_counts(one, observation())[0] for one in (plain, red)]
    assert counts[1] < 0.8 * counts[0]
    as_bright = ni.source("point", 18.0, 15.0, 2e-15 * counts[1] / counts[0])
    found, expected = ni.forecast(red, observation()), ni.forecast(as_bright, observation())
    np.testing.assert_allclose(found["snr"], expected["snr"], rtol=1e-6)
    np.testing.assert_allclose(2e-15 / found["flux_error"].value, found["snr"], rtol=1e-9)

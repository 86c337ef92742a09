"""Forecasts for a lensed quad on its lens galaxy against pixels and fits of our own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

import napari_issis as ni

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
# shares nothing with the package
import fit_model

FWHM = 0.1
WHERE = ni.Observation(shape=(96, 96), exposure=120.0, psf=ni.GaussianPSF(FWHM))
NAMES = ["flux", "x", "y", "r_half", "ellipticity", "pa"]
FALSE_ALARM = 1e-6


@pytest.fixture(scope="module")
def quad():
    """Pixel model, its 18 parameters and their forecast errors."""
    sources = ni.lensed_quasar("Q2237+0305", WHERE)
    table = ni.forecast(sources, WHERE)
    sigma = FWHM / WHERE.pixel_scale / np.sqrt(8 * np.log(2))
    model = fit_model.PixelModel(sigma, WHERE.background_rate, WHERE.shape, 4, galaxy=True)
    truth, errors = [], []
    for source, row in zip(sources, table, strict=True):
        for name in NAMES if source["kind"] != "point" else NAMES[:3]:
            per = WHERE.cps_per_flux if name == "flux" else 1.0
            truth.append(per * float(getattr(source[name], "value", source[name])))
            error = row[f"{name}_error"]
            errors.append(per * float(getattr(error, "value", error)))
    return model, np.array(truth), np.array(errors)


def test_information_of_own_pixels(quad):
    """Catches a galaxy whose light wraps into the frame: 40 % of the errors of its flux."""
    model, truth, errors = quad
    slopes = model.slopes(truth)
    information = WHERE.exposure * (slopes / model.image(truth)) @ slopes.T
    norm = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / norm / norm[:, None])
    np.testing.assert_allclose(errors, np.sqrt(np.diag(covariance)) / norm, rtol=1e-3)


@pytest.mark.slow
def test_fits_scatter_as_forecast(quad):
    """Catches errors that are no standard deviations of maximum-likelihood fits.

    500 exposures at S/N 100 and more; chi squared as in ``test_forecast.py``.
    """
    model, truth, errors = quad
    rng = np.random.default_rng(8)
    mean = WHERE.exposure * model.image(truth)
    fits = [
        fit_model.fit(model, rng.poisson(mean).astype(float), WHERE.exposure, truth, errors)
        for _ in range(500)
    ]
    ratio = np.var((np.array(fits) - truth) / errors, axis=0, ddof=1)
    alarm = FALSE_ALARM / truth.size / 2
    low, high = stats.chi2.ppf([alarm, 1 - alarm], 499) / 499
    assert np.all((ratio > low) & (ratio < high)), ratio

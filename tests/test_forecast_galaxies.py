"""Forecasts for de Vaucouleurs galaxies in large frames against pixels of our own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import napari_issis as ni

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
# shares nothing with the package
import fit_model

FWHM = 0.1
WHERE = ni.Observation(shape=(300, 270), exposure=1000.0, psf=ni.GaussianPSF(FWHM))
NAMES = ["flux", "x", "y", "r_half", "ellipticity", "pa"]
# x, y, r_half, ellipticity, pa
GALAXIES = {
    "wider than the frame": (130.2, 151.7, 60.0, 0.3, 30.0),
    "near a corner": (12.4, 281.1, 25.0, 0.5, 115.0),
    "outside the frame": (-9.3, 140.6, 30.0, 0.2, 60.0),
    "ends within the frame": (135.0, 150.5, 5.0, 0.2, 170.0),
    "long": (140.6, 120.3, 40.0, 0.85, 20.0),
}


@pytest.mark.parametrize("name", GALAXIES)
def test_errors_of_own_pixels(name):
    """Catches meshes that lose, shift or wrap light, and derivatives of the wrong sense."""
    place = GALAXIES[name]
    galaxy = ni.source("devaucouleurs", *place[:2], 5e-15, *place[2:])
    (row,) = ni.forecast(galaxy, WHERE)
    per = WHERE.cps_per_flux
    found = np.array([float(getattr(row[f"{n}_error"], "value", row[f"{n}_error"])) for n in NAMES])
    found[0] *= per
    sigma = FWHM / WHERE.pixel_scale / np.sqrt(8 * np.log(2))
    model = fit_model.PixelModel(sigma, WHERE.background_rate, WHERE.shape, 0, galaxy=True)
    truth = np.array([5e-15 * per, *place])
    slopes = model.slopes(truth)
    information = WHERE.exposure * (slopes / model.image(truth)) @ slopes.T
    norm = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / norm / norm[:, None])
    np.testing.assert_allclose(found, np.sqrt(np.diag(covariance)) / norm, rtol=3e-3)

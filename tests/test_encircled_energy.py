"""Encircled energy against closed forms."""

import numpy as np
import pytest
from scipy import special

from napari_issis import GaussianPSF, MoffatPSF, TelescopePSF
from napari_issis.encircled_energy import encircled_energy


@pytest.mark.parametrize("diameter", [0.01, 0.1, 0.5])
def test_gaussian(diameter):
    """1 - exp(-R^2 / 2 sigma^2): catches a radius for a diameter."""
    expected = 1 - np.exp(-4 * np.log(2) * (diameter / 2) ** 2 / 0.1**2)
    assert encircled_energy(GaussianPSF(0.1), diameter) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("diameter", [0.02, 0.1, 2.0])
def test_airy_disc(diameter):
    """1 - J0^2 - J1^2 (Rayleigh 1881), x = pi D R / lambda: catches a wrong radian or metre."""
    x = np.pi * 1.7 * (diameter / 2 / 206264.806247) / 2500e-10
    expected = 1 - special.j0(x) ** 2 - special.j1(x) ** 2
    psf = TelescopePSF(1.7, 0.0, 2500.0)
    assert encircled_energy(psf, diameter) == pytest.approx(expected, abs=1e-6)


def test_moffat():
    """1 - (1 + (R / a)^2)^(1 - beta)."""
    a = 0.1 / (2 * np.sqrt(2 ** (1 / 3) - 1))
    expected = 1 - (1 + (0.15 / a) ** 2) ** -2
    assert encircled_energy(MoffatPSF(0.1, 3), 0.3) == pytest.approx(expected, rel=1e-6)


def test_a_bad_diameter_is_named():
    with pytest.raises(ValueError, match="diameter is 0"):
        encircled_energy(GaussianPSF(0.1), 0)

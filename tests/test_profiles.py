"""Sersic profiles as sums of Gaussians, against the profile itself."""

import mpmath
import numpy as np
import pytest
from scipy import special

from napari_issis.render.profiles import disc_transform, sersic_gaussians, sersic_transform


def profile(r, n):
    """Unit flux, half of it inside r = 1; mpmath for the constants."""
    b = mpmath.findroot(
        lambda t: mpmath.gammainc(2 * n, 0, t, regularized=True) - 0.5, 2 * n - 1 / 3
    )
    total = 2 * mpmath.pi * n * b ** (-2 * n) * mpmath.gamma(2 * n)
    return np.exp(-float(b) * r ** (1 / n)) / float(total)


@pytest.mark.parametrize("digits", [9.0, 16.0, 23.0])
@pytest.mark.parametrize("n", [0.5, 0.5003, 0.507, 0.52, 0.6, 0.85, 1.0, 1.7, 4.0, 8.0])
def test_gaussians_add_up_to_the_profile(n, digits):
    """Catches a wrong density, index, or half-light constant, and steps too coarse for n < 1."""
    r = np.geomspace(0.01, 6, 400)
    gaussians = sersic_gaussians(n, digits)
    exponent = -0.5 * (r[:, None] / gaussians.sigma) ** 2
    total = np.exp(exponent) @ (gaussians.fraction / (2 * np.pi * gaussians.sigma**2))
    expected = profile(r, n)
    # error in surface brightness as light per squared radius
    assert np.max(np.abs(total - expected) * r**2) <= 3 * np.exp(-digits)
    assert gaussians.fraction.sum() == pytest.approx(1, rel=1e-9)


def test_half_light_constants_of_the_paper():
    """Gaussian sigma = R / 1.17741."""
    assert 1 / sersic_gaussians(0.5, 20.0).sigma[0] == pytest.approx(1.17741, abs=1e-5)


@pytest.mark.parametrize("n", [0.5, 0.7, 1.0, 2.5, 4.0])
@pytest.mark.parametrize("q", [0.3, 2.0, 9.0])
def test_transforms(n, q):
    """Hankel transform by quadrature in t = r^(1/n), which resolves cusp and wings alike."""
    power = max(n, 1.0)
    node, weight = np.polynomial.legendre.leggauss(20)
    width = 40.0 / 4000
    t = ((np.arange(4000)[:, None] + 0.5 * (node + 1)) * width).ravel()
    r = t**power
    measure = np.tile(0.5 * weight * width, 4000) * power * t ** (power - 1)
    expected = np.sum(measure * 2 * np.pi * r * profile(r, n) * special.j0(q * r))
    assert sersic_transform(n, np.array([q]))[0] == pytest.approx(expected, abs=1e-8)


def test_disc_transform():
    """Disc of radius sqrt(2): 2 J1(z) / z at z = sqrt(2) q."""
    q = 3.0
    expected = 2 * mpmath.besselj(1, mpmath.sqrt(2) * q) / (mpmath.sqrt(2) * q)
    assert disc_transform(np.array([0.0, q])) == pytest.approx([1.0, float(expected)])

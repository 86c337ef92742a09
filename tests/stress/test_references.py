"""The references of these tests against each other and against mpmath."""

import ellipse_quadrature
import fourier_quadrature
import moffat_star
import mpmath
import numpy as np
import pytest

import quadrature

PIXELS = [(5, 6), (9, 14), (0, 0), (6, 6)]
SIGMA_PER_FWHM = 1 / np.sqrt(8 * np.log(2))


@pytest.mark.parametrize(
    ("kind", "n"),
    [("uniform", 1.0), ("gaussian", 0.5), ("sersic", 0.7), ("exponential", 1.0), ("sersic", 8.0)],
)
def test_three_quadratures_agree(kind, n):
    """Catches a slip in one reference: around the source, around the pixel, by frequency."""
    source, fwhm = (kind, 5.7, 4.9, 3.0, 0.4, 33.0, n), 1.5
    around_source = quadrature.rate(source, PIXELS, fwhm * SIGMA_PER_FWHM)
    around_pixel = ellipse_quadrature.rate(source, PIXELS, fwhm * SIGMA_PER_FWHM)
    by_frequency = fourier_quadrature.rate(source, PIXELS, fourier_quadrature.gaussian(fwhm))
    assert np.abs(around_pixel - around_source).max() <= 1e-12 * around_source.max()
    assert np.abs(by_frequency - around_source).max() <= 1e-12 * around_source.max()


@pytest.mark.parametrize("fwhm", [0.2, 1.7, 50.0])
@pytest.mark.parametrize("beta", [1.4, 3.0, 6.0])
def test_moffat_star(fwhm, beta):
    """Catches a wrong scale or transform: real space against Fourier space."""
    pixels = np.array([(0.0, 0.0), (1.0, 2.0), (0.3, -0.5)])
    system = fourier_quadrature.moffat(fwhm, beta)
    source = ("point", 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    by_frequency = fourier_quadrature.rate(source, pixels, system)
    in_space = np.array([moffat_star.rate(y, x, fwhm, beta) for y, x in pixels])
    assert np.abs(by_frequency - in_space).max() <= 1e-12 * in_space.max()


@pytest.mark.parametrize(("n", "q"), [(0.6, 0.8), (0.6, 6.0), (2.0, 0.01), (2.0, 0.8), (3.1, 0.01)])
def test_sersic_transform(n, q):
    """Catches a wrong ray or normalisation: mpmath along the real axis, zero by zero of J0."""
    with mpmath.workdps(25):
        b = mpmath.findroot(
            lambda t: mpmath.gammainc(2 * n, 0, t, regularized=True) - 0.5, 2 * n - 1 / 3
        )
        # in t = r^(1/n) the profile falls like exp(-b t)
        last = 60 / b
        period = [(mpmath.pi * j / q) ** (1 / mpmath.mpf(n)) for j in range(1, 400)]
        steps = [last * j / 20 for j in range(21)]
        edges = sorted({*steps, *(p for p in period if p < last)})
        integral = mpmath.quad(
            lambda t: n * t ** (2 * n - 1) * mpmath.exp(-b * t) * mpmath.besselj(0, q * t**n),
            edges,
            maxdegree=4,
        )
        expected = integral * b ** (2 * n) / (n * mpmath.gamma(2 * n))
    assert float(fourier_quadrature.sersic_transform(n)(q)) == pytest.approx(
        float(expected), abs=1e-11
    )


@pytest.mark.parametrize("obscuration", [0.0, 0.35])
@pytest.mark.parametrize("nu", [0.1, 0.34, 0.5, 0.8])
def test_band_of_an_aperture(obscuration, nu):
    """Catches wrong overlaps and weights: areas and mean by mpmath."""

    def overlap(first, second, d):
        low, high = max(-first, d - second), min(first, d + second)
        if low >= high:
            return mpmath.mpf(0)
        middle = (d * d + first**2 - second**2) / (2 * d)
        middle = min(max(middle, low), high)
        half = mpmath.quad(lambda x: mpmath.sqrt(max(second**2 - (x - d) ** 2, 0)), [low, middle])
        other = mpmath.quad(lambda x: mpmath.sqrt(max(first**2 - x * x, 0)), [middle, high])
        return 2 * (half + other)

    def annulus(v):
        area = overlap(1, 1, 2 * v)
        if obscuration:
            area += overlap(obscuration, obscuration, 2 * v)
            if 2 * v <= 1 - obscuration:
                area -= 2 * mpmath.pi * obscuration**2
            else:
                area -= 2 * overlap(1, obscuration, 2 * v)
        return area / (mpmath.pi * (1 - obscuration**2))

    ratio = 1.4
    kinks = [k / nu for k in (obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2, 1)]
    edges = sorted({1, ratio, *(k for k in kinks if 1 < k < ratio)})
    mean = mpmath.quad(lambda w: w * annulus(nu * w), edges, maxdegree=5) / (0.5 * (ratio**2 - 1))
    otf, _, _ = fourier_quadrature.telescope(1.7, obscuration, 2000, 2800, 0.0, 0.036)
    cutoff = 1.7 / 2000e-10 / (180 * 3600 / np.pi) * 0.036
    assert otf(np.array([nu * cutoff]))[0] == pytest.approx(float(mean), abs=1e-8)

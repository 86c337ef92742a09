"""Counts and S/N of single sources, against pixel sums of independent images."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from scipy import special

from napari_issis import GaussianPSF, Observation, source
from napari_issis.source_counts import expected_counts, signal_to_noise

SCALE = 0.036


def gaussian_image(sigma_y: float, sigma_x: float, n: int = 201) -> np.ndarray:
    """Pixel integrals of a unit-flux Gaussian, from the error function."""

    def along(sigma):
        edges = np.arange(n + 1) - n / 2 + 0.21
        return np.diff(0.5 * special.erf(edges / (np.sqrt(2) * sigma)))

    return np.outer(along(sigma_y), along(sigma_x))


def best_fit_snr(share: np.ndarray, counts: float, sky: float) -> float:
    """N / sqrt(N + B / sum p^2), King (1983)."""
    return counts / np.sqrt(counts + sky / np.sum(share**2))


@pytest.mark.parametrize("sky", [0.0, 0.01, 1.0])
@pytest.mark.parametrize("r_half", [None, 2.0, 10.0])
def test_round_gaussians_exactly(sky, r_half):
    """Catches a wrong constant in either area, the sky per second, and a missing pixel."""
    observation = Observation(psf=GaussianPSF(0.1), background=sky, exposure=100.0)
    psf = 0.1 / SCALE / 2.3548200450309493
    if r_half is None:
        one, sigma = source("point", 100, 100, 3e-16), psf
    else:
        one = source("gaussian", 100, 100, 3e-16, r_half=r_half, ellipticity=0.0)
        sigma = np.hypot(psf, r_half / 1.1774100225154747)
    counts = 3e-16 * 1.14e17 * 100
    assert expected_counts(one, observation)[0] == pytest.approx(counts, rel=1e-3)
    expected = best_fit_snr(gaussian_image(sigma, sigma), counts, 100 * sky)
    assert signal_to_noise(one, observation)[0] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("kind", ["uniform", "exponential", "devaucouleurs"])
@pytest.mark.parametrize("r_half", [3.0, 15.0])
def test_galaxies_in_the_sky(kind, r_half):
    """Catches a profile's constant that is wrong, and an ellipticity that is forgotten.

    The share of each pixel is summed here from the profile's formula on a grid of a quarter
    pixel, which is coarse for the cusp.
    """
    q, r = 0.4, np.arange(-200.0, 200.0, 0.25) + 0.125
    y, x = np.meshgrid(r / q, r, indexing="ij")
    radius = np.hypot(y, x) / r_half
    if kind == "uniform":
        profile = (radius < np.sqrt(2)).astype(float)
    elif kind == "exponential":
        profile = np.exp(-1.6783469900166605 * radius)
    else:
        profile = np.exp(-7.669249443233388 * radius**0.25)
    share = profile / profile.sum()
    psf = 0.1 / SCALE / 2.3548200450309493
    k = np.fft.fftfreq(r.size, 0.25)
    otf = np.exp(-2 * (np.pi * psf) ** 2 * (k[:, None] ** 2 + k**2))
    otf = otf * np.sinc(k)[:, None] * np.sinc(k)
    blurred = np.fft.ifft2(np.fft.fft2(share) * otf).real[2::4, 2::4] * 16
    observation = Observation(psf=GaussianPSF(0.1), background=5.0)
    one = source(kind, 100, 100, 3e-16, r_half=r_half, ellipticity=1 - q)
    expected = best_fit_snr(blurred, 3e-16 * 1.14e17 * 100, 500.0)
    bound = 0.03 if kind == "devaucouleurs" else 0.01
    assert signal_to_noise(one, observation)[0] == pytest.approx(expected, rel=bound)


def test_filters_and_dark_sources():
    """Catches filters that dim the source or the sky alone, and a division by zero."""
    observation = Observation(filters=("NF1", "open"))
    two = vstack([source("point", 5, 5, 1e-15), source("point", 5, 5, 0.0)])
    open_ = signal_to_noise(two, observation.replace(filters=("open", "open")))
    dimmed = signal_to_noise(two, observation)
    assert dimmed[0] == pytest.approx(open_[0] * np.sqrt(0.1), rel=1e-12)
    assert dimmed[1] == 0.0
    assert signal_to_noise(two, observation.replace(background=0.0))[1] == 0.0

"""PSFs: transfer functions against real space, and bad parameters."""

import numpy as np
import pytest
from astropy.io import fits
from scipy import integrate, special

import napari_issis as ni
from napari_issis.instrument import CHANNELS
from napari_issis.psf import fwhm


def hankel(profile, k, reach):
    value, _ = integrate.quad(
        lambda r: 2 * np.pi * r * profile(r) * special.j0(2 * np.pi * k * r), 0, reach, limit=500
    )
    return value


@pytest.mark.parametrize("k", [0.0, 1.0, 4.0, 9.0])
def test_gaussian_and_moffat_transforms(k):
    """Catches sigma for FWHM, and a wrong Moffat scale or normalisation."""
    sigma = 0.1 / 2.3548200450309493
    gaussian = hankel(lambda r: np.exp(-0.5 * (r / sigma) ** 2) / (2 * np.pi * sigma**2), k, 2)
    assert ni.GaussianPSF(0.1).otf(k) == pytest.approx(gaussian, abs=1e-9)
    beta = 3.0
    a = 0.1 / (2 * np.sqrt(2 ** (1 / beta) - 1))
    moffat = hankel(lambda r: (beta - 1) / (np.pi * a**2) * (1 + (r / a) ** 2) ** -beta, k, 20)
    assert ni.MoffatPSF(0.1, beta).otf(k) == pytest.approx(moffat, abs=1e-7)


@pytest.mark.parametrize("nu", [0.05, 0.31, 0.35, 0.5, 0.67, 0.9, 0.999])
def test_annular_otf_is_the_autocorrelation(nu):
    """Overlap of two annuli counted along strips (catches obscuration by area, a factor 2)."""
    obscuration, shift = 0.35, 2 * nu

    def chord(radius, y):
        return np.sqrt(max(radius**2 - y**2, 0.0))

    def overlap(y):
        big, small = chord(1, y), chord(obscuration, y)
        total = max(2 * big - shift, 0)
        for centre in (0.0, shift):  # the holes of both, where inside the other's disc
            low, high = max(centre - small, shift - big), min(centre + small, big)
            total -= max(high - low, 0)
        total += max(2 * small - shift, 0) if big > 0 else 0
        return total

    area = 2 * integrate.quad(overlap, 0, 1, points=[obscuration], limit=400)[0]
    expected = area / (np.pi * (1 - obscuration**2))
    psf = ni.TelescopePSF(1.7, obscuration, 2500.0)
    assert psf.otf(nu * psf.cutoff()) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("k", [1.0, 8.0, 16.0, 25.0, 40.0])
def test_band_average_is_weighted_by_photons(k):
    """Catches weights by energy or none, and the wrong end of the band as the cut-off."""
    low, high = 1850.0, 3200.0
    wavelength = np.linspace(low, high, 40001)
    values = [float(ni.TelescopePSF(1.7, 0.33, float(w)).otf(k)) * w for w in wavelength[::40]]
    expected = integrate.simpson(values, x=wavelength[::40]) / (0.5 * (high**2 - low**2))
    assert ni.TelescopePSF(1.7, 0.33, (low, high)).otf(k) == pytest.approx(expected, abs=3e-7)


def test_default_psfs_are_a_tenth_of_an_arcsecond():
    for channel in CHANNELS.values():
        assert fwhm(channel.psf) == pytest.approx(0.10, abs=0.002)


def test_fwhm_of_known_profiles():
    assert fwhm(ni.GaussianPSF(0.07)) == pytest.approx(0.07, rel=1e-5)
    assert fwhm(ni.MoffatPSF(0.1, 3)) == pytest.approx(0.1, rel=1e-5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ni.GaussianPSF(0), "fwhm is 0"),
        (lambda: ni.GaussianPSF(np.nan), "fwhm is nan"),
        (lambda: ni.MoffatPSF(0.1, 1.0), "beta is 1"),
        (lambda: ni.TelescopePSF(-1), "diameter is -1"),
        (lambda: ni.TelescopePSF(1.7, 1.0), "obscuration is 1"),
        (lambda: ni.TelescopePSF(1.7, 0.3, (3000, 2000)), "lower limit exceeds"),
        (lambda: ni.TelescopePSF(1.7, 0.3, np.inf), "band is inf"),
        (lambda: ni.TelescopePSF(1.7, 0.3, 2500, -0.1), "blur_fwhm is -0.1"),
        (lambda: ni.ImagePSF(np.zeros((3, 3)), 0.01), "sums to 0"),
        (lambda: ni.ImagePSF(np.ones(3), 0.01), "two dimensions"),
        (lambda: ni.ImagePSF([[1, np.nan]], 0.01), "holds nan at"),
        (lambda: ni.ImagePSF(np.ones((3, 3)), 0), "pixel_scale is 0"),
    ],
)
def test_bad_parameters(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_image_psf_from_fits(tmp_path):
    samples = np.arange(12.0).reshape(3, 4)
    fits.PrimaryHDU(samples).writeto(tmp_path / "bare.fits")
    with pytest.raises(ValueError, match="pixel scale"):
        ni.ImagePSF.from_fits(tmp_path / "bare.fits")
    given = ni.ImagePSF.from_fits(tmp_path / "bare.fits", pixel_scale=0.01)
    assert given == ni.ImagePSF(samples, 0.01)
    hdu = fits.PrimaryHDU(samples)
    hdu.header["PIXELSCL"] = 0.01
    hdu.writeto(tmp_path / "psf.fits")
    assert ni.ImagePSF.from_fits(tmp_path / "psf.fits") == given
    assert hash(given) == hash(ni.ImagePSF(samples, 0.01))
    assert given != ni.ImagePSF(samples, 0.02)

"""PSFs: transfer functions against real space, and bad parameters."""

from itertools import pairwise

import numpy as np
import pytest
from astropy.io import fits
from scipy import integrate, special

import napari_issis as ni
from napari_issis.instruments import ISSIS
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


def annular_overlap(obscuration, nu):
    """Normalised area common to two annuli 2 nu apart: circular segments."""

    def lens(big, small, d):
        if d >= big + small:
            return 0.0
        if d <= big - small:
            return np.pi * small**2
        area = 0.0
        for one, other in ((big, small), (small, big)):
            angle = np.arccos((d**2 + one**2 - other**2) / (2 * d * one))
            area += one**2 * (angle - np.sin(angle) * np.cos(angle))
        return area

    e, d = obscuration, 2 * nu
    area = lens(1, 1, d) - (2 * lens(1, e, d) - lens(e, e, d) if e else 0.0)
    return area / (np.pi * (1 - e**2))


@pytest.mark.parametrize("ratio", [1.05, 1.5, 3.0])
@pytest.mark.parametrize("obscuration", [0.0, 0.1, 0.25, 1 / 3, 0.35, 0.5, 0.8])
def test_band_average_close_to_its_kinks(obscuration, ratio):
    """Against adaptive quadrature between the kinks, to 5e-11.

    Catches a spline that rings because two knots nearly coincide, a kink without a knot, and
    knots too far apart where the fourth derivative is infinite.
    """
    kinks = {1.0, obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2} - {0.0}

    def mean(k):
        edges = sorted({1.0, ratio} | {c / k for c in kinks if 1 < c / k < ratio})

        def integrand(t, low, high):  # slow at both ends, where there are powers of 3/2
            wavelength = low + (high - low) * t**2 * (3 - 2 * t)
            slope = (high - low) * 6 * t * (1 - t)
            return slope * wavelength * annular_overlap(obscuration, k * wavelength)

        pieces = [
            integrate.quad(integrand, 0, 1, args=ends, epsabs=1e-14, epsrel=1e-13)[0]
            for ends in pairwise(edges)
        ]
        return sum(pieces) / (0.5 * (ratio**2 - 1))

    low = 2000.0
    psf = ni.TelescopePSF(1.7, obscuration, (low, low * ratio))
    corners = {c / r for c in kinks for r in (1, ratio)}
    near = [-1e-3, -6e-5, -4e-6, 0.0, 1e-7, 2e-5, 6e-5, 1e-4]
    for k in [1e-4, 0.07, *(c + d for c in corners for d in near if c + d < 1)]:
        assert psf.otf(k * psf.cutoff()) == pytest.approx(mean(k), rel=0, abs=5e-11)


def test_default_psfs_are_a_tenth_of_an_arcsecond():
    for channel in ISSIS.channels.values():
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
        (lambda: ni.TelescopePSF(1e6), "diameter is 1e.06; apertures of at most 10000 metres"),
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
    row = np.exp(-0.5 * (np.arange(-5, 6) / 1.5) ** 2)
    samples = np.outer(np.exp(-0.5 * (np.arange(-6, 7) / 1.5) ** 2), row)
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


@pytest.mark.parametrize("psf", [ni.TelescopePSF(80.0, band=500.0), ni.GaussianPSF(1e-6)])
def test_a_psf_too_sharp_for_the_pixels_is_refused(psf):
    """A mesh for it would need terabytes: no MemoryError after a minute."""
    with pytest.raises(ValueError, match=r"cycles per pixel.*give it a blur"):
        ni.count_rate(ni.source("point", 8, 8), ni.Observation(shape=(16, 16), psf=psf))


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda width: ni.GaussianPSF(width), "fwhm"),
        (lambda width: ni.MoffatPSF(fwhm=width, beta=3), "fwhm"),
        (lambda width: ni.TelescopePSF(1.7, blur_fwhm=width), "blur_fwhm"),
        (lambda width: ni.TelescopePSF(1.7, jitter_fwhm=width), "jitter_fwhm"),
        (lambda width: ni.TelescopePSF(1.7, halo_share=0.1, halo_fwhm=width), "halo_fwhm"),
    ],
)
def test_widths_beyond_reason_are_refused_by_name(make, name):
    """Catches a division by zero in the middle of a render; the widest allowed one renders."""
    with pytest.raises(ValueError, match=rf"^{name} is 1001; .*1000 arcsec"):
        make(1001.0)
    psf = make(1000.0)
    star = ni.source("point", 16, 16, 1e-14)
    rate = ni.count_rate(star, ni.Observation(shape=(32, 32), psf=psf))
    assert np.all(rate >= 0)
    assert np.all(np.isfinite(rate))

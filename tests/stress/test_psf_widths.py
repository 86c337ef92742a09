"""PSFs from 0.2 to 50 pixels wide, and images of PSFs with too few samples."""

import ellipse_quadrature
import fourier_quadrature
import moffat_star
import numpy as np
import pytest
from plain_scene import CPS, PIXEL, psf_of, table_of
from scipy import special

import napari_issis as ni

SHAPE = (40, 31)
PIXELS = [(20, 15), (19, 17), (0, 0), (39, 3), (8, 30)]
STAR = ("point", 15.4, 19.7, 0.0, 0.0, 0.0, 1.0)
GALAXY = ("exponential", 15.4, 19.7, 2.5, 0.4, 130.0, 1.0)
SIGMA_PER_FWHM = 1 / np.sqrt(8 * np.log(2))


def check(psf, source, expected, tolerance, shape=SHAPE, pixels=PIXELS):
    observation = ni.Observation(shape=shape, psf=psf)
    image = ni.count_rate(table_of([(1e-14, *source)]), observation, tolerance=tolerance)
    got = np.array([image[p] for p in pixels])
    error = np.abs(got - 1e-14 * CPS * np.asarray(expected)).max()
    assert error <= tolerance * image.max()


@pytest.mark.parametrize("source", [STAR, GALAXY], ids=["star", "galaxy"])
@pytest.mark.parametrize("fwhm", [0.2, 0.5, 5.0, 50.0])
def test_gaussian(fwhm, source):
    """Catches aliases of a PSF narrower than the pixel, a wide one that wraps around."""
    expected = ellipse_quadrature.rate(source, PIXELS, fwhm * SIGMA_PER_FWHM)
    check(psf_of("gaussian", (fwhm,)), source, expected, 1e-8)


@pytest.mark.parametrize("beta", [1.3, 2.5, 5.0])
@pytest.mark.parametrize("fwhm", [0.2, 1.0, 50.0])
def test_moffat_star(fwhm, beta):
    """Catches the cusp of the transfer function at zero (far wings) and its long tail."""
    expected = [moffat_star.rate(y - 19.7, x - 15.4, fwhm, beta) for y, x in PIXELS]
    check(psf_of("moffat", (fwhm, beta)), STAR, expected, 1e-8)


@pytest.mark.parametrize("fwhm", [0.6, 20.0])
def test_moffat_galaxy(fwhm):
    """Catches a profile cut where the wings still carry it."""
    expected = fourier_quadrature.rate(GALAXY, PIXELS, fourier_quadrature.moffat(fwhm, 2.5))
    check(psf_of("moffat", (fwhm, 2.5)), GALAXY, expected, 1e-8)


@pytest.mark.parametrize("source", [STAR, GALAXY], ids=["star", "galaxy"])
@pytest.mark.parametrize(
    "numbers",
    [
        (3.3, 0.3, 1150.0, 1150.0, 0.0),  # 0.2 pixels
        (1.7, 0.33, 1150.0, 1750.0, 0.0945),  # the far ultraviolet's own
        (1.7, 0.0, 1850.0, 3200.0, 0.0),
        (1.7, 0.9, 2500.0, 2500.0, 0.0),
        (0.029, 0.2, 2500.0, 2500.0, 0.0),  # 50 pixels
    ],
)
def test_telescope(numbers, source):
    """Catches a lost ring, a cut-off taken at the band's wrong end, a pupil without a hole."""
    system = fourier_quadrature.telescope(*numbers, PIXEL)
    expected = fourier_quadrature.rate(source, PIXELS, system)
    check(psf_of("telescope", numbers), source, expected, 1e-6)


@pytest.mark.parametrize("x", [15.4, -6.2], ids=["inside", "outside"])
@pytest.mark.parametrize(
    "numbers", [(0.8, 0.0, 2700.0, 2700.0, 0.0), (1.2, 0.17, 2950.0, 2950.0, 0.1)]
)
def test_the_last_digits_of_rings(numbers, x):
    """Catches rings cut short of the frame: one wavelength, and only the rings in the frame."""
    star = ("point", x, *STAR[2:])
    system = fourier_quadrature.telescope(*numbers, PIXEL)
    expected = fourier_quadrature.rate(star, PIXELS, system)
    check(psf_of("telescope", numbers), star, expected, 1e-8)


def across_pixel(d, step):
    """Integral of sinc(x / step) over the unit interval about d."""
    high, low = (special.sici(np.pi * (d + e) / step)[0] for e in (0.5, -0.5))
    return (high - low) * step / np.pi


@pytest.mark.parametrize("step", [0.35, 1.0, 1.7, 3.0])
@pytest.mark.parametrize("samples", [(1, 1), (3, 4)])
def test_undersampled_image_star(step, samples):
    """Catches ripples wrapped or cut, an even array's centre half a sample off, a second sinc."""
    array = np.random.default_rng(5).uniform(0.2, 1, samples)
    array /= array.sum()
    ny, nx = samples
    y = np.arange(SHAPE[0])[:, None] - 19.7 - (np.arange(ny) - 0.5 * (ny - 1)) * step
    x = np.arange(SHAPE[1])[:, None] - 15.4 - (np.arange(nx) - 0.5 * (nx - 1)) * step
    image = across_pixel(y, step) / step @ array @ (across_pixel(x, step) / step).T
    expected = [image[p] for p in PIXELS]
    check(ni.ImagePSF(array, step * PIXEL), STAR, expected, 1e-7)


@pytest.mark.parametrize("includes_pixel", [False, True])
@pytest.mark.parametrize("source", [GALAXY, ("uniform", *GALAXY[1:])], ids=["galaxy", "disc"])
def test_undersampled_image_of_extended_sources(source, includes_pixel):
    """Catches a galaxy convolved with another PSF than a star: quadrature over the Nyquist box."""
    step, array = 1.7, np.array([[0.0, 0.2, 0.0], [0.1, 0.5, 0.1], [0.0, 0.0, 0.1]])
    kind, x, y, r_half, ellipticity, pa, n = source
    crowd = np.geomspace(1e-4, 1, 40)
    edges = 0.5 / step * np.unique(np.concatenate([np.linspace(-1, 1, 121), crowd, -crowd]))
    half = 0.5 * np.diff(edges)[:, None]
    node, weight = np.polynomial.legendre.leggauss(8)
    k, w = (edges[:-1, None] + half * (node + 1)).ravel(), (half * weight).ravel()
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    along = k[:, None] * cos - k * sin
    across = k[:, None] * sin + k * cos
    spectrum = fourier_quadrature.source_transform(kind, r_half, n)(
        np.hypot(along, (1 - ellipticity) * across)
    )
    phases = np.exp(-2j * np.pi * np.outer(k, (np.arange(3) - 1) * step))
    spectrum = spectrum * (phases @ array @ phases.T)
    if not includes_pixel:
        spectrum = spectrum * np.sinc(k)[:, None] * np.sinc(k)
    expected = []
    for py, px in PIXELS:
        row, column = (w * np.exp(2j * np.pi * k * d) for d in (py - y, px - x))
        expected.append((row @ spectrum @ column).real)
    check(ni.ImagePSF(array, step * PIXEL, includes_pixel), source, expected, 1e-7)

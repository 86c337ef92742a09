"""Jitter and halo of the telescope PSF, against Gaussians in closed form."""

import numpy as np
import pytest
from scipy.special import erf

import napari_issis as ni
from napari_issis.encircled_energy import encircled_energy, psf_table
from napari_issis.psf import fwhm

# An aperture so large, in light so short, that only the blurs are left.
LARGE = (1e4, 0.0, 10.0)


def gaussian_share(diameter, width):
    """Share of a Gaussian of that FWHM in a circle."""
    return 1 - np.exp(-4 * np.log(2) * (diameter / 2 / width) ** 2)


def test_blur_and_jitter_add_in_quadrature():
    """Catches widths that add linearly, and one blur in place of the other: 3, 4, 5."""
    psf = ni.TelescopePSF(*LARGE, blur_fwhm=0.06, jitter_fwhm=0.08)
    assert fwhm(psf) == pytest.approx(0.1, rel=1e-5)
    swapped = ni.TelescopePSF(*LARGE, blur_fwhm=0.08, jitter_fwhm=0.06)
    assert fwhm(swapped) == pytest.approx(0.1, rel=1e-5)


@pytest.mark.parametrize("diameter", [0.1, 0.5, 2.0])
def test_encircled_energy_of_core_and_halo(diameter):
    """Catches a share that counts the core, and a halo not widened by the core's own blur."""
    psf = ni.TelescopePSF(*LARGE, blur_fwhm=0.1, halo_share=0.3, halo_fwhm=0.8)
    expected = 0.7 * gaussian_share(diameter, 0.1)
    expected += 0.3 * gaussian_share(diameter, np.hypot(0.1, 0.8))
    assert encircled_energy(psf, diameter) == pytest.approx(expected, rel=1e-6)


def test_rendered_halo():
    """Catches a halo that the mesh folds back or cuts off: pixel integrals by error functions.

    The aperture of 10 km is as large as the renderer can hold. At 2500 A it lowers the core's
    peak by (4 / pi) <k> / cut-off = 3.1e-5, with <k> = 4.7 and the cut-off 1.94e5 per arcsec.
    """
    psf = ni.TelescopePSF(1e4, blur_fwhm=0.1, halo_share=0.2, halo_fwhm=1.2)
    observation = ni.Observation(shape=(40, 50), psf=psf)
    rate = ni.count_rate(ni.source("point", 30.3, 12.8, flux=1e-14), observation, tolerance=1e-8)

    def pixels(centre, n, width):
        sigma = width / observation.pixel_scale / np.sqrt(8 * np.log(2))
        edge = (np.arange(n + 1) - 0.5 - centre) / (sigma * np.sqrt(2))
        return np.diff(0.5 * erf(edge))

    expected = np.zeros((40, 50))
    for share, width in ((0.8, 0.1), (0.2, np.hypot(0.1, 1.2))):
        expected += share * np.outer(pixels(12.8, 40, width), pixels(30.3, 50, width))
    expected *= 1140.0
    np.testing.assert_allclose(rate, expected, rtol=0, atol=4e-5 * expected.max())


def test_a_filter_keeps_the_halo_and_no_halo_changes_no_bit():
    """Catches defaults that move the default PSF."""
    plain = ni.TelescopePSF(1.7, 0.33, (1850.0, 3200.0), 0.0888)
    k = np.linspace(0, 40, 500)
    unused = ni.TelescopePSF(1.7, 0.33, (1850.0, 3200.0), 0.0888, halo_fwhm=1.0)
    np.testing.assert_array_equal(plain.otf(k), unused.otf(k))
    assert unused.otf(0.0) == pytest.approx(1.0, abs=1e-12)


def test_table_of_a_psf():
    """Catches radius for diameter, and shares in per cent: a Gaussian's closed form."""
    table = psf_table(ni.GaussianPSF(0.1), (0.05, 0.1, 0.3))
    assert table.meta["fwhm"].to_value("arcsec") == pytest.approx(0.1, rel=1e-5)
    np.testing.assert_allclose(table["diameter"].to_value("arcsec"), [0.05, 0.1, 0.3])
    np.testing.assert_allclose(
        table["encircled_energy"], [gaussian_share(d, 0.1) for d in (0.05, 0.1, 0.3)], rtol=1e-6
    )
    assert len(psf_table(ni.Observation().effective_psf)) > 4
    with pytest.raises(ValueError, match="ImagePSF"):
        psf_table(ni.ImagePSF(np.ones((3, 3)), 0.01))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"jitter_fwhm": -1}, "jitter_fwhm is -1"),
        ({"halo_share": 1.5, "halo_fwhm": 1}, "halo_share is 1.5"),
        ({"halo_share": 0.1}, "halo_fwhm is 0 for a halo_share of 0.1"),
        ({"halo_share": 0.1, "halo_fwhm": np.inf}, "halo_fwhm is inf"),
    ],
)
def test_bad_values_are_named(values, message):
    with pytest.raises(ValueError, match=message):
        ni.TelescopePSF(1.7, **values)

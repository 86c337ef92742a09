"""PSF images from files: what is wrong is said, with the remedy, and the remedy helps."""

import re

import numpy as np
import pytest
from astropy.io import fits

import napari_issis as ni


def gaussian(n=41, sigma=2.5, dx=0.0, dy=0.0):
    axis = np.arange(n) - (n - 1) / 2
    return np.outer(
        np.exp(-0.5 * ((axis - dy) / sigma) ** 2), np.exp(-0.5 * ((axis - dx) / sigma) ** 2)
    )


def written(tmp_path, array, **cards):
    path = tmp_path / "psf.fits"
    header = fits.Header()
    header.update(cards or {"PIXELSCL": 0.02})
    fits.PrimaryHDU(array, header).writeto(path, overwrite=True)
    return path


def test_a_good_one_is_taken_and_normalised(tmp_path):
    psf = ni.ImagePSF.from_fits(written(tmp_path, 7e4 * gaussian()))
    assert psf.pixel_scale == 0.02
    assert psf.array.sum() == pytest.approx(1, abs=1e-14)
    # its OTF is that of the Gaussian
    k = np.array([0.0, 3.0, 6.0])
    expected = np.exp(-2 * (np.pi * 2.5 * 0.02 * k) ** 2)
    np.testing.assert_allclose(psf.otf_grid(k, np.zeros(1))[:, 0].real, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (gaussian(dx=0.5), "not centred: its core lies at x = 20.50.*cut 1 columns off its left"),
        (gaussian(dx=-2), "at x = 18.00.*cut 4 columns off its right"),
        (gaussian(dy=1.0), "at y = 21.00.*cut 2 rows off its bottom"),
        (gaussian(dy=-0.5), "at y = 19.50.*cut 1 rows off its top"),
        (gaussian() + 0.02, "not dark at its border, 2.0 %"),
        (gaussian(n=9, sigma=2.5), "not dark at its border"),
        (gaussian() - 0.003, "negative samples hold"),
        (gaussian(sigma=0.6), "undersampled: its OTF is 0.34"),
        (np.where(gaussian() > 0.9, np.nan, gaussian()), r"holds nan at \[y, x\]"),
        (-gaussian(), "sums to -"),
    ],
)
def test_a_bad_one_is_refused(tmp_path, array, message):
    path = written(tmp_path, array)
    with pytest.raises(ValueError, match=message) as raised:
        ni.ImagePSF.from_fits(path)
    assert str(path) in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("dx", "dy"), [(0.5, 0), (-0.5, 0), (2, 0), (0, -1.5), (0, 1)])
def test_the_cut_that_is_asked_for_centres_it(tmp_path, dx, dy):
    array = gaussian(n=61, dx=dx, dy=dy)
    with pytest.raises(ValueError, match="not centred") as raised:
        ni.ImagePSF.from_fits(written(tmp_path, array))
    lines, side = re.search(r"cut (\d+) \w+ off its (\w+) side", str(raised.value)).groups()
    n = int(lines)
    cut = {
        "left": array[:, n:],
        "right": array[:, :-n],
        "bottom": array[n:],
        "top": array[:-n],
    }[side]
    psf = ni.ImagePSF.from_fits(written(tmp_path, cut))
    # an OTF without a phase: centred
    k = np.linspace(0, 8, 9)
    assert np.abs(psf.otf_grid(k, k).imag).max() < 1e-9


def test_unchecked_on_demand(tmp_path):
    path = written(tmp_path, gaussian(sigma=0.6))
    assert ni.ImagePSF.from_fits(path, check=False).array.shape == (41, 41)


def test_pixel_scale_of_the_header(tmp_path):
    sky = {"CTYPE1": "RA---TAN", "CTYPE2": "DEC--TAN", "CRVAL1": 10.0, "CRVAL2": 20.0}
    turned = {"CD1_1": -0.8, "CD1_2": 0.6, "CD2_1": 0.6, "CD2_2": 0.8}
    degrees = {name: value * 0.02 / 3600 for name, value in turned.items()}
    psf = ni.ImagePSF.from_fits(written(tmp_path, gaussian(), **sky, **degrees))
    assert psf.pixel_scale == pytest.approx(0.02, rel=1e-12)
    flat = {"CUNIT1": "arcsec", "CUNIT2": "arcsec", "CDELT1": -0.03, "CDELT2": 0.03}
    psf = ni.ImagePSF.from_fits(written(tmp_path, gaussian(), **flat))
    assert psf.pixel_scale == pytest.approx(0.03, rel=1e-12)
    flat["CDELT2"] = 0.04
    with pytest.raises(ValueError, match=r"not square: 0.03 by 0.04 arcsec"):
        ni.ImagePSF.from_fits(written(tmp_path, gaussian(), **flat))
    # given, it counts
    path = written(tmp_path, gaussian(), **flat)
    assert ni.ImagePSF.from_fits(path, pixel_scale=0.05).pixel_scale == 0.05
    with pytest.raises(ValueError, match=r"PIXELSCL is -1.0; it must be a positive number"):
        ni.ImagePSF.from_fits(written(tmp_path, gaussian(), PIXELSCL=-1.0))
    with pytest.raises(ValueError, match="does not say its pixel scale"):
        ni.ImagePSF.from_fits(written(tmp_path, gaussian(), OBJECT="star"))

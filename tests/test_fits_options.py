"""Which image stands first in a file, and that other programs accept the file."""

import shutil
import subprocess
import warnings

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.wcs import WCS

from napari_issis import Exposure, ImagePSF, Observation, random_sources

SHAPE = (5, 9)
RNG = np.random.default_rng(1)
OBSERVATION = Observation(
    exposure=40.0,
    shape=SHAPE,
    background=0.01,
    pointing=SkyCoord(150.0, 60.0, unit="deg"),
    roll=30.0,
    psf=ImagePSF(np.ones((3, 4)), 0.03),
)
COUNTS = RNG.integers(0, 90, SHAPE)
COUNTS[2, 3] = 0
EXPOSURE = Exposure(
    COUNTS, RNG.random(SHAPE) * np.pi, random_sources("sersic", 3, seed=1), OBSERVATION, 7
)
SNR = np.where(COUNTS > 0, (COUNTS - 0.4) / np.sqrt(np.maximum(COUNTS, 1)), 0.0)
IMAGES = {
    "counts": (COUNTS, "ct", "int32"),
    "rate": (COUNTS / 40.0, "ct/s", "float64"),
    "expected": (EXPOSURE.expected, "ct", "float64"),
    "snr": (SNR, "", "float64"),
}


@pytest.fixture(params=[False, True], ids=["plain", "compressed"])
def compress(request):
    return request.param


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("image", IMAGES)
def test_the_image_that_stands_first(tmp_path, image, compress, whole):
    """Catches one image written for another, rounded floats, and a file that does not come back.

    The SNR is (C - B) / sqrt(C) with B = 0.01 cps x 40 s, and 0 where C is 0 (paper, section 2).
    """
    values, unit, dtype = IMAGES[image]
    EXPOSURE.write(tmp_path / "x.fits", image=image, compress=compress, whole=whole)
    with fits.open(tmp_path / "x.fits") as hdus:
        first = hdus[1 if compress else 0]
        assert first.data.dtype.name == dtype
        np.testing.assert_allclose(first.data, values, rtol=1e-15)
        assert first.header["BUNIT"] == unit
        assert first.header["EXPTIME"] == 40.0
        assert WCS(first.header).wcs.ctype[0] == "RA---TAN"
        assert len(hdus) == (1 + compress if not whole else len(hdus))
    if whole:
        back = Exposure.read(tmp_path / "x.fits")
        assert back == EXPOSURE
        assert back.expected.tobytes() == EXPOSURE.expected.tobytes()
    else:
        with pytest.raises(ValueError, match="no napari-issis exposure"):
            Exposure.read(tmp_path / "x.fits")


@pytest.mark.parametrize("dtype", ["int32", "int64", "float32", "float64"])
@pytest.mark.parametrize("image", IMAGES)
def test_the_numbers_of_the_image_can_be_chosen(tmp_path, image, dtype, compress):
    """Catches other numbers than asked for, and an exposure read back from the rounded ones."""
    path = tmp_path / "x.fits"
    if image != "counts" and dtype.startswith("int"):
        with pytest.raises(ValueError, match="use float32 or float64"):
            EXPOSURE.write(path, image=image, dtype=dtype, compress=compress)
        assert not path.exists()
        return
    EXPOSURE.write(path, image=image, dtype=dtype, compress=compress)
    with warnings.catch_warnings(), fits.open(path, checksum=True) as hdus:
        warnings.simplefilter("error")
        first = hdus[1 if compress else 0]
        assert first.data.dtype.newbyteorder("=") == np.dtype(dtype)
        assert np.array_equal(first.data, np.asarray(IMAGES[image][0]).astype(dtype))
        assert first.header["BUNIT"] == IMAGES[image][1]
        assert len({hdu.name for hdu in hdus}) == len(hdus)
        hdus.verify("exception")
    back = Exposure.read(path)
    assert back == EXPOSURE
    assert back.expected.tobytes() == EXPOSURE.expected.tobytes()


@pytest.mark.parametrize(("dtype", "most"), [("int32", 2**31 - 1), ("float32", 2**24)])
def test_counts_are_never_rounded(tmp_path, dtype, most):
    """Catches counts that wrap around, or lose their last digit, in silence."""
    for brightest, fine in ((most, True), (most + 1, False)):
        counts = np.full(SHAPE, brightest)
        exposure = Exposure(counts, EXPOSURE.expected, EXPOSURE.sources, OBSERVATION, 7)
        path = tmp_path / f"{brightest}.fits"
        if fine:
            exposure.write(path, dtype=dtype)
            assert fits.getdata(path).max() == brightest
        else:
            with pytest.raises(ValueError, match=f"{brightest}; use int64"):
                exposure.write(path, dtype=dtype)
    with pytest.raises(ValueError, match="dtype is 'int8'; known: int32, int64"):
        EXPOSURE.write(tmp_path / "x.fits", dtype="int8")


def test_an_unknown_image(tmp_path):
    with pytest.raises(ValueError, match="image is 'flux'; known: counts, rate, expected, snr"):
        EXPOSURE.write(tmp_path / "x.fits", image="flux")
    assert not (tmp_path / "x.fits").exists()


@pytest.mark.parametrize("image", IMAGES)
def test_files_are_valid(tmp_path, image, compress):
    """Catches cards, units and checksums that the standard does not allow."""
    EXPOSURE.write(tmp_path / "x.fits", image=image, compress=compress)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with fits.open(tmp_path / "x.fits", checksum=True) as hdus:
            hdus.verify("exception")
    if shutil.which("fitsverify") is None:
        pytest.skip("the program fitsverify is not installed")
    report = subprocess.run(
        ["fitsverify", "-l", str(tmp_path / "x.fits")], capture_output=True, text=True, check=False
    )
    assert "0 warning(s) and 0 error(s)" in report.stdout


def test_the_sky_has_the_orientation_of_the_frame(tmp_path, compress):
    """Catches east to the right, and a roll turned the wrong way: +y lies 30 degrees from north."""
    EXPOSURE.write(tmp_path / "x.fits", image="snr", compress=compress)
    wcs = WCS(fits.getheader(tmp_path / "x.fits", 1 if compress else 0))
    centre = wcs.pixel_to_world(4, 2)
    assert centre.separation(OBSERVATION.pointing) < 1e-6 * u.arcsec
    for x, y, angle in [(4, 3, 30), (3, 2, 120)]:
        found = centre.position_angle(wcs.pixel_to_world(x, y)).to_value(u.deg)
        assert found == pytest.approx(angle, abs=1e-3)

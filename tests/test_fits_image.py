"""Images of other programs, and where they lie in the frame."""

import gzip
import warnings

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.wcs import WCS

from napari_issis import Exposure, Observation, random_sources
from napari_issis.fits_header import wcs_header
from napari_issis.fits_image import DistortionWarning, read_image

CENTRE = SkyCoord(150.0, 60.0, unit="deg")
FRAME = Observation(shape=(200, 300), pointing=CENTRE, roll=30.0)
RNG = np.random.default_rng(1)


def foreign(*, frame="icrs", scale=0.05, angle=70.0, offset=2.0, shape=(90, 120), mirrored=False):
    """An image of another telescope: its own scale, roll, pointing and system."""
    at = CENTRE.directional_offset_by(20 * u.deg, offset * u.arcsec).transform_to(frame)
    wcs = WCS(naxis=2)
    names = {"galactic": ("GLON-TAN", "GLAT-TAN")}.get(frame, ("RA---TAN", "DEC--TAN"))
    wcs.wcs.ctype = names
    wcs.wcs.crval = [at.data.lon.deg, at.data.lat.deg]
    wcs.wcs.crpix = [40.0, 60.0]
    if frame == "fk5":
        wcs.wcs.radesys = "FK5"
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    flip = 1 if mirrored else -1
    wcs.wcs.cd = scale / 3600 * np.array([[flip * c, s], [-flip * s, c]])
    return fits.PrimaryHDU(RNG.random(shape).astype("f4"), wcs.to_header()), wcs


@pytest.mark.parametrize("frame", ["icrs", "fk5", "galactic"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_star_of_the_image_falls_on_the_frame(tmp_path, frame, mirrored):
    """Catches x and y exchanged, pixels counted from 1, a roll, mirror or system left out."""
    hdu, wcs = foreign(frame=frame, mirrored=mirrored)
    hdu.writeto(tmp_path / "x.fits")
    image = read_image(tmp_path / "x.fits", FRAME)
    np.testing.assert_array_equal(image.data, hdu.data)
    assert image.data.dtype == np.float32
    ours = WCS(wcs_header(FRAME))
    for x, y in [(0, 0), (119, 0), (7, 89), (60.3, 33.1)]:
        expected_x, expected_y = ours.world_to_pixel(wcs.pixel_to_world(x, y))
        found = image.transform @ [y, x, 1]
        assert found == pytest.approx([float(expected_y), float(expected_x), 1], abs=1e-3)
    assert image.deviation < 1e-3
    assert "1.39 pixels of the frame" in image.note


def test_our_own_exposure_lies_on_itself(tmp_path):
    exposure = Exposure(
        np.zeros(FRAME.shape, int), np.zeros(FRAME.shape), random_sources("point", 0), FRAME, 0
    )
    for compress in (False, True):
        exposure.write(tmp_path / "x.fits", compress=compress, overwrite=True)
        image = read_image(tmp_path / "x.fits", FRAME)
        np.testing.assert_allclose(image.transform, np.eye(3), atol=1e-6)
    image = read_image(tmp_path / "x.fits", FRAME, hdu="EXPECTED")
    np.testing.assert_allclose(image.transform, np.eye(3), atol=1e-6)


def test_distortion_is_told(tmp_path):
    """Catches an image that is laid askew in silence: SIP terms of some pixels at the edge."""
    hdu, _ = foreign(offset=0.0)
    header = hdu.header
    header["CTYPE1"], header["CTYPE2"] = "RA---TAN-SIP", "DEC--TAN-SIP"
    header["A_ORDER"], header["B_ORDER"], header["A_2_0"], header["B_0_2"] = 2, 2, 1e-3, 1e-3
    hdu.writeto(tmp_path / "x.fits")
    with pytest.warns(DistortionWarning, match=r"off by up to \d+"):
        image = read_image(tmp_path / "x.fits", FRAME)
    # at the far corner the terms are 1e-3 x 80^2 = 6.4 of its pixels, 1.39 of ours each
    assert 5 < image.deviation < 15
    assert image.deviation_in_frame > 1


def test_a_wide_image_may_be_off_outside_the_frame_only(tmp_path):
    hdu, _ = foreign(scale=60.0, offset=1200.0)
    hdu.writeto(tmp_path / "x.fits")
    with pytest.warns(DistortionWarning, match="within the frame by up to"):
        image = read_image(tmp_path / "x.fits", FRAME)
    assert image.deviation > 10
    assert image.deviation_in_frame < 0.1


def test_without_coordinates_there_is_no_transform(tmp_path):
    hdu, _ = foreign()
    hdu.writeto(tmp_path / "sky.fits")
    fits.PrimaryHDU(hdu.data).writeto(tmp_path / "plain.fits")
    assert read_image(tmp_path / "sky.fits").transform is None
    image = read_image(tmp_path / "sky.fits", Observation())
    assert (image.transform, image.note) == (None, "the frame has no position on the sky")
    image = read_image(tmp_path / "plain.fits", FRAME)
    assert (image.transform, image.note) == (None, "the image has no coordinates on the sky")
    opposite = FRAME.replace(pointing=SkyCoord(330.0, -60.0, unit="deg"))
    image = read_image(tmp_path / "sky.fits", opposite)
    assert image.transform is None
    assert "does not lie near the frame" in image.note


def test_the_first_image_or_the_chosen_one(tmp_path):
    """Catches an empty primary unit, a table or a cube taken for the image."""
    first, second = RNG.integers(0, 99, (3, 4)), RNG.integers(0, 99, (1, 5, 6)).astype("i2")
    cube = np.zeros((2, 3, 4))
    table = fits.BinTableHDU.from_columns([fits.Column("x", "D", array=[1.0])])
    images = [fits.CompImageHDU(first, name="A"), fits.ImageHDU(second, name="B")]
    fits.HDUList([fits.PrimaryHDU(), table, fits.ImageHDU(cube, name="CUBE"), *images]).writeto(
        tmp_path / "x.fits"
    )
    np.testing.assert_array_equal(read_image(tmp_path / "x.fits").data, first)
    for hdu in (4, "B"):
        image = read_image(tmp_path / "x.fits", hdu=hdu)
        np.testing.assert_array_equal(image.data, second[0])
        assert image.data.dtype == np.int16
        assert image.data.dtype.isnative
    for hdu, message in [(9, "no extension 9"), ("C", "no extension 'C'"), (2, "no image of two")]:
        with pytest.raises(ValueError, match=message):
            read_image(tmp_path / "x.fits", hdu=hdu)
    table.writeto(tmp_path / "y.fits")
    with pytest.raises(ValueError, match=r"y\.fits: the file holds no image"):
        read_image(tmp_path / "y.fits")


def test_scaled_and_packed_images(tmp_path):
    hdu = fits.PrimaryHDU(np.arange(6, dtype="i2").reshape(2, 3))
    hdu.header["BSCALE"], hdu.header["BZERO"], hdu.header["BLANK"] = 0.5, 10.0, 3
    hdu.writeto(tmp_path / "x.fits", output_verify="ignore")
    (tmp_path / "x.fits.gz").write_bytes(gzip.compress((tmp_path / "x.fits").read_bytes()))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        image = read_image(tmp_path / "x.fits.gz")
    assert image.data.shape == (2, 3)

"""Exposures in FITS files: what goes in comes back, and nothing is ever half-written."""

import errno
import os
import signal
import subprocess
import sys
import time
import warnings

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import vstack
from astropy.wcs import WCS
from hypothesis import given, settings
from hypothesis import strategies as st

from napari_issis import (
    Detector,
    Exposure,
    GaussianPSF,
    ImagePSF,
    MoffatPSF,
    Observation,
    TelescopePSF,
    random_sources,
    source,
)
from napari_issis.fits_table import read_table, table_hdu

ODD = 0.1 + 0.2  # 0.30000000000000004: a float that most roundings change
GALAXY = source("exponential", ODD, 1 / 3, flux=ODD * 1e-14, r_half=20 * ODD, pa=ODD)
LENSES = (1 / 3) * u.rad


def exposure_of(observation, sources=GALAXY, *, brightest=400, seed=7):
    rng = np.random.default_rng(1)
    counts = rng.integers(0, brightest, observation.shape, endpoint=True)
    counts.flat[0] = brightest
    return Exposure(
        counts, rng.random(observation.shape) * ODD, sources, observation, seed, ODD * 1e-9
    )


def image_psf(*, negative=False):
    array = np.random.default_rng(2).random((5, 8))
    if negative:
        # Samples that nearly cancel: their sum is 1 to some 1e-12 only, however often scaled.
        array = 1e4 * (array - array.mean()) + 0.01
    return ImagePSF(array, ODD / 10, includes_pixel=True)


OBSERVATIONS = {
    "default": Observation(shape=(8, 8)),
    "not square, odd": Observation(shape=(5, 13)),
    "one pixel": Observation(shape=(1, 1)),
    "filters": Observation("FUV", ("NF1", "NF2"), exposure=ODD, shape=(4, 6)),
    "sky": Observation(shape=(4, 6), background=ODD * 1e-300),
    "detector": Observation(shape=(4, 6), detector=Detector(ODD * 1e-3, rollover=True)),
    "no sky": Observation(shape=(4, 6), background=0.0),
    "pointing": Observation(shape=(4, 6), pointing=SkyCoord(LENSES, -LENSES), roll=ODD),
    "galactic": Observation(shape=(4, 6), pointing=SkyCoord(ODD, 1, unit="deg", frame="galactic")),
    "pole": Observation(shape=(4, 6), pointing=SkyCoord(0, 90, unit="deg"), roll=-725.0),
    "telescope": Observation(shape=(4, 6), psf=TelescopePSF(1.7 * ODD, ODD, (1150.1, 1750), ODD)),
    "halo": Observation(
        shape=(4, 6), psf=TelescopePSF(1.7, 0.3, 2500.0, ODD, ODD / 3, ODD / 7, 3 * ODD)
    ),
    "one wavelength": Observation(shape=(4, 6), psf=TelescopePSF(1.7, 0.0, 2500 * ODD)),
    "gaussian": Observation(shape=(4, 6), psf=GaussianPSF(ODD)),
    "moffat": Observation(shape=(4, 6), psf=MoffatPSF(ODD, 2.5 + ODD)),
    "image": Observation(shape=(4, 6), psf=image_psf()),
    "image with negative samples": Observation(shape=(4, 6), psf=image_psf(negative=True)),
}
TABLES = {
    "galaxy": GALAXY,
    "empty": random_sources("point", 0),
    "stars": random_sources("point", 11, seed=3),
    "magnitudes": source("point", 1, 2, flux=(20 + ODD) * u.ABmag),
    "sersic beside a point": vstack([source("point", 1, 2), source("sersic", 3, 4, n=1 + ODD)]),
    "nan": source("point", 1, 2, r_half=np.nan, pa=np.nan, ellipticity=np.nan),
    "arcsec and radian": source("uniform", 1, 2, r_half=ODD * u.arcsec, pa=ODD * u.rad),
    "whole numbers": (t := source("point", 1, 2), t.replace_column("x", np.array([3])))[0],
}


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_every_observation_comes_back(tmp_path, name, compress):
    """Catches a field left out, stored in a card (which rounds), or scaled anew (PSF image)."""
    exposure = exposure_of(OBSERVATIONS[name])
    exposure.write(tmp_path / "x.fits", compress=compress)
    back = Exposure.read(tmp_path / "x.fits")
    assert back == exposure
    assert back.observation == exposure.observation
    assert back.counts.dtype == np.int64
    assert back.expected.dtype == np.float64
    assert back.expected.tobytes() == exposure.expected.tobytes()
    if isinstance(exposure.observation.psf, ImagePSF):
        assert back.observation.psf.array.tobytes() == exposure.observation.psf.array.tobytes()
        assert not back.observation.psf.array.flags.writeable


def test_the_psf_that_tests_scaling_does_so():
    psf = image_psf(negative=True)
    assert ImagePSF(psf.array, 1.0).array.tobytes() != psf.array.tobytes()


@pytest.mark.parametrize("name", TABLES)
def test_every_source_table_comes_back(tmp_path, name):
    """Catches units or AB magnitudes lost, floats of 32 bits, and NaN read as missing."""
    exposure = exposure_of(Observation(shape=(3, 4)), TABLES[name])
    exposure.write(tmp_path / "x.fits")
    back = Exposure.read(tmp_path / "x.fits")
    assert back == exposure
    for column in exposure.sources.colnames:
        before, after = exposure.sources[column], back.sources[column]
        assert getattr(before, "unit", None) == getattr(after, "unit", None)
        assert type(getattr(after, "unit", None)) is type(getattr(before, "unit", None))
        assert after.dtype.isnative


@settings(max_examples=10, deadline=None)
@given(
    exposure=st.floats(5e-324, 1e100),
    background=st.floats(0, 1e100),
    roll=st.floats(-1e6, 1e6),
    ra=st.floats(0, 359.999999),
    dec=st.floats(-90, 90),
    seed=st.integers(2**63, 2**80),
)
def test_any_float_comes_back(tmp_path_factory, exposure, background, roll, ra, dec, seed):
    """Catches a value that travels through decimal text or through 64-bit integers."""
    observation = Observation(
        exposure=exposure,
        background=background,
        roll=roll,
        pointing=SkyCoord(ra, dec, unit="deg"),
        shape=(2, 3),
    )
    path = tmp_path_factory.getbasetemp() / "any.fits"
    before = exposure_of(observation, seed=seed)
    before.write(path, overwrite=True)
    assert Exposure.read(path) == before


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize(
    ("brightest", "bitpix"), [(2**31 - 1, 32), (2**31, 64), (10**15, 64), (0, 32)]
)
def test_counts_are_whole_numbers_of_32_bits_or_64(tmp_path, brightest, bitpix, compress):
    """Catches counts that wrap round at 2^31, and lossy compression."""
    exposure = exposure_of(Observation(shape=(40, 30)), brightest=brightest)
    exposure.write(tmp_path / "x.fits", compress=compress)
    with fits.open(tmp_path / "x.fits") as hdus:
        assert isinstance(hdus[1], fits.CompImageHDU) == compress
        hdu = hdus["COUNTS"] if compress else hdus[0]
        assert hdu.header["BITPIX"] == bitpix
        assert "BZERO" not in hdu.header
        np.testing.assert_array_equal(hdu.data, exposure.counts)
    assert Exposure.read(tmp_path / "x.fits") == exposure


def test_compression_pays(tmp_path):
    exposure = exposure_of(Observation(shape=(256, 256)), brightest=3)
    for compress in (False, True):
        exposure.write(tmp_path / f"{compress}.fits", compress=compress)
    saved = (tmp_path / "False.fits").stat().st_size - (tmp_path / "True.fits").stat().st_size
    assert saved > 0.8 * 4 * 256**2


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("name", ["default", "pointing", "image"])
def test_the_file_is_sound_fits(tmp_path, name, compress):
    """Catches non-standard cards, and checksums taken before the last change."""
    exposure_of(OBSERVATIONS[name]).write(tmp_path / "x.fits", compress=compress)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with fits.open(tmp_path / "x.fits", checksum=True, disable_image_compression=True) as hdus:
            hdus.verify("exception")
            for hdu in hdus:
                assert "DATASUM" in hdu.header
                assert hdu.verify_checksum() == 1


@pytest.mark.parametrize("compress", [False, True])
def test_header_of_an_observatory(tmp_path, compress):
    observation = Observation("FUV", ("open", "NF1"), exposure=250.0, shape=(8, 12))
    exposure_of(observation).write(tmp_path / "x.fits", compress=compress)
    with fits.open(tmp_path / "x.fits") as hdus:
        for header in [hdus[0].header, hdus["COUNTS"].header if compress else hdus[0].header]:
            assert header["TELESCOP"] == "WSO-UV"
            assert header["INSTRUME"] == "ISSIS"
            assert header["CHANNEL"] == "FUV"
            assert (header["FILTER1"], header["FILTER2"]) == ("open", "NF1")
            assert header["EXPTIME"] == 250.0
            # the paper's 4.9e-3 cps/pixel and 3.36e15 cps, both through NF1 (0.1)
            assert header["SKYRATE"] == pytest.approx(4.9e-4)
            assert header["CPSFLUX"] == pytest.approx(3.36e14)
            assert "flat" in header.comments["CPSFLUX"]
            assert "CPSFLUX" not in " ".join(header["COMMENT"])
            assert header["SKYCOUNT"] == pytest.approx(4.9e-4 * 250)
            assert header["PSFASSUM"] is True
            assert "1.7 m" in header["PSFDESC"]
            assert "assumed" in " ".join(header["COMMENT"])
            assert header["SEED"] == 7
            assert header["CREATOR"].startswith("napari-issis 0.")
            assert len(header["DATE"]) == 19
        assert header["BUNIT"] == "ct"
        assert hdus["EXPECTED"].header["BUNIT"] == "ct"
        assert hdus["EXPECTED"].data.dtype == np.dtype(">f8")
        assert hdus["SOURCES"].columns["flux"].unit == "erg Angstrom-1 s-1 cm-2"


def test_a_given_psf_is_not_called_assumed(tmp_path):
    exposure_of(OBSERVATIONS["gaussian"]).write(tmp_path / "x.fits")
    header = fits.getheader(tmp_path / "x.fits")
    assert header["PSFASSUM"] is False
    assert header["PSFDESC"].startswith("Gaussian")
    assert "COMMENT" not in header


@pytest.mark.parametrize("extension", [0, "EXPECTED"])
def test_linear_coordinates(tmp_path, extension):
    """Catches the array index taken for the FITS pixel (off by one) and x growing rightwards."""
    exposure_of(Observation(shape=(11, 21))).write(tmp_path / "x.fits")
    wcs = WCS(fits.getheader(tmp_path / "x.fits", extension))
    assert list(wcs.wcs.ctype) == ["XOFFSET", "YOFFSET"]
    assert [str(unit) for unit in wcs.wcs.cunit] == ["arcsec", "arcsec"]
    # array index, 0-based: the centre of a frame of 21 x 11 pixels is (10, 5)
    assert wcs.pixel_to_world_values(10, 5) == pytest.approx((0, 0), abs=1e-12)
    assert wcs.pixel_to_world_values(9, 7) == pytest.approx((0.036, 0.072))


def sky_wcs(tmp_path, roll, *, alternate=" ", compress=False):
    observation = Observation(shape=(40, 64), pointing=SkyCoord(150.0, 60.0, unit="deg"), roll=roll)
    exposure_of(observation).write(tmp_path / "x.fits", compress=compress)
    header = fits.getheader(tmp_path / "x.fits", "COUNTS" if compress else 0)
    return WCS(header, key=alternate), observation.pointing


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize(
    ("roll", "north", "east"),
    [(0, (0, 1), (-1, 0)), (90, (1, 0), (0, 1)), (180, (0, -1), (1, 0)), (270, (-1, 0), (0, -1))],
)
def test_a_star_one_arcsec_north_or_east_falls_where_it_should(
    tmp_path, roll, north, east, compress
):
    """Catches CDELT1 > 0 (a mirrored sky) and a roll turned the wrong way (signs of PC).

    `roll` is the position angle of +y: at 90 degrees +y points east and +x north.
    """
    wcs, centre = sky_wcs(tmp_path, roll, compress=compress)
    middle = np.array([31.5, 19.5])
    np.testing.assert_allclose(centre.to_pixel(wcs), middle, atol=1e-6)
    for angle, direction in ((0, north), (90, east)):
        star = centre.directional_offset_by(angle * u.deg, 1 * u.arcsec)
        expected = middle + np.array(direction) / 0.036
        np.testing.assert_allclose(star.to_pixel(wcs), expected, atol=1e-3)


def test_roll_is_the_position_angle_of_the_y_axis(tmp_path):
    """Catches a roll counted clockwise, at an angle where no symmetry hides it."""
    wcs, centre = sky_wcs(tmp_path, 30.0)
    up = wcs.pixel_to_world(31.5, 29.5)
    assert centre.position_angle(up).deg == pytest.approx(30.0, abs=1e-3)
    assert centre.separation(up).arcsec == pytest.approx(10 * 0.036, rel=1e-6)
    assert wcs.wcs.radesys == "ICRS"


def test_offsets_stay_beside_the_sky_coordinates(tmp_path):
    wcs, _ = sky_wcs(tmp_path, 30.0, alternate="A")
    assert wcs.pixel_to_world_values(30.5, 20.5) == pytest.approx((0.036, 0.036))


# --- files that are not ours, or no longer whole ---


def sentence(error):
    text = str(error.value)
    assert "\n" not in text
    return text


def test_empty_file(tmp_path):
    path = tmp_path / "x.fits"
    path.write_bytes(b"")
    with pytest.raises(ValueError, match=r"x\.fits is empty") as error:
        Exposure.read(path)
    sentence(error)


@pytest.mark.parametrize("content", [b"hello\n", b"\x89PNG\r\n\x1a\n", b"\x1f\x8b\x08" + bytes(99)])
def test_other_formats(tmp_path, content):
    path = tmp_path / "x.fits"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"x\.fits is not a FITS file"):
        Exposure.read(path)


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"cannot read .*none\.fits: No such file"):
        Exposure.read(tmp_path / "none.fits")
    with pytest.raises(OSError, match="cannot read"):
        Exposure.read(tmp_path)


def test_foreign_fits(tmp_path):
    fits.PrimaryHDU(np.zeros((3, 4))).writeto(tmp_path / "x.fits")
    with pytest.raises(ValueError, match=r"x\.fits: .* no napari-issis exposure.*EXPECTED"):
        Exposure.read(tmp_path / "x.fits")


def edited(tmp_path, edit, **options):
    """Write an exposure, change its HDUs and return the new file's path."""
    exposure_of(Observation(shape=(6, 8))).write(tmp_path / "x.fits", **options)
    with fits.open(tmp_path / "x.fits", memmap=False) as hdus:
        edit(hdus)
        hdus.writeto(tmp_path / "y.fits", checksum=True)
    return tmp_path / "y.fits"


def test_a_card_added_by_another_tool_does_no_harm(tmp_path):
    path = edited(tmp_path, lambda hdus: hdus[0].header.set("OBJECT", "blend"))
    assert Exposure.read(path) == Exposure.read(tmp_path / "x.fits")


@pytest.mark.parametrize("name", ["EXPECTED", "SOURCES", "OBSERVATION"])
def test_missing_extension(tmp_path, name):
    path = edited(tmp_path, lambda hdus: hdus.pop(hdus.index_of(name)))
    with pytest.raises(ValueError, match=name):
        Exposure.read(path)


def test_newer_layout(tmp_path):
    def edit(hdus):
        hdus["OBSERVATION"].data["LAYOUT"] = 2

    with pytest.raises(ValueError, match="newer napari-issis"):
        Exposure.read(edited(tmp_path, edit))


def test_unknown_channel(tmp_path):
    def edit(hdus):
        hdus["OBSERVATION"].data["CHANNEL"] = "XUV"

    with pytest.raises(ValueError, match=r"y\.fits: channel is 'XUV'"):
        Exposure.read(edited(tmp_path, edit))


def test_wrong_shape(tmp_path):
    def edit(hdus):
        hdus["OBSERVATION"].data["NX"] = 9

    with pytest.raises(ValueError, match="PRIMARY is not an image of 9 x 6 pixels"):
        Exposure.read(edited(tmp_path, edit))


def test_float_counts(tmp_path):
    def edit(hdus):
        hdus[0].data = hdus[0].data + 0.5

    with pytest.raises(ValueError, match="PRIMARY holds values of type"):
        Exposure.read(edited(tmp_path, edit))


def test_broken_source(tmp_path):
    def edit(hdus):
        hdus["SOURCES"].data["flux"] = -1.0

    with pytest.raises(ValueError, match=r"y\.fits: row 0, flux: -1 is not allowed"):
        Exposure.read(edited(tmp_path, edit))


def test_damaged_data(tmp_path):
    """Catches a flipped bit that would pass for data."""
    path = tmp_path / "x.fits"
    exposure = exposure_of(Observation(shape=(64, 64)))
    exposure.write(path)
    content = bytearray(path.read_bytes())
    at = bytes(content).index(exposure.expected[9].astype(">f8").tobytes())
    content[at] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"x\.fits: the data of EXPECTED do not match"):
        Exposure.read(path)


@pytest.mark.parametrize("compress", [False, True])
def test_truncated_at_any_length(tmp_path, compress):
    path = tmp_path / "x.fits"
    exposure_of(OBSERVATIONS["image"]).write(path, compress=compress)
    whole = path.read_bytes()
    for length in [*range(1, len(whole), 2880 // 2), len(whole) - 1]:
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError, match=r"x\.fits") as error:
            Exposure.read(path)
        sentence(error)


def test_mutated_files_raise_nothing_but_value_errors(tmp_path):
    """Catches an exception of astropy's, or a warning, that reaches the user."""
    path = tmp_path / "x.fits"
    exposure_of(OBSERVATIONS["image"]).write(path, compress=True)
    whole = path.read_bytes()
    rng = np.random.default_rng(5)
    refusals = []
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(150):
            content = bytearray(whole)
            for at in rng.integers(0, len(content), 4):
                content[at] = rng.integers(0, 256)
            path.write_bytes(content)
            try:
                Exposure.read(path)
            except ValueError as error:
                refusals.append(str(error))
    assert len(refusals) > 30
    assert all(str(path) in refusal for refusal in refusals)


# --- writing: the old file or the new one, never half ---


def test_existing_file_needs_overwrite(tmp_path):
    path = tmp_path / "x.fits"
    path.write_text("mine")
    exposure = exposure_of(Observation(shape=(3, 4)))
    with pytest.raises(FileExistsError, match=r"x\.fits exists already.*overwrite=True"):
        exposure.write(path)
    assert path.read_text() == "mine"
    exposure.write(path, overwrite=True)
    assert Exposure.read(path) == exposure
    assert os.listdir(tmp_path) == ["x.fits"]


@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "No space left"), KeyboardInterrupt()])
@pytest.mark.parametrize("where", ["write", "fsync", "replace"])
def test_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, where, failure):
    """Catches writing into the target itself, and a temporary file left behind."""
    path = tmp_path / "x.fits"
    path.write_text("mine")

    def fail(*args, **kwargs):
        raise failure

    def write_half(hdus, file, **kwargs):
        file.write(b"SIMPLE  =" * 1000)
        raise failure

    if where == "write":
        monkeypatch.setattr(fits.HDUList, "writeto", write_half)
    else:
        monkeypatch.setattr(os, where, fail)
    expected = OSError if isinstance(failure, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as error:
        exposure_of(Observation(shape=(3, 4))).write(path, overwrite=True)
    if expected is OSError:
        assert sentence(error) == (
            f"cannot write {path}: No space left; free some space or choose another disk."
        )
    assert path.read_text() == "mine"
    assert os.listdir(tmp_path) == ["x.fits"]


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is a POSIX signal")
def test_killed_while_writing(tmp_path):
    """Catches a target that is opened for writing before its content is complete."""
    path = tmp_path / "x.fits"
    old = exposure_of(Observation(shape=(3, 4)))
    old.write(path)
    program = (
        "import os, sys, time, numpy as np\n"
        "from napari_issis import Exposure, Observation, random_sources\n"
        "os.fsync = lambda descriptor: time.sleep(60)\n"
        "image = np.zeros((64, 64))\n"
        "Exposure(image.astype(int), image, random_sources('point', 0),\n"
        "         Observation(shape=(64, 64)), 0).write(sys.argv[1], overwrite=True)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", program, str(path)])
    deadline = time.monotonic() + 20
    while not list(tmp_path.glob(".*.part")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert Exposure.read(path) == old


def test_unwritable_targets(tmp_path, monkeypatch):
    exposure = exposure_of(Observation(shape=(3, 4)))
    (tmp_path / "folder.fits").mkdir()
    with pytest.raises(IsADirectoryError, match=r"folder\.fits: it is a directory"):
        exposure.write(tmp_path / "folder.fits", overwrite=True)
    with pytest.raises(FileNotFoundError, match="none does not exist"):
        exposure.write(tmp_path / "none" / "x.fits")
    with pytest.raises(ValueError, match=r"x\.txt: the name must end in \.fits"):
        exposure.write(tmp_path / "x.txt")

    def refuse(*args, **kwargs):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)
    with pytest.raises(OSError, match=r"cannot write .*x\.fits: Permission denied; choose"):
        exposure.write(tmp_path / "x.fits")
    assert os.listdir(tmp_path) == ["folder.fits"]


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX permissions")
def test_permissions_and_links_are_kept(tmp_path):
    """Catches the private mode of temporary files on the result, and a link replaced by a file."""
    exposure = exposure_of(Observation(shape=(3, 4)))
    (tmp_path / "plain").write_text("")
    exposure.write(tmp_path / "new.fits")
    assert (tmp_path / "new.fits").stat().st_mode == (tmp_path / "plain").stat().st_mode
    (tmp_path / "new.fits").chmod(0o640)
    (tmp_path / "link.fits").symlink_to("new.fits")
    exposure.write(tmp_path / "link.fits", overwrite=True)
    assert (tmp_path / "link.fits").is_symlink()
    assert (tmp_path / "new.fits").stat().st_mode & 0o777 == 0o640


def test_what_cannot_be_stored_is_named(tmp_path):
    path = tmp_path / "x.fits"
    table = GALAXY.copy()
    table["note"] = np.array([{"a": 1}], dtype=object)
    with pytest.raises(ValueError, match="column note is neither numbers nor text"):
        exposure_of(Observation(shape=(3, 4)), table).write(path)

    class OwnPSF(GaussianPSF):
        pass

    with pytest.raises(ValueError, match="OwnPSF cannot be stored"):
        exposure_of(Observation(shape=(3, 4), psf=OwnPSF(0.1))).write(path)
    assert not path.exists()


def test_tables_of_objects_holding_text_are_text():
    table = GALAXY.copy()
    table["kind"] = np.array(["exponential"], dtype=object)
    assert read_table(table_hdu(table, "SOURCES"))["kind"][0] == "exponential"


@pytest.mark.parametrize("text", ["α Cen", "two\nlines", "\\u03b1", "𝛼", "plain"])
def test_text_of_any_alphabet_comes_back(text):
    """FITS knows ASCII only: catches names refused, changed, or escaped once too often."""
    table = GALAXY.copy()
    table["name"], table[f"of {text}"] = [text], [1.5] * u.arcsec
    back = read_table(table_hdu(table, "SOURCES"))
    assert back.colnames == table.colnames
    assert back["name"][0] == text
    assert back[f"of {text}"][0] == 1.5 * u.arcsec
    assert back["kind"][0] == "exponential"

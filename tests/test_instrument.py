"""Cameras as data: files, what is wrong with them, and what an observation makes of them."""

import pickle
import warnings
from dataclasses import replace
from itertools import pairwise

import astropy.units as u
import numpy as np
import pytest
from astropy.io import fits
from astropy.wcs import WCS
from scipy.integrate import quad

import napari_issis as ni
from napari_issis.facts import STATUSES, facts_of
from napari_issis.instruments import ISSIS
from napari_issis.limits import count_rate_warnings
from napari_issis.source_rates import cps_per_flux

# CODATA 2018 and SI, erg angstrom
HC = 6.62607015e-27 * 2.99792458e18

CAMERA = """
name = "Mine"
telescope = "Balloon"
[sources]
LAB = "measured in the laboratory"
[all_channels]
pixel_scale = { value = 0.1, unit = "arcsec / pix", status = "measured", source = "LAB" }
detector_size = { value = [300, 400], unit = "pix", status = "measured", source = "LAB" }
frame_sizes = { value = [64, 256], unit = "pix", status = "assumed", source = "mine" }
diameter = { value = 0.5, unit = "m", status = "measured", source = "LAB" }
dark = { value = 1e-3, unit = "ct / (s pix)", status = "measured", source = "LAB" }
[channels.A]
band = { value = [1900, 3000], unit = "Angstrom", status = "measured", source = "LAB" }
effective_area = { value = [100, 400, 50], unit = "cm2", status = "measured", source = "LAB" }
area_wavelength = { value = [1900, 2200, 3100], unit = "AA", status = "measured", source = "LAB" }
local_limit = { value = 5, unit = "ct / (s pix)", status = "assumed", source = "safe" }
[channels.B]
band = { value = [1200, 1700], unit = "Angstrom", status = "measured", source = "LAB" }
cps_per_flux = { value = 2e15, unit = "ct cm2 Angstrom / erg", status = "measured", source = "LAB" }
pixel_scale = { value = 0.2, unit = "arcsec / pix", status = "measured", source = "LAB" }
[filters.grey]
transmittance = { value = 0.25, status = "measured", source = "LAB" }
[filters.red]
wavelength = { value = [2500, 2600, 3000], unit = "Angstrom", status = "measured", source = "LAB" }
transmission = { value = [0, 0.9, 0.7], status = "measured", source = "LAB" }
"""


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CAMERA)
    return path


@pytest.fixture
def mine(path):
    return ni.Instrument.read(path)


def area(wavelength):
    return np.interp(wavelength, [1900, 2200, 3100], [100, 400, 50])


def red(wavelength):
    return np.interp(wavelength, [2500, 2600, 3000], [0, 0.9, 0.7], left=0, right=0)


def integral(function, low=1900.0, high=3000.0):
    knots = [low, 2200.0, 2500.0, 2600.0, high]
    return sum(quad(function, a, b, epsrel=1e-12)[0] for a, b in pairwise(knots))


def test_issis_has_the_papers_numbers():
    """Table of the paper; the rest is what the program has always had."""
    nuv, fuv = ISSIS.channels["NUV"], ISSIS.channels["FUV"]
    assert (nuv.band, nuv.cps_per_flux) == ((1850.0, 3200.0), 1.14e17)
    assert (fuv.band, fuv.cps_per_flux) == ((1150.0, 1750.0), 3.36e15)
    assert (nuv.sky.total, nuv.sky.earthshine_and_zodiacal) == (3.5e-4, 2.1e-5)
    assert (fuv.sky.total, fuv.sky.earthshine_and_zodiacal) == (4.9e-3, 7.2e-12)
    for one in (nuv, fuv):
        assert (one.pixel_scale, one.detector_size, one.dark) == (0.036, (2048, 2048), 0.0)
        assert one.frame_sizes == (256, 512, 1024, 2048)
        assert (one.local_limit, one.total_limit) == (22.0, 2e5)
        assert one.dead_time == ni.Detector.losing().dead_time
    assert nuv.psf == ni.TelescopePSF(1.7, 0.33, band=(1850, 3200), blur_fwhm=0.0888)
    assert fuv.psf == ni.TelescopePSF(1.7, 0.33, band=(1150, 1750), blur_fwhm=0.0945)
    assert ISSIS.neutral_filters == {"open": 1.0, "NF1": 0.1, "NF2": 0.01}
    assert ISSIS.default_channel == "NUV"


@pytest.mark.parametrize("name", ni.INSTRUMENTS)
def test_each_camera_of_the_program_works_and_says_where_its_numbers_are_from(name):
    observation = ni.Observation(instrument=name, shape=(32, 32))
    camera = observation.instrument
    for thing in (*camera.channels.values(), *camera.filters.values()):
        facts = facts_of(thing)
        assert facts
        assert all(one.status in STATUSES and one.source for one in facts.values())
        assert not any("script" in one.source for one in facts.values())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ni.CountRateWarning)
        exposure = ni.simulate(ni.source("point", 16, 16, flux=1e-15), observation)
    light = exposure.expected - exposure.background
    whole = 1e-15 * observation.cps_per_flux * 100
    assert 0.4 * whole < light.sum() < whole


def test_sbc_has_the_light_of_the_handbook():
    """28 % within 0.1 arcsec at 1216 A, by the pixels of a fine image and not by our integral."""
    psf = replace(ni.Observation(instrument="ACS/SBC").effective_psf, band=1216.0)
    fine = replace(ISSIS.channels["NUV"], pixel_scale=0.004)
    camera = replace(ISSIS, channels={"NUV": fine})
    observation = ni.Observation(instrument=camera, psf=psf, shape=(31, 31))
    rate = ni.count_rate(ni.source("point", 15, 15), observation) / (1e-14 * 1.14e17)
    y, x = np.mgrid[:31, :31] - 15.0
    # pixels on the rim count by their area within, sampled 20 x 20
    step = (np.arange(20) - 9.5) / 20
    inside = np.mean([np.hypot(y + dy, x + dx) <= 12.5 for dy in step for dx in step], axis=0)
    assert (inside * rate).sum() == pytest.approx(0.28, abs=0.003)


def test_a_camera_from_a_file(mine):
    assert (mine.name, mine.telescope, mine.default_channel) == ("Mine", "Balloon", "A")
    a, b = mine.channels["A"], mine.channels["B"]
    assert (a.pixel_scale, b.pixel_scale) == (0.1, 0.2)
    assert a.detector_size == (300, 400)
    assert (a.local_limit, b.local_limit) == (5.0, None)
    assert mine.filter_names == ("open", "grey", "red")
    fact = facts_of(b)["pixel_scale"]
    assert (fact.value, fact.unit, fact.status, fact.source) == (
        *(0.2, "arcsec / pix", "measured"),
        "LAB",
    )
    observation = ni.Observation(instrument=mine)
    assert (observation.channel, observation.pixel_scale, observation.dark_rate) == ("A", 0.1, 1e-3)
    assert observation.replace(channel="B").pixel_scale == 0.2


def test_count_rates_follow_the_effective_area(mine):
    """Quadrature of int A T F lambda dlambda / (h c), the curves written down again here."""
    observation = ni.Observation(instrument=mine)
    assert observation.cps_per_flux == pytest.approx(integral(lambda w: area(w) * w) / HC, rel=1e-9)
    pivot = np.sqrt(integral(lambda w: area(w) * w) / integral(lambda w: area(w) / w))
    assert observation.pivot == pytest.approx(pivot, rel=1e-9)
    behind = observation.replace(filters=("red", "grey"))
    rate = 0.25 * integral(lambda w: area(w) * red(w) * w) / HC
    assert behind.cps_per_flux == pytest.approx(rate, rel=1e-9)


def test_spectra_follow_the_effective_area(mine):
    """A power law normalised at 2500 A, and one by its mean in the band, against quadrature."""
    observation = ni.Observation(instrument=mine, filters=("red", "open"), shape=(64, 64))

    def light(wavelength):
        return area(wavelength) * (wavelength / 2500) ** -2 * wavelength

    passed = integral(lambda w: light(w) * red(w)) / HC
    mean = integral(light) / integral(lambda w: area(w) * w)
    for spectrum, unit in (("powerlaw(-2, at=2500)", 1.0), ("powerlaw(-2)", mean)):
        rate = cps_per_flux(spectrum, observation)
        assert rate == pytest.approx(passed / unit, rel=1e-8)


def test_a_line_of_the_sky_is_counted_with_the_area_there(mine):
    """[O II] 2471 at the high level: 3.0e-15 erg s-1 cm-2 arcsec-2 on pixels of 0.1 arcsec."""
    sky = ni.Sky("none", "none", "high")
    rate = ni.Observation(instrument=mine, sky=sky).sky_components["[O II] 2471"]
    assert rate == pytest.approx(0.1**2 * 3.0e-15 * area(2471.0) * 2471.0 / HC, rel=1e-9)


def test_the_pixel_scale_is_that_of_the_camera(mine):
    """Pixels and PSF twice as large in arcsec make the same picture; radii in arcsec do not."""
    twice = replace(ISSIS.channels["NUV"], pixel_scale=0.072)
    camera = replace(ISSIS, channels={"NUV": twice})
    one = ni.source("exponential", 20.3, 18.1, r_half=4.0, ellipticity=0.4)
    large = ni.Observation(instrument=camera, shape=(40, 40), psf=ni.GaussianPSF(0.2))
    small = ni.Observation(shape=(40, 40), psf=ni.GaussianPSF(0.1))
    np.testing.assert_allclose(ni.count_rate(one, large), ni.count_rate(one, small), atol=1e-9)
    angle = ni.source("exponential", 20.3, 18.1, r_half=0.288 * u.arcsec, ellipticity=0.4)
    np.testing.assert_allclose(ni.count_rate(angle, large), ni.count_rate(one, large), atol=1e-9)
    assert ni.Observation(sky=ni.Sky(), instrument=camera).sky_rate == pytest.approx(
        4 * ni.Observation(sky=ni.Sky()).sky_rate
    )


def test_equality_and_hash(mine, path):
    again = ni.Instrument.read(path)
    first, second = ni.Observation(instrument=mine), ni.Observation(instrument=again)
    assert first == second
    assert hash(first) == hash(second)
    assert pickle.loads(pickle.dumps(first)) == first
    assert ni.Observation() == ni.Observation(instrument=ISSIS) == ni.Observation("NUV", dark=0.0)
    other = replace(mine, channels={**mine.channels, "A": replace(mine.channels["A"], dark=0.0)})
    assert ni.Observation(instrument=other) != first
    assert ni.Observation(instrument=other, dark=1e-3) != first
    named = replace(
        ISSIS, filters={**ISSIS.filters, "NF1": replace(ISSIS.filters["NF1"], transmittance=0.2)}
    )
    assert ni.Observation(instrument=named) != ni.Observation()
    assert ni.Observation(instrument=named, filters=("NF1", "open")).transmittance == 0.2
    with pytest.raises(ValueError, match=r"instrument is 'Hubble'; known: ISSIS.*Instrument.read"):
        ni.Observation(instrument="Hubble")


def test_another_camera_keeps_what_it_has(mine):
    before = ni.Observation("FUV", ("NF1", "N1550"), exposure=7.0, shape=(64, 32))
    after = before.replace(instrument=mine)
    assert (after.channel, after.filters) == ("A", ("open", "open"))
    assert (after.exposure, after.shape, after.sky) == (7.0, (64, 32), ni.Sky())
    assert before.replace(instrument="FCU").filters == ("open", "open")
    # a default gives way to a default, a sky that was chosen stays
    assert after.replace(instrument="ISSIS").sky == before.sky == ni.SKIES["CIS"]
    low = ni.Sky(zodiacal="low")
    assert before.replace(sky=low).replace(instrument=mine).replace(instrument="ISSIS").sky == low
    sbc = before.replace(instrument="ACS/SBC", filters=("F140LP", "open"))
    assert sbc.channel == "FUV"
    assert 0 < sbc.transmittance < 0.8
    with pytest.raises(ValueError, match=r"sky is CIS.*Mine has none"):
        ni.Observation(instrument=mine, sky=ni.SKIES["CIS"])


def test_a_sky_beyond_the_tables_is_not_guessed(mine):
    red_end = replace(mine.channels["B"], band=(3000.0, 4000.0))
    camera = replace(mine, channels={"B": red_end}, default_channel="B")
    with pytest.raises(
        ValueError, match=r"known from 1000 to 3200 A, and B is 3000 to 4000 A; give"
    ):
        ni.Observation(instrument=camera)
    assert ni.Observation(instrument=camera, background=0.1).sky_rate == 0.1


def test_limits_are_those_of_the_camera(mine):
    rate = np.full((4, 4), 6.0)
    (message,) = count_rate_warnings(rate, 0.0, observation=ni.Observation(instrument=mine))
    assert "more than 5 cps" in message
    assert "the detector of Mine" in message
    assert message.endswith("The neutral filter grey would cure it.")
    assert (
        count_rate_warnings(rate * 1e6, 0.0, observation=ni.Observation("B", instrument=mine)) == []
    )


# ------------------------------------------------------------------------------ files


@pytest.mark.parametrize("name", ni.INSTRUMENTS)
def test_written_cameras_are_read_bit_for_bit(name, tmp_path):
    camera = ni.Observation(instrument=name).instrument
    camera.write(tmp_path / "copy.toml")
    again = ni.Instrument.read(tmp_path / "copy.toml")
    assert again == camera
    assert again.sources == camera.sources
    assert again.psf_note == camera.psf_note
    for ours, theirs in zip(camera.channels.values(), again.channels.values(), strict=True):
        assert facts_of(ours) == facts_of(theirs)
    with pytest.raises(FileExistsError):
        camera.write(tmp_path / "copy.toml")


def test_a_number_set_in_a_script_has_no_false_origin(mine, tmp_path):
    changed = replace(mine.channels["B"], diameter=0.7)
    assert facts_of(changed)["diameter"].status == "assumed"
    assert facts_of(changed)["pixel_scale"].status == "measured"
    camera = replace(mine, channels={"B": changed}, default_channel="B")
    camera.write(tmp_path / "changed.toml")
    fact = facts_of(ni.Instrument.read(tmp_path / "changed.toml").channels["B"])["diameter"]
    assert (fact.value, fact.source) == (0.7, "set in a script")


def test_names_and_notes_of_any_text(mine, tmp_path):
    odd = replace(
        mine,
        name='a "b" \\ [c] = #',
        filters={'x."y"]': replace(mine.filters["grey"], name='x."y"]')},
    )
    odd.write(tmp_path / "odd.toml")
    assert ni.Instrument.read(tmp_path / "odd.toml") == odd


def changed(old, new):
    assert CAMERA.count(old) >= 1
    return CAMERA.replace(old, new, 1)


DIAMETER = 'diameter = { value = 0.5, unit = "m"'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (changed('name = "Mine"', ""), 'name is missing; add name = "'),
        (changed('name = "Mine"', "name = 3"), "name is 3; it must be a text"),
        (changed('"Mine"', '"Ü"'), "name is 'Ü'; it must be one line of .* ASCII"),
        (changed("telescope", "telescop"), "the file has the unknown key 'telescop'; did you mean"),
        (changed("dark =", "darkness ="), "all_channels has the unknown key 'darkness'; did you"),
        (
            changed(DIAMETER, 'diameter = { value = -1.0, unit = "m"'),
            r"all_channels.diameter: value is -1.0; it must be a number \(m\), above 0 and at",
        ),
        (changed(DIAMETER, 'diameter = { value = nan, unit = "m"'), "diameter: value is nan; it"),
        (changed(DIAMETER, 'diameter = { value = inf, unit = "m"'), "diameter: value is inf; it"),
        (changed(DIAMETER, 'diameter = { value = 1e6, unit = "m"'), "diameter: value is 1000000.0"),
        (changed(DIAMETER, 'diameter = { value = "0.5", unit = "m"'), "diameter: value is '0.5'"),
        (changed(DIAMETER, 'diameter = { value = true, unit = "m"'), "diameter: value is True"),
        (
            changed(DIAMETER, 'diameter = { value = [0.5], unit = "m"'),
            r"diameter: value is \[0.5\]",
        ),
        (changed(DIAMETER, "diameter = { value = 1" + 5000 * "0" + ', unit = "m"'), "no TOML file"),
        (changed(DIAMETER, "diameter = { value = 1" + 400 * "0" + ', unit = "m"'), "value is 1000"),
        (
            changed(DIAMETER, 'diameter = { value = 500, unit = "mm"'),
            "diameter: unit is 'mm'; convert the number to 'm'",
        ),
        (changed(DIAMETER, "diameter = { value = 0.5"), "diameter has no unit; write { value"),
        (changed(DIAMETER + ', status = "measured"', DIAMETER), "diameter has no status; write"),
        (
            changed('m", status = "measured"', 'm", status = "sure"'),
            "status is 'sure'; known: pap",
        ),
        (
            changed('m", status = "measured", source = "LAB"', 'm", status = "measured"'),
            "diameter has no source",
        ),
        (
            changed(
                'diameter = { value = 0.5, unit = "m", status = "measured", source = "LAB" }',
                "diameter = 0.5",
            ),
            "diameter is 0.5; write a number with its origin, { value",
        ),
        (
            changed(
                'diameter = { value = 0.5, unit = "m", status = "measured", source = "LAB" }', ""
            ),
            r"channels.A has no diameter; add it there or in \[all_channels\]: diameter = { value",
        ),
        (
            changed("[1900, 3000]", "[3000, 1900]"),
            "channels.A.band: value has 1900 behind 3000; the numbers must rise, the lower",
        ),
        (changed("[1900, 3000]", "[1900]"), "band: value has 1 numbers; it must be two numbers"),
        (
            changed("[300, 400]", "[300.5, 400]"),
            "detector_size: value is 300.5; it must be a? ?two",
        ),
        (changed("[64, 256]", "[64, 512]"), "frame_sizes: value has 512, and the longer side"),
        (changed("[100, 400, 50]", "[100, 400]"), "effective_area: value has 2 numbers and area_w"),
        (
            changed("[1900, 2200, 3100]", "[1950, 2200, 3100]"),
            "area_wavelength: value reaches from 1950 to 3100 A; it must hold the band, 1900",
        ),
        (changed("[100, 400, 50]", "[0, 0, 0]"), "effective_area: value is 0 throughout"),
        (
            CAMERA[: CAMERA.index("cps_per")]
            + CAMERA[CAMERA.index("pixel_scale = { value = 0.2") :],
            "channels.B.cps_per_flux is missing; give it or effective_area",
        ),
        (changed("value = 0.25", "value = 1.25"), "filters.grey.transmittance: value is 1.25; it"),
        (
            changed("transmission = ", "transmissions = "),
            "filters.red has wavelength, transmissions",
        ),
        (changed("[0, 0.9, 0.7]", "[0, 0.9]"), "filters.red.* 3 wavelengths and 2 transmissions"),
        (
            changed("[filters.grey]", "[filters.open]"),
            "filters.open: every wheel has an open place",
        ),
        (changed("[channels.A]", "[channels.A").replace("[channels.B]", ""), "is no TOML file: "),
        (CAMERA.split("[channels.A]")[0], "there is no channel; add a table"),
        (changed("[sources]", "sources = 1\n[x]"), "the file has the unknown key 'x'; known: name"),
        ("a = " + 20000 * "[", "is no TOML file"),
        ("", "name is missing"),
        ("\x00", "is no TOML file"),
    ],
)
def test_what_is_wrong_is_named(text, message, tmp_path):
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"(?s)wrong\.toml.*({message})") as caught:
        ni.Instrument.read(path)
    assert len(str(caught.value)) < 500


def test_files_that_are_no_cameras(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(ValueError, match=r"a\.toml is not UTF-8 text \(byte 8\)"):
        ni.Instrument.read(tmp_path / "a.toml")
    (tmp_path / "b.toml").write_bytes(2**20 * b"#" + b"##")
    with pytest.raises(ValueError, match="more than 1048576 bytes"):
        ni.Instrument.read(tmp_path / "b.toml")
    with pytest.raises(FileNotFoundError):
        ni.Instrument.read(tmp_path / "c.toml")


# ------------------------------------------------------------------------------ exposures


def test_an_exposure_brings_its_camera_along(mine, path, tmp_path):
    observation = ni.Observation("B", ("grey", "open"), shape=(20, 30), instrument=mine)
    exposure = ni.simulate(ni.source("point", 9, 8, flux=1e-14), observation)
    exposure.write(tmp_path / "x.fits")
    path.unlink()
    again = ni.Exposure.read(tmp_path / "x.fits")
    assert again == exposure
    assert again.observation.instrument == mine
    assert facts_of(again.observation.channel_data) == facts_of(mine.channels["B"])
    header = fits.getheader(tmp_path / "x.fits")
    assert (header["TELESCOP"], header["INSTRUME"], header["PIXSCALE"]) == ("Balloon", "Mine", 0.2)
    assert header["DARKRATE"] == 1e-3
    wcs = WCS(header)
    assert wcs.pixel_to_world_values(13.5, 10.5) == pytest.approx((0.2, 0.2))


def test_files_without_a_stored_camera_still_read(tmp_path):
    """As all were that older versions wrote."""
    exposure = ni.simulate(ni.source("point", 9, 8), ni.Observation(shape=(20, 30)))
    exposure.write(tmp_path / "x.fits")
    with fits.open(tmp_path / "x.fits") as hdus:
        assert "INSTRUMENT" in hdus
        del hdus["INSTRUMENT"]
        hdus.writeto(tmp_path / "old.fits")
    assert ni.Exposure.read(tmp_path / "old.fits") == exposure


@pytest.mark.parametrize(
    ("hdu", "message"),
    [
        (fits.ImageHDU(np.frombuffer(b"name = 1", np.uint8)), "extension INSTRUMENT: name is 1"),
        (fits.ImageHDU(np.zeros((2, 2), np.uint8)), "INSTRUMENT holds no text"),
        (fits.ImageHDU(np.zeros(5)), "INSTRUMENT holds no text"),
        (fits.BinTableHDU.from_columns([fits.Column("A", "J", array=[1])]), "holds no text"),
    ],
)
def test_a_broken_stored_camera(hdu, message, tmp_path):
    ni.simulate(ni.source("point", 9, 8), ni.Observation(shape=(9, 9))).write(tmp_path / "x.fits")
    hdu.name = "INSTRUMENT"
    with fits.open(tmp_path / "x.fits") as hdus:
        hdus[hdus.index_of("INSTRUMENT")] = hdu
        hdus.writeto(tmp_path / "broken.fits")
    with pytest.raises(ValueError, match=message):
        ni.Exposure.read(tmp_path / "broken.fits")


def test_a_camera_on_the_command_line(path, tmp_path, capsys):
    from napari_issis.cli import main

    output = tmp_path / "x.fits"
    words = ["simulate", "blend", "--instrument", str(path), "--frame", "32", "--channel", "B"]
    assert main([*words, "--filters", "grey", "open", "--output", str(output)]) == 0
    observation = ni.Exposure.read(output).observation
    assert (observation.instrument.name, observation.pixel_scale) == ("Mine", 0.2)
    assert observation.filters == ("grey", "open")
    for wrong, message in (
        (["--instrument", "Hubble"], "instrument is 'Hubble'; known: ISSIS"),
        (["--instrument", "FCU", "--filters", "NF1", "open"], "filter is 'NF1'; known: open"),
        (["--channel", "X"], "channel is 'X'; known: FUV, NUV"),
    ):
        with pytest.raises(SystemExit):
            main(["simulate", "blend", *wrong, "--output", str(tmp_path / "y.fits")])
        assert message in capsys.readouterr().err


def test_an_image_as_a_source_has_its_size_in_the_cameras_pixels(mine):
    """Samples of 0.2 arcsec on pixels of 0.1: 20 samples apart are 40 pixels apart."""
    samples = np.zeros((31, 31))
    samples[15, 5] = samples[15, 25] = 1.0
    one = ni.image_source(samples, 32, 32, 1e-14, pixel_scale=0.2, frame_pixel_scale=0.1)
    observation = ni.Observation(instrument=mine, shape=(65, 65), psf=ni.GaussianPSF(0.3))
    row = ni.count_rate(one, observation)[32]
    peaks = [int(np.argmax(row[:32])), 32 + int(np.argmax(row[32:]))]
    assert peaks == [12, 52]

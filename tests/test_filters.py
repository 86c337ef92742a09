"""Filters with a response: what they pass, and what they are read from."""

import warnings

import astropy.units as u
import numpy as np
import pytest
from astropy.io import fits
from astropy.table import QTable, Table
from scipy.integrate import quad

import napari_issis as ni
from napari_issis.instruments import ISSIS

BAND = {"FUV": (1150.0, 1750.0), "NUV": (1850.0, 3200.0)}
RATIO = {"FUV": 3.36e15, "NUV": 1.14e17}
# a lopsided curve inside the NUV: 0 at 2000, 0.6 at 2400, 0.3 at 2500, cut there
KNOTS = [2000.0, 2400.0, 2500.0]
VALUES = [0.0, 0.6, 0.3]
CURVE = ni.Filter("odd", KNOTS, VALUES)


def curve(w):
    """The same by hand."""
    if not 2000 <= w <= 2500:
        return 0.0
    return 0.6 * (w - 2000) / 400 if w < 2400 else 0.6 - 0.3 * (w - 2400) / 100


def integral(function, low=2000.0, high=2500.0, points=(2400.0,)):
    return quad(function, low, high, points=points, epsrel=1e-11)[0]


def test_rate_of_a_flat_spectrum():
    """int T l dl / int l dl over the channel: catches a mean of T, and a mean of T over dl / l."""
    expected = integral(lambda w: curve(w) * w) / (0.5 * (3200**2 - 1850**2))
    observation = ni.Observation(filters=("open", CURVE))
    assert observation.transmittance == pytest.approx(expected, rel=1e-10)
    assert observation.cps_per_flux == pytest.approx(1.14e17 * expected, rel=1e-10)


@pytest.mark.parametrize(
    ("channel", "name", "cps", "pivot"),
    [
        ("NUV", "N2500", 4.2719204e15, 2499.478265),
        ("FUV", "N1550", 3.0584622e14, 1549.148303),
        ("FUV", "LP1370", 1.831499e15, 1556.0731),
    ],
)
def test_as_synphot_has_it(channel, name, cps, pivot):
    """Count rate of 1 FLAM and pivot of the same curve by synphot 1.8.0, in steps of 0.1 A.

    There: SpectralElement(Empirical1D) of the curve within the band, an area of 76.71791 or
    664.33393 cm2, Observation(ConstFlux1D).countrate and pivot().
    """
    observation = ni.Observation(channel, (name, "open"))
    assert observation.cps_per_flux == pytest.approx(cps, rel=3e-6)
    assert observation.pivot == pytest.approx(pivot, rel=3e-7)


def test_a_given_background_passes_as_a_flat_spectrum():
    """Catches a background that no curve reduces."""
    observation = ni.Observation(filters=("NF1", CURVE), background=0.2)
    expected = integral(lambda w: curve(w) * w) / (0.5 * (3200**2 - 1850**2))
    assert observation.sky_rate == pytest.approx(0.2 * 0.1 * expected, rel=1e-10, abs=0)


def test_two_curves_multiply():
    """Catches the product of the two transmittances in place of that of the curves."""
    other = ni.Filter("step", [2299.0, 2300.0, 3500.0], [0.0, 1.0, 1.0])
    passed = integral(lambda w: curve(w) * w * np.clip(w - 2299, 0, 1), 2299, 2500, (2300, 2400))
    expected = passed / (0.5 * (3200**2 - 1850**2))
    for filters in ((CURVE, other), (other, CURVE)):
        observation = ni.Observation(filters=filters)
        assert observation.transmittance == pytest.approx(expected, rel=1e-10)
    dimmed = ni.Observation(filters=(CURVE, "NF2"))
    assert dimmed.transmittance == pytest.approx(
        0.01 * ni.Observation(filters=(CURVE, "open")).transmittance, rel=1e-14
    )
    assert dimmed.neutral_transmittance == 0.01


def test_pivot_wavelength():
    """sqrt(int T l dl / int T / l dl): catches the channel's own pivot, and a mean wavelength."""
    expected = np.sqrt(integral(lambda w: curve(w) * w) / integral(lambda w: curve(w) / w))
    observation = ni.Observation(filters=(CURVE, "NF1"))
    assert observation.pivot == pytest.approx(expected, rel=1e-10)


def test_magnitudes_are_those_behind_the_filter():
    """A star of 20 AB mag: catches a conversion at the unfiltered pivot, 15 % off."""
    observation = ni.Observation(filters=(CURVE, "open"), shape=(64, 64), psf=ni.GaussianPSF(0.1))
    star = ni.source("point", 32, 32, 20 * u.ABmag)
    photons = 10 ** (-0.4 * 68.6) * 2.99792458e18  # F_nu c
    area = 1.14e17 * 1.98644586e-8 / (0.5 * (3200**2 - 1850**2))
    expected = area * photons * integral(lambda w: curve(w) / w) / 1.98644586e-8
    assert ni.count_rate(star, observation).sum() == pytest.approx(expected, rel=1e-4)


def test_effective_area():
    """77 and 664 cm2 from the paper's ratios: catches an energy ratio taken for photons."""
    for channel, expected in (("FUV", 76.7), ("NUV", 664.3)):
        band = ni.Observation(channel).passband
        assert band.area == pytest.approx(expected, abs=0.05)
        low, high = BAND[channel]
        assert band.effective_area([low - 1, low, high, high + 1]) == pytest.approx(
            [0, band.area, band.area, 0]
        )
    band = ni.Observation(filters=("open", CURVE)).passband
    assert band.effective_area(2200.0) == pytest.approx(0.3 * 664.3, rel=1e-4)


def test_the_psf_follows_the_band():
    """A rectangle keeps its limits, a bell its mean and spread; a given PSF stays.

    Catches a PSF of the whole channel: its diffraction at 1150 A is not that at 1700 A.
    """
    edges = ni.Filter("box", [1449.999, 1450, 1600, 1600.001], [0, 0.7, 0.7, 0])
    observation = ni.Observation("FUV", (edges, "NF1"))
    own = ni.Observation("FUV").effective_psf
    psf = observation.effective_psf
    assert psf.band == pytest.approx((1450, 1600), abs=0.01)
    assert (psf.diameter, psf.obscuration, psf.blur_fwhm) == (
        own.diameter,
        own.obscuration,
        own.blur_fwhm,
    )
    narrow = ni.Observation("FUV", ("N1550", "open")).effective_psf
    spread = np.sqrt(3) * 120 / 2.3548
    assert narrow.band == pytest.approx((1550 - spread, 1550 + spread), abs=0.2)
    moffat = ni.MoffatPSF(0.1, 3)
    assert observation.replace(psf=moffat).effective_psf is moffat
    low, high = ni.Observation("FUV", ("LP1480", "open")).effective_psf.band
    assert low == pytest.approx(1480, abs=2)
    assert high <= 1750


def test_a_line_passes_at_its_wavelength_and_a_continuum_over_the_band():
    """Catches a filter that dims the whole sky alike."""
    sky = ni.Sky("none", "high", "high")
    open_ = ni.Observation(sky=sky).sky_components
    observation = ni.Observation(sky=sky, filters=(CURVE, "NF1"))
    behind = observation.sky_components
    assert observation.sky_rate == pytest.approx(sum(behind.values()), rel=1e-12, abs=0)
    line = 0.6 - 0.3 * 0.71  # at 2471 A
    assert behind["[O II] 2471"] == pytest.approx(0.1 * line * open_["[O II] 2471"], rel=1e-10)
    at = np.arange(1800.0, 3300.0, 100.0)
    high = "1.53 2.25 3.58 12.3 22.1 18.1 18.3 25.3 30.6 101 28.8 208 125 150 230"
    zodiacal = np.array([1e-20 * float(text) for text in high.split()])
    area = 1.14e17 / (0.5 * (3200**2 - 1850**2))
    expected = 0.036**2 * 0.1 * area
    expected *= integral(
        lambda w: curve(w) * np.interp(w, at, zodiacal) * w, points=(2100, 2200, 2300, 2400)
    )
    assert behind["zodiacal light"] == pytest.approx(expected, rel=1e-8, abs=0)


def test_a_long_pass_blocks_lyman_alpha():
    """The geocorona of all skies goes, the papers too; catches constants that only scale."""
    for sky in (*ni.SKIES.values(), ni.Sky("high", "high", "high")):
        observation = ni.Observation("FUV", ("LP1370", "open"), sky=sky)
        assert observation.sky_rate < 1e-3 * observation.replace(filters=("open",) * 2).sky_rate
        assert observation.cps_per_flux > 0.5 * 3.36e15


def test_the_papers_sky_behind_a_curve():
    """Lines in proportion to their high fluxes: catches a geocorona that is Ly-alpha alone."""
    block = ni.Filter("no Ly-alpha", [1249, 1250, 1300, 1308, 1800], [0, 1, 1, 0.5, 0.5])
    parts = ni.Observation("FUV", (block, "open")).sky_components
    passed = (0.75 * 5.7e-14 + 0.5 * 5.0e-15) / (6.1e-13 + 5.7e-14 + 5.0e-15)
    assert parts["geocorona"] == pytest.approx((4.9e-3 - 7.2e-12) * passed, rel=1e-10, abs=0)


@pytest.mark.parametrize("name", ISSIS.filter_curves)
def test_illustrative_filters_work_by_name(name):
    channel = "NUV" if name in ("N2500", "LP2600") else "FUV"
    named = ni.Observation(channel, (name, "open"))
    given = ni.Observation(channel, ("open", ISSIS.filter_curves[name]))
    assert 0 < named.transmittance < 1
    assert named.transmittance == given.transmittance
    assert named.filter_names == (name, "open")
    low, high = BAND[channel]
    assert low <= named.pivot <= high
    wavelength = float(name.lstrip("NLP"))
    assert (
        abs(ISSIS.filter_curves[name](wavelength) - (0.4 if "LP" in name else named_peak(name)))
        < 0.01
    )


def named_peak(name):
    return ISSIS.filter_curves[name].transmission.max()


def test_curves_render_and_neutral_filters_do_not():
    """The rate behind curve and NF1 is a tenth of that behind the curve, bit for bit.

    Catches a rate rendered without the curve.
    """
    from napari_issis.exposure import noise_ready_rate

    observation = ni.Observation(filters=(CURVE, "open"), shape=(32, 32))
    star = ni.source("point", 16, 16, 1e-15)
    rate, _ = noise_ready_rate(star, observation)
    passed = integral(lambda w: curve(w) * w) / (0.5 * (3200**2 - 1850**2))
    assert rate.sum() == pytest.approx(1e-15 * 1.14e17 * passed, rel=0.05)
    assert np.array_equal(
        noise_ready_rate(star, observation.replace(filters=(CURVE, "NF1")))[0], rate * 0.1
    )
    assert observation.without_neutral_filters() == observation
    both = ni.Observation(filters=("NF1", CURVE)).without_neutral_filters()
    assert both.filters == ("open", CURVE)


def test_equal_and_hashable_by_content():
    again = ni.Filter("odd", KNOTS[::-1], VALUES[::-1])
    assert again == CURVE
    assert hash(again) == hash(CURVE)
    assert ni.Observation(filters=(again, "open")) == ni.Observation(filters=(CURVE, "open"))
    assert ni.Filter("even", KNOTS, VALUES) != CURVE
    assert ni.Filter("odd", KNOTS, [0.0, 0.6, 0.2]) != CURVE
    with pytest.raises(ValueError, match="read-only"):
        CURVE.transmission[0] = 1.0


def test_the_callers_array_stays_writable():
    wavelength = np.array(KNOTS)
    ni.Filter("odd", wavelength, VALUES)
    wavelength[0] = 1.0


@pytest.mark.parametrize(
    ("wavelength", "transmission", "message"),
    [
        ([2000, 2100], [0.1, 1.2], "transmission 1.2; it must lie between 0 and 1"),
        ([2000, 2100], [-0.1, 0.2], "transmission -0.1"),
        ([2000, 2100, 2050], [0, 1, 0], "one direction at 2050 A"),
        ([2000, 2000], [0, 1], "one direction at 2000 A"),
        ([2000], [1], "1 wavelengths and 1 transmissions"),
        ([2000, 2100], [1], "2 wavelengths and 1 transmissions"),
        ([2000, np.nan], [0, 1], "wavelength is nan in row 1"),
        ([2000, 2100], [0, np.inf], "transmission is inf in row 1"),
        ([-2000, 2100], [0, 1], "wavelength -2000 A"),
        ([2000, 2100], [0, 0], "passes nothing"),
        ([[2000, 2100]], [[0, 1]], "2 dimensions"),
        (["a", "b"], [0, 1], "wavelength holds something that is no number"),
        ([2000, 2100] * u.s, [0, 1], "wavelength is in s"),
    ],
)
def test_bad_curves_are_named(wavelength, transmission, message):
    with pytest.raises(ValueError, match=message):
        ni.Filter("bad", wavelength, transmission)


@pytest.mark.parametrize("name", ["", " ", "Ly\N{GREEK SMALL LETTER ALPHA}", "a\nb"])
def test_bad_names_are_named(name):
    with pytest.raises(ValueError, match="printable ASCII"):
        ni.Filter(name, KNOTS, VALUES)


def test_filters_that_pass_nothing_of_the_channel():
    """A curve in nm taken for angstrom, one of the other channel, two that exclude each other."""
    with pytest.raises(ValueError, match="nm passes nothing of NUV, 1850 to 3200 A"):
        ni.Observation(filters=(ni.Filter("nm", [200, 250], [1, 1]), "open"))
    with pytest.raises(ValueError, match="N1215 passes nothing of NUV"):
        ni.Observation(filters=("open", "N1215"))
    with pytest.raises(ValueError, match="N1215 and LP1480 pass nothing of FUV"):
        ni.Observation("FUV", ("N1215", "LP1480"))


TABLES = {
    "unit": lambda: QTable({"Wavelength": KNOTS * u.AA, "Throughput": VALUES}),
    "nm": lambda: QTable({"wave": np.array(KNOTS) / 10 * u.nm, "trans": VALUES}),
    "per cent": lambda: QTable(
        {
            "LAMBDA": KNOTS * u.AA,
            "note": ["a", "b", "c"],
            "TRANSMISSION": np.array(VALUES) * 100 * u.percent,
        }
    ),
    "descending": lambda: QTable({"wl": KNOTS[::-1] * u.AA, "transmittance": VALUES[::-1]}),
}


@pytest.mark.parametrize("ending", [".ecsv", ".fits"])
@pytest.mark.parametrize("kind", TABLES)
def test_read_with_units(kind, ending, tmp_path):
    path = tmp_path / f"odd{ending}"
    TABLES[kind]().write(path)
    made = ni.Filter.read(path)
    assert made.name == "odd"
    assert made.wavelength == pytest.approx(KNOTS, rel=1e-12)
    assert made.transmission == pytest.approx(VALUES, rel=1e-12)
    assert ni.Filter.read(path, "other").name == "other"


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("wavelength_nm,transmission", 10),
        ("wavelength (nm),transmission", 10),
        ("Wavelength[Angstrom],T_ignored,Throughput", 1),
        ("wavelength_A,transmission_%", 1),
        ("lambda um,trans", 1e4),
        ("wave(AA),transmission", 1),
    ],
)
def test_read_csv_with_units_in_the_names(header, scale, tmp_path):
    percent = 100 if "%" in header else 1
    extra = ",7" if header.count(",") == 2 else ""
    lines = [f"{w / scale!r}{extra},{t * percent!r}" for w, t in zip(KNOTS, VALUES, strict=True)]
    path = tmp_path / "odd.csv"
    path.write_text("\n".join([header, *lines]) + "\n")
    made = ni.Filter.read(path)
    assert made.wavelength == pytest.approx(KNOTS, rel=1e-12)
    assert made.transmission == pytest.approx(VALUES, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wavelength,transmission\n2000,0\n2100,1\n", "wavelength has no unit; .* wavelength_nm"),
        ("wavelength_nm,blue\n200,0\n210,1\n", "no column transmission .* wavelength_nm, blue"),
        ("x,transmission\n200,0\n210,1\n", "no column wavelength"),
        ("wavelength_parsec2,transmission\n200,0\n210,1\n", "unknown unit|in pc2|is in"),
        ("wavelength_nm,transmission\n200,\n210,1\n", "transmission has an empty cell"),
        ("wavelength_nm,transmission\n200,a\n210,1\n", "transmission holds something"),
        ("wavelength_nm,transmission\nb,0\n210,1\n", "wavelength_nm does not hold numbers"),
        ("wavelength_nm,transmission\n200,0\n210,90\n", "transmission 90; .* unit %"),
        ("wavelength_nm,transmission\n", "0 wavelengths"),
        ("", "is empty"),
    ],
)
def test_bad_files_are_named(text, message, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        ni.Filter.read(path)
    assert "bad.csv" in str(caught.value)


def test_files_that_are_no_tables(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"cannot read .*none\.csv"):
        ni.Filter.read(tmp_path / "none.csv")
    with pytest.raises(OSError, match="cannot read"):
        ni.Filter.read(tmp_path / "none.fits")
    (tmp_path / "curve.txt").write_text("2000 1\n")
    with pytest.raises(ValueError, match="no ECSV, CSV or FITS file"):
        ni.Filter.read(tmp_path / "curve.txt")
    (tmp_path / "curve.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="no text file"):
        ni.Filter.read(tmp_path / "curve.csv")
    ni.simulate(ni.random_sources("point", 0), ni.Observation(shape=(2, 2))).write(
        tmp_path / "exposure.fits"
    )
    with pytest.raises(ValueError, match="no column wavelength"):
        ni.Filter.read(tmp_path / "exposure.fits")


OBSERVATIONS = {
    "curve": ni.Observation(filters=("NF1", CURVE), shape=(3, 4)),
    "two curves": ni.Observation(
        filters=(ni.Filter("NF1", [1900.1, 0.1 + 3000], [1 / 3, 0.1 + 0.2]), CURVE), shape=(3, 4)
    ),
    "named curve": ni.Observation("FUV", ("N1550", "open"), shape=(3, 4)),
    "levels": ni.Observation(sky=ni.Sky("extreme", "none", "low"), shape=(3, 4)),
    "latitude": ni.Observation(sky=ni.Sky(galactic_latitude=-15 - 1 / 3), shape=(3, 4)),
    "overridden": ni.Observation(sky=ni.SKIES["HST low"], background=0.1, shape=(3, 4)),
}


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("name", OBSERVATIONS)
def test_fits_keeps_sky_and_filters(name, compress, tmp_path):
    """Catches a sky or a curve that comes back as the default, or as a name only."""
    made = ni.simulate(ni.source("point", 1, 1, 1e-15), OBSERVATIONS[name])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.write(tmp_path / "x.fits", compress=compress)
    read = ni.Exposure.read(tmp_path / "x.fits")
    assert read == made
    assert read.observation.sky == made.observation.sky
    assert read.observation.filters == made.observation.filters
    table = Table.read(tmp_path / "x.fits", hdu="OBSERVATION")
    assert table["FILTER1"][0] == made.observation.filter_names[0]


def test_the_header_says_what_is_illustrative(tmp_path):
    empty = ni.random_sources("point", 0)
    for filters, said in (
        (("N2500", "open"), ["FILTER1"]),
        (("LP2600", "LP2600"), ["FILTER1", "FILTER2"]),
        (("NF1", CURVE), []),
    ):
        made = ni.simulate(empty, ni.Observation(filters=filters, shape=(2, 2)))
        made.write(tmp_path / "x.fits", overwrite=True)
        comments = "".join(fits.getheader(tmp_path / "x.fits")["COMMENT"])
        named = [
            name for name in ("FILTER1", "FILTER2") if f"{name}: This filter is ill" in comments
        ]
        assert named == said


@pytest.mark.parametrize("fault", ["column", "image", "value", "sky"])
def test_broken_curves_in_fits(fault, tmp_path):
    observation = ni.Observation(filters=(CURVE, "open"), sky=ni.Sky(), shape=(2, 2))
    ni.simulate(ni.random_sources("point", 0), observation).write(tmp_path / "x.fits")
    with fits.open(tmp_path / "x.fits") as hdus:
        for hdu in hdus:
            hdu.add_datasum()
        if fault == "column":
            hdus["FILTER1"].columns.change_name("WAVELENGTH", "W")
        elif fault == "image":
            hdus["FILTER1"] = fits.ImageHDU(np.zeros((2, 2)), name="FILTER1")
        elif fault == "value":
            hdus["FILTER1"].data["TRANSMISSION"][0] = 3
        else:
            hdus["OBSERVATION"].data["GEOCORONA"] = "bright"
        hdus.writeto(tmp_path / "y.fits", checksum=True)
    message = {
        "value": "filter odd has the transmission 3",
        "sky": "geocorona is 'bright'",
    }.get(fault, "extension FILTER1 holds no filter curve")
    with pytest.raises(ValueError, match=message):
        ni.Exposure.read(tmp_path / "y.fits")


def test_an_unknown_sky_is_not_written(tmp_path):
    class Mine:
        def components(self, channel, passband):
            return {"mine": 1.0}

        def rate(self, channel, passband):
            return 1.0

    observation = ni.Observation(sky=Mine(), shape=(2, 2))
    assert observation.sky_rate == 1.0
    made = ni.simulate(ni.random_sources("point", 0), observation)
    with pytest.raises(ValueError, match="sky of type Mine cannot be stored"):
        made.write(tmp_path / "x.fits")
    assert not (tmp_path / "x.fits").exists()

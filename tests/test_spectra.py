"""Spectra of sources: count rates behind filters, normalisation, text, files."""

from itertools import pairwise

import astropy.units as u
import numpy as np
import pytest
import synphot
from astropy.io import fits
from astropy.table import QTable, vstack
from scipy.integrate import quad
from synphot.models import BlackBodyNorm1D, Empirical1D, Gaussian1D, PowerLawFlux1D

import napari_issis as ni
from napari_issis.bright_sources import bright_sources
from napari_issis.instruments import ISSIS
from napari_issis.source_counts import expected_counts
from napari_issis.source_rates import cps_per_flux
from napari_issis.spectra import BlackBody, Line, PowerLaw, TableSpectrum

BAND = {"FUV": (1150.0, 1750.0), "NUV": (1850.0, 3200.0)}
RATIO = {"FUV": 3.36e15, "NUV": 1.14e17}
HC = 1.98644586e-8
WIEN = 1.438776877e8


def by_quadrature(shape, channel, name=None, at=None, points=()):
    """Counts of 1 erg s-1 cm-2 A-1 by adaptive quadrature, piece by piece of the filter."""
    low, high = BAND[channel]
    knots = [low, high, *points]
    curve = ISSIS.filter_curves[name] if name else None
    if curve:
        knots += curve.wavelength.tolist()
    knots = np.unique([knot for knot in knots if low <= knot <= high])

    def integral(passed):
        return sum(quad(lambda w: passed(w) * w, a, b, epsrel=1e-11)[0] for a, b in pairwise(knots))

    def through(w):
        return shape(w) * np.interp(w, curve.wavelength, curve.transmission, left=0.0, right=0.0)

    flat = 0.5 * (high**2 - low**2)
    unit = integral(shape) / flat if at is None else shape(at)
    return RATIO[channel] * integral(through if curve else shape) / flat / unit


CASES = [
    ("powerlaw(-1.5)", lambda w: w**-1.5, None, ()),
    ("powerlaw(2.5, at=5500)", lambda w: w**2.5, 5500.0, ()),
    ("blackbody(30000 K)", lambda w: w**-5 / np.expm1(WIEN / w / 3e4), None, ()),
    (
        "blackbody(9000, z=1.7, at=1500)",
        lambda w: w**-5 / np.expm1(2.7 * WIEN / w / 9e3),
        1500.0,
        (),
    ),
    (
        "line(1000, 20, z=0.5)",
        lambda w: np.exp(-4 * np.log(2) * ((w - 1500.0) / 30) ** 2),
        1500.0,
        (1380.0, 1440.0, 1500.0, 1560.0, 1620.0),
    ),
]


@pytest.mark.parametrize("name", [None, "N1550", "LP1370"])
@pytest.mark.parametrize(("text", "shape", "at", "points"), CASES, ids=[case[0] for case in CASES])
def test_rates_by_hand(text, shape, at, points, name):
    """Catches energy for photon counting, (1 + z) on the wrong side, a FWHM taken for sigma."""
    observation = ni.Observation("FUV", ("open" if name is None else name, "NF1"))
    neutral = ni.Observation("FUV", ("open", "NF1")).neutral_transmittance
    expected = neutral * by_quadrature(shape, "FUV", name, at, points)
    assert cps_per_flux(text, observation) == pytest.approx(expected, rel=1e-9)


SYNPHOT = [
    ("powerlaw(-1.5, z=1.7)", (PowerLawFlux1D, {"amplitude": 1, "x_0": 2000, "alpha": 1.5}), 1.7),
    ("blackbody(25000 K, z=0.3)", (BlackBodyNorm1D, {"temperature": 25000}), 0.3),
]


@pytest.mark.parametrize("reddening", [0.0, 0.2])
@pytest.mark.parametrize(("text", "model", "z"), SYNPHOT, ids=[case[0] for case in SYNPHOT])
def test_as_synphot_has_it(text, model, z, reddening):
    """Catches a rate, redshift or extinction that another program computes differently.

    synphot's photon flux density is converted to F_lambda by itself; sampling is 0.1 A. The
    extinction is the formula of Fitzpatrick (1999) by dust_extinction.
    """
    from dust_extinction.parameter_averages import F99

    kind, values = model
    if "alpha" in values:
        values = {**values, "amplitude": values["amplitude"] * synphot.units.FLAM}
    wave = np.arange(1150.0, 1750.05, 0.1) * u.AA
    spectrum = synphot.SourceSpectrum(kind, z=z, z_type="wavelength_only", **values)
    flux = spectrum(wave, flux_unit=synphot.units.FLAM).value
    flux = flux * F99(Rv=3.1).extinguish(wave, Ebv=reddening) if reddening else flux
    flux = flux / flux.max() * 1e-14
    at = wave.value
    source = synphot.SourceSpectrum(
        Empirical1D, points=wave, lookup_table=flux * synphot.units.FLAM
    )
    curve = ISSIS.filter_curves["N1550"]
    passed = np.interp(at, curve.wavelength, curve.transmission, left=0.0, right=0.0)
    filtered = synphot.SpectralElement(Empirical1D, points=wave, lookup_table=passed)
    observed = synphot.Observation(source, filtered, binset=wave)
    rate = observed.countrate(area=76.71791 * u.cm**2, binned=False).value
    mean = np.trapezoid(flux * at, at) / np.trapezoid(at, at)
    text = text[:-1] + (f", ebv={reddening})" if reddening else ")")
    ours = cps_per_flux(text, ni.Observation("FUV", ("N1550", "open")))
    assert ours * mean == pytest.approx(rate, rel=1e-5)


def test_a_line_has_its_photons():
    """A line of 1e-13 erg/s/cm2 at 1550 A: area x photons; catches a Gaussian's wrong area."""
    line = Line(wavelength=1550.0, fwhm=4.0)
    rate = line.peak_of(1e-13) * cps_per_flux(line, ni.Observation("FUV"))
    area = RATIO["FUV"] * HC / (0.5 * (1750.0**2 - 1150.0**2))
    assert rate == pytest.approx(1e-13 * 1550.0 / HC * area, rel=1e-6)
    far = Line(wavelength=1000.0, fwhm=4.0, z=0.55)
    assert far.peak_of(1e-13) == pytest.approx(line.peak_of(1e-13) / 1.55, abs=0)
    assert cps_per_flux("line(2500, 10)", ni.Observation("FUV")) == 0.0


def test_flat_is_bit_for_bit_what_it_was():
    """Catches a flat spectrum that goes through the quadrature, or a mixed table that does."""
    table = ni.random_sources("point", 50, shape=(64, 64), seed=1, flux=(1e-16, 1e-14))
    for filters in (("open", "open"), ("N2500", "NF1")):
        observation = ni.Observation(filters=filters, shape=(64, 64))
        plain = ni.count_rate(table, observation)
        for text in ("flat", "", "  FLAT "):
            named = table.copy()
            named["spectrum"] = [text] * len(table)
            assert np.array_equal(ni.count_rate(named, observation), plain)
            assert np.array_equal(
                expected_counts(named, observation), expected_counts(table, observation)
            )
        named["spectrum"] = ["flat"] * 49 + ["blackbody(30000)"]
        before, after = expected_counts(table, observation), expected_counts(named, observation)
        assert np.array_equal(before[:49], after[:49])


def test_without_filters_all_spectra_count_alike():
    """The flux is the mean over the band; catches a mean without the photons' wavelength."""
    for text in ("powerlaw(-4)", "blackbody(2e4, z=0.2, ebv=0.3)", "flat(ebv=1)"):
        for channel in ("NUV", "FUV"):
            observation = ni.Observation(channel)
            assert cps_per_flux(text, observation) == observation.cps_per_flux


def test_rate_image_counts_and_limits_follow(tmp_path):
    """Catches a consumer of fluxes that forgot the spectrum."""
    observation = ni.Observation("NUV", ("N2500", "open"), shape=(65, 65))
    text = "powerlaw(-5)"
    flux = 4e-13
    table = vstack(
        [
            ni.source("gaussian", 32, 32, flux, 2.0, 0.0, 0.0),
            ni.source("gaussian", 32, 32, flux, 2.0, 0.0, 0.0, spectrum=PowerLaw(-5.0)),
        ]
    )
    ratio = by_quadrature(lambda w: w**-5.0, "NUV", "N2500") / by_quadrature(
        lambda w: 1.0, "NUV", "N2500"
    )
    assert abs(ratio - 1) > 0.1
    counts = expected_counts(table, observation)
    assert counts[1] / counts[0] == pytest.approx(ratio, rel=1e-9)
    images = [ni.count_rate(table[[row]], observation) for row in (0, 1)]
    assert images[1].sum() / images[0].sum() == pytest.approx(ratio, rel=1e-5)
    snr = ni.signal_to_noise(table, observation)
    assert snr[1] / snr[0] == pytest.approx(ratio**0.5, rel=0.05)
    assert str(table["spectrum"][1]) == text
    # of equal fluxes in the same pixel the line has a hundredth of the counts
    both = vstack(
        [
            ni.source("point", 32, 32, 1e-12),
            ni.source("point", 32, 32, 1e-12, spectrum="line(2500, 1)"),
        ]
    )
    rate = ni.count_rate(both, observation)
    assert rate.max() > 22
    assert bright_sources(both, observation, rate).tolist() == [0]


def test_magnitudes_are_those_where_the_flux_is_given():
    """20 AB mag at 1500 A: catches a conversion at the channel's or a filter's pivot."""
    observation = ni.Observation("NUV", ("N2500", "open"))
    f_nu = 10 ** (-0.4 * (20 + 48.6))
    for text, wavelength in (("powerlaw(-1, at=1500)", 1500.0), ("blackbody(2e4)", None)):
        table = ni.source("point", 1, 1, 20 * u.ABmag, spectrum=text)
        if wavelength is None:
            # pivot of a constant area: l^2 = (h^2 - l^2) / 2 / ln(h / l)
            low, high = BAND["NUV"]
            wavelength = (0.5 * (high**2 - low**2) / np.log(high / low)) ** 0.5
        flux = f_nu * 2.99792458e18 / wavelength**2
        expected = flux * cps_per_flux(text, observation) * observation.exposure
        assert expected_counts(table, observation)[0] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    "text",
    [
        "powerlaw(-1.5, z=1.7, ebv=0.05)",
        "blackbody(30000 K)",
        "line(1550 A, 10 A, at=1551.25)",
        "flat(ebv=0.1)",
    ],
)
def test_text_and_spectrum_are_one(text):
    """Catches digits or options lost between a spectrum and its text."""
    spectrum = ni.parse_spectrum(text)
    assert str(spectrum) == text
    assert ni.parse_spectrum(str(spectrum)) == spectrum


def test_digits_are_kept():
    """Catches rounding in the text."""
    for value in (np.pi, 1e-7 / 3, -2.0):
        assert ni.parse_spectrum(str(PowerLaw(value))).index == value
    assert ni.parse_spectrum("BlackBody( temperature = 3e4K , at=1500A )") == BlackBody(
        3e4, at=1500.0
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("powerlow(1)", r"'powerlow\(1\)' is unknown; known: flat, powerlaw"),
        ("powerlaw", "index is missing"),
        ("powerlaw(x)", "index is 'x'; it must be a number"),
        ("powerlaw(nan)", "index is 'nan'; it must be a number"),
        ("powerlaw(1, 2)", "'2' is too much"),
        ("powerlaw(1,)", "missing beside a comma"),
        ("powerlaw(1, z=1, z=2)", "z is given twice"),
        ("powerlaw(1, y=1)", "y is unknown; known: z, ebv and at"),
        ("powerlaw(1, ebv=-1)", r"ebv is -1; it must be in \[0, 10\]"),
        ("powerlaw(1, ebv=1, at=500)", r"at is 500; it must be in \[1000, 33000\]"),
        ("blackbody(10 eV)", "temperature is in eV; it must be in K"),
        ("blackbody(1e400)", "temperature is inf"),
        ("line(1550, 10, at=3000)", "hardly any light at 3000 A"),
        ("table(nowhere.ecsv)", "cannot read nowhere.ecsv: No such file"),
        ("__import__('os')", "is unknown"),
        ("flat" + 1000 * "(", "1004 characters; 1000 at most"),
    ],
)
def test_errors_name_the_row(text, reason):
    """Catches a wrong spectrum that is taken for another, and an error without its row."""
    table = vstack([ni.source("point", 1, 1), ni.source("point", 1, 1, spectrum="flat")])
    table["spectrum"] = ["flat", text]
    with pytest.raises(ValueError, match=rf"^row 1, spectrum: .*{reason}"):
        ni.count_rate(table, ni.Observation(shape=(8, 8)))


def write_table(path, header="wavelength_nm,flux"):
    path.write_text(f"{header}\n" + "".join(f"{w / 10},{w - 1000}\n" for w in (1000, 2000)))
    return path


def test_spectra_in_files(tmp_path):
    """Catches nm for angstrom, the redshift forgotten, and a stale file."""
    path = write_table(tmp_path / "a star.csv")
    observation = ni.Observation("FUV", ("N1550", "open"))
    text = f'table("{path}", z=0.1)'
    expected = by_quadrature(lambda w: max(w / 1.1 - 1000, 0.0), "FUV", "N1550")
    assert cps_per_flux(text, observation) == pytest.approx(expected, rel=1e-9)
    assert str(ni.parse_spectrum(text)) == text
    path.write_text("wavelength_A,flux\n1000,1\n2500,1\n")
    flat = by_quadrature(lambda w: 1.0, "FUV", "N1550")
    assert cps_per_flux(text, observation) == pytest.approx(flat, rel=1e-9)
    # per frequency: F_nu constant is F_lambda as l^-2, between close samples
    wave = np.linspace(1000, 2000, 2001)
    QTable({"wavelength": wave * u.AA, "flux": np.ones(2001) * u.mJy}).write(tmp_path / "nu.ecsv")
    ours = cps_per_flux(TableSpectrum(str(tmp_path / "nu.ecsv")), observation)
    assert ours == pytest.approx(by_quadrature(lambda w: w**-2.0, "FUV", "N1550"), rel=1e-6)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("wavelength_A,flux\n1000,1\n", "two wavelengths or more"),
        ("wavelength_A,flux\n1000,1\n3000,-1\n", "flux -1; it must be"),
        ("wavelength_A,flux\n1000,0\n3000,0\n", "no light"),
        ("wavelength_A,flux\n1000,1\n1000,1\n", "run in one direction"),
        ("wavelength,flux\n1000,1\n3000,1\n", "has no unit"),
        ("wavelength_A,light\n1000,1\n3000,1\n", "no column flux"),
        ("wavelength_K,flux\n1000,1\n3000,1\n", "not in Angstrom"),
    ],
)
def test_broken_files_are_named(tmp_path, content, reason):
    """Catches a table that is no spectrum, taken for one."""
    path = tmp_path / "broken.csv"
    path.write_text(content)
    with pytest.raises(ValueError, match=f"broken.csv.*{reason}"):
        ni.source("point", 1, 1, spectrum=f"table({path})")


@pytest.mark.parametrize("suffix", ["ecsv", "csv", "fits", "vot"])
def test_files_keep_spectra(tmp_path, suffix):
    """Catches a column that a format loses, cuts or quotes wrongly."""
    star = write_table(tmp_path / "a, b.csv")
    texts = ["", "powerlaw(-1.5, z=1.7, ebv=0.05)", f'table("{star}")', "line(2500, 10)"]
    table = ni.random_sources("point", 4, shape=(64, 64), seed=1, flux=(1e-16, 1e-14))
    table["spectrum"] = texts
    ni.write_sources(table, tmp_path / f"t.{suffix}")
    catalogue = ni.read_catalogue(tmp_path / f"t.{suffix}")
    assert [str(text) for text in catalogue.sources["spectrum"]] == texts
    assert not catalogue.notes


def test_exposures_keep_spectra(tmp_path):
    """Catches a saved exposure whose sources come back flat."""
    table = ni.source("point", 8, 8, spectrum="blackbody(30000 K)")
    exposure = ni.simulate(table, ni.Observation(shape=(16, 16), filters=("N2500", "open")))
    exposure.write(tmp_path / "e.fits")
    back = ni.Exposure.read(tmp_path / "e.fits")
    assert list(back.sources["spectrum"]) == ["blackbody(30000 K)"]
    # the header's conversion is that of a flat spectrum, and says so
    header = fits.getheader(tmp_path / "e.fits")
    assert "CPSFLUX holds for a flat spectrum" in " ".join(header["COMMENT"])
    assert np.array_equal(back.counts, exposure.counts)


def test_numbers_in_a_foreign_column_are_kept_apart(tmp_path):
    """Catches a catalogue's number of a spectrum taken for a spectrum."""
    path = tmp_path / "c.csv"
    path.write_text("x,y,flux,spectrum\n1,2,1e-15,17\n")
    table = ni.read_sources(path)
    assert table["spectrum_catalogue"][0] == 17
    assert "spectrum" not in table.colnames


def test_masked_is_flat():
    """Two tables joined, one without spectra: catches a mask read as text."""
    joined = vstack([ni.source("point", 1, 1), ni.source("point", 1, 1, spectrum="line(2500, 9)")])
    counts = expected_counts(joined, ni.Observation())
    assert counts[0] == expected_counts(ni.source("point", 1, 1), ni.Observation())[0]
    assert counts[1] < counts[0]


def test_synphot_line():
    """The line's rate against synphot's Gaussian in steps of 0.05 A."""
    wave = np.arange(1150.0, 1750.02, 0.05)
    sigma = 10 / np.sqrt(8 * np.log(2))
    flux = Gaussian1D(amplitude=1.0, mean=1550.0, stddev=sigma)(wave) * 1e-14
    source = synphot.SourceSpectrum(
        Empirical1D, points=wave * u.AA, lookup_table=flux * synphot.units.FLAM
    )
    box = synphot.SpectralElement(Empirical1D, points=wave * u.AA, lookup_table=np.ones(wave.size))
    rate = synphot.Observation(source, box, binset=wave * u.AA).countrate(
        area=76.71791 * u.cm**2, binned=False
    )
    ours = 1e-14 * cps_per_flux("line(1550, 10)", ni.Observation("FUV"))
    assert ours == pytest.approx(rate.value, rel=1e-4)

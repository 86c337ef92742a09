"""The sky by components, against handbook numbers and sums made here."""

import numpy as np
import pytest

import napari_issis as ni
from napari_issis.exposure import accuracy_for_counts
from napari_issis.instruments import ISSIS
from napari_issis.sky import CIS, HIGH_ORBIT, paper_estimate
from napari_issis.sky_tables import EARTHSHINE_HIGH, LINES, WAVELENGTH, ZODIACAL_HIGH

PIXEL = 0.036**2  # arcsec2
RATIO = {"FUV": 3.36e15, "NUV": 1.14e17}
BAND = {"FUV": (1150.0, 1750.0), "NUV": (1850.0, 3200.0)}
# What the paper prints: all, and earthshine with zodiacal light, cps per pixel.
PAPER = {"FUV": (4.9e-3, 7.2e-12), "NUV": (3.5e-4, 2.1e-5)}
HC = 1.98644586e-8  # erg angstrom
# Fourth column of STIS Instrument Handbook, Table 6.4: the sum, as the handbook rounds it.
TOTAL = (
    "2.41e-23 4.38e-22 4.03e-23 1.40e-24 2.98e-24 1.01e-23 2.35e-22 7.21e-21 1.54e-20 2.29e-20 "
    "3.68e-20 1.25e-19 2.22e-19 1.81e-19 1.83e-19 2.53e-19 3.06e-19 1.02e-18 2.90e-19 2.12e-18 "
    "1.35e-18 1.70e-18 2.66e-18"
)
both = pytest.mark.parametrize("channel", ["FUV", "NUV"])


def area(channel):
    """Constant area, cm2, that gives the paper's ratio for a flat spectrum."""
    low, high = BAND[channel]
    return RATIO[channel] / ((high - low) * 0.5 * (high + low) / HC)


def counted(channel, spectrum, passes=lambda wavelength: 1.0):
    """Rate in cps of a spectrum, by the midpoint rule in steps of 0.02 angstrom."""
    low, high = BAND[channel]
    step = 0.02
    w = np.arange(low + step / 2, high, step)
    return area(channel) * np.sum(spectrum(w) * passes(w) * w) * step / HC


def test_tables_add_up_to_the_handbooks_own_sum():
    """Catches a mistyped table value."""
    total = [float(text) for text in TOTAL.split()]
    assert np.array_equal(WAVELENGTH, np.arange(1000, 3201, 100))
    made = EARTHSHINE_HIGH + ZODIACAL_HIGH
    assert made == pytest.approx(total, rel=6e-3, abs=0)


@pytest.mark.parametrize(
    ("wavelength", "rayleigh"),
    [(1215.67, 20e3), (1304.0, 2e3), (1356.0, 182.0), (2471.0, 200.0)],
)
def test_lines_in_rayleigh(wavelength, rayleigh):
    """1 R = 1e6 / 4 pi photon s-1 cm-2 sr-1: catches a flux or wavelength mistyped."""
    line = next(line for line in LINES if line.wavelength == wavelength)
    per_arcsec2 = rayleigh * 1e6 / (4 * np.pi) * (np.pi / 180 / 3600) ** 2
    assert line.high == pytest.approx(per_arcsec2 * HC / wavelength, rel=0.01, abs=0)
    assert line.average == pytest.approx(line.high / 2, rel=1e-12, abs=0)
    assert line.low <= 0.1 * line.high


@both
def test_the_papers_two_numbers(channel):
    """Average continuum at 1400 or 2500 A and high lines give the paper's sky to 3 %.

    Catches a wrong level (zodiacal light high: 74 % more) and lines of the average level.
    """
    at = {"FUV": (4.29e-25, 2.55e-24), "NUV": (2.39e-22, 2.53e-19)}[channel]
    lines = {"FUV": 6.1e-13 + 5.7e-14 + 5.0e-15, "NUV": 3.0e-15}[channel]
    width = BAND[channel][1] - BAND[channel][0]
    continuum = (0.5 * at[0] + 10 ** (-0.4 * 0.6) * at[1]) * RATIO[channel] * PIXEL
    geocorona = lines * RATIO[channel] / width * PIXEL
    made = paper_estimate(ISSIS.channels[channel])
    assert made["earthshine and zodiacal light"] == pytest.approx(continuum, rel=1e-9, abs=0)
    assert made["geocorona"] == pytest.approx(geocorona, rel=1e-9, abs=0)
    total, part = PAPER[channel]
    assert continuum + geocorona == pytest.approx(total, rel=0.03, abs=0)
    assert continuum == pytest.approx(part, rel=0.03, abs=0)


@both
@pytest.mark.parametrize("first", [("open", 1.0), ("NF1", 0.1), ("NF2", 0.01)])
@pytest.mark.parametrize("second", [("open", 1.0), ("NF1", 0.1), ("NF2", 0.01)])
def test_the_default_is_the_papers_bit_for_bit(channel, first, second):
    """Catches a default whose last bits move, and with them counts of old seeds."""
    observation = ni.Observation(channel, (first[0], second[0]))
    assert observation.sky is CIS
    assert observation.sky_rate == PAPER[channel][0] * (first[1] * second[1])
    assert observation.cps_per_flux == RATIO[channel] * (first[1] * second[1])
    assert observation.pivot == ISSIS.channels[channel].pivot
    assert observation.effective_psf is ISSIS.channels[channel].psf
    parts = observation.sky_components
    assert sum(parts.values()) == pytest.approx(observation.sky_rate, rel=1e-12, abs=0)
    assert parts["earthshine and zodiacal light"] == pytest.approx(
        PAPER[channel][1] * first[1] * second[1], rel=1e-12, abs=0
    )


@both
def test_continuum_integrated_over_the_band(channel):
    """Catches energy counted as photons, a wrong level and a wrong pixel area."""
    sky = ni.Sky("extreme", "low", "none")
    parts = ni.Observation(channel, sky=sky).sky_components
    assert set(parts) == {"earthshine", "zodiacal light"}
    for name, share, high in (
        ("earthshine", 2.0, EARTHSHINE_HIGH),
        ("zodiacal light", 10 ** (-0.4 * 1.2), ZODIACAL_HIGH),
    ):
        expected = PIXEL * counted(
            channel, lambda w, high=high, share=share: share * np.interp(w, WAVELENGTH, high)
        )
        assert parts[name] == pytest.approx(expected, rel=1e-6, abs=0)


@pytest.mark.parametrize(
    ("channel", "name", "wavelength", "flux"),
    [
        ("FUV", "Ly-alpha 1216", 1215.67, 3.05e-13),
        ("FUV", "O I 1304", 1304.0, 2.85e-14),
        ("FUV", "O I] 1356", 1356.0, 2.5e-15),
        ("NUV", "[O II] 2471", 2471.0, 1.5e-15),
    ],
)
def test_lines_count_photons(channel, name, wavelength, flux):
    """Photons per second: catches a line spread over the band, and one in both channels."""
    expected = flux * wavelength / HC * area(channel) * PIXEL
    for level, factor in (("average", 1.0), ("high", 2.0)):
        sky = ni.Sky("none", "none", level)
        parts = ni.Observation(channel, sky=sky).sky_components
        assert parts[name] == pytest.approx(factor * expected, rel=1e-6, abs=0)
    other = "NUV" if channel == "FUV" else "FUV"
    assert name not in ni.Observation(other, sky=sky).sky_components


@pytest.mark.parametrize(("latitude", "fuv", "nuv"), [(90, 226.6, 442.6), (-30, 598.1, 779.3)])
def test_diffuse_light(latitude, fuv, nuv):
    """Murthy's law at the north pole and at csc b = -2; catches a lost sign or steradian."""
    sky = ni.Sky("none", "none", "none", galactic_latitude=latitude)
    for channel in BAND:
        rate = ni.Observation(channel, sky=sky).sky_components["diffuse galactic light"]
        photons = counted(channel, lambda w: np.interp(w, [1539, 2316], [fuv, nuv]) * HC / w)
        assert rate == pytest.approx(photons * PIXEL / 4.25451703e10, rel=1e-6, abs=0)


@both
def test_the_integrated_sky_beside_the_papers(channel):
    """Average continuum, high lines: what the documentation says of the difference."""
    rate = ni.Observation(channel, sky=ni.Sky("average", "average", "high")).sky_rate
    assert rate / PAPER[channel][0] == pytest.approx({"FUV": 0.84, "NUV": 1.10}[channel], abs=0.005)


def test_high_orbit():
    """Darker than the paper's; earthshine by the solid angle of the Earth, found by sampling."""

    def solid_angle(orbit):
        z = (np.arange(2_000_000) + 0.5) / 1_000_000 - 1  # cosines of directions, evenly
        return np.mean(z > np.sqrt(1 - (6378 / orbit) ** 2))

    for channel, (total, _) in PAPER.items():
        high = ni.Observation(channel, sky=HIGH_ORBIT).sky_components
        low = ni.Observation(channel, sky=ni.Sky()).sky_components
        share = solid_angle(42164) / solid_angle(6378 + 540)
        assert high["earthshine"] == pytest.approx(share * low["earthshine"], rel=1e-3, abs=0)
        assert sum(high.values()) < 0.25 * total
        assert not any(name.startswith(("O I", "[O II]")) for name in high)
    # 2 kR of Ly-alpha
    assert ni.Observation("FUV", sky=HIGH_ORBIT).sky_components["Ly-alpha 1216"] == pytest.approx(
        2e3 * 1e6 / (4 * np.pi) / 4.25451703e10 * area("FUV") * PIXEL, rel=0.01, abs=0
    )


def test_a_given_background_overrides():
    given = ni.Observation(background=0.02, sky=HIGH_ORBIT, filters=("NF1", "open"))
    assert given.sky_rate == 0.02 * 0.1
    assert dict(given.sky_components) == {"background": given.sky_rate}
    assert given == given.replace(sky=CIS)
    assert hash(given) == hash(given.replace(sky=CIS))


def test_skies_tell_observations_apart():
    skies = [ni.Observation(sky=sky) for sky in ni.SKIES.values()]
    assert len(set(skies)) == len(ni.SKIES) == 5
    assert ni.Observation(sky=ni.Sky()) == ni.Observation(sky=ni.Sky("average"))


@pytest.mark.parametrize("sky", ni.SKIES.values(), ids=ni.SKIES)
def test_a_new_sky_renders_nothing_unless_it_asks_for_accuracy(sky):
    """What a live scene keeps a rate by: the observation without sky, and the accuracy."""
    first = ni.Observation("FUV")
    other = first.replace(sky=sky)
    assert other.replace(background=0.0) == first.replace(background=0.0)
    tolerance, absolute = accuracy_for_counts(other)
    assert (tolerance, absolute) == (1e-6, 10.0 ** np.floor(np.log10(0.01 * other.sky_rate)))


def test_counts_follow_the_sky():
    """Catches a sky that reaches the header and not the image."""
    observation = ni.Observation("NUV", shape=(4, 4), exposure=1e6, sky=ni.SKIES["HST high"])
    empty = ni.random_sources("point", 0)
    exposure = ni.simulate(empty, observation)
    assert np.all(exposure.expected == 1e6 * observation.sky_rate)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"earthshine": "low"}, "earthshine is 'low'; known levels: none, high orbit, average"),
        ({"zodiacal": 3}, "zodiacal is 3"),
        ({"geocorona": []}, "geocorona is \\[\\]"),
        ({"galactic_latitude": 3}, "galactic_latitude is 3.0"),
        ({"galactic_latitude": -91}, "galactic_latitude is -91.0"),
        ({"galactic_latitude": np.nan}, "galactic_latitude is nan"),
        ({"galactic_latitude": "pole"}, "galactic_latitude is 'pole'"),
    ],
)
def test_bad_skies_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        ni.Sky(**options)


def test_a_sky_is_no_name():
    with pytest.raises(ValueError, match=r"sky is 'dark'; give a Sky, or one of SKIES"):
        ni.Observation(sky="dark")

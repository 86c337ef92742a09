"""Count-rate limits: who breaks them, and what would cure it."""

import numpy as np
import pytest
from astropy.table import vstack

import napari_issis as ni
from napari_issis.bright_sources import bright_sources
from napari_issis.limits import count_rate_warnings, long_and_brief

SHAPE = (80, 90)
# FWHM of 3 pixels: 9 % of a star's light falls into its central pixel.
OBSERVATION = ni.Observation(shape=SHAPE, psf=ni.GaussianPSF(0.108))
SHARE = 4 * np.log(2) / (np.pi * 9)  # at the centre; the mean over the pixel is 3 % less


def star(x, y, cps):
    return ni.source("point", x, y, cps / 1.14e17)


def named(table, observation=OBSERVATION):
    rate = ni.count_rate(table, observation)
    return list(bright_sources(table, observation, rate))


def test_the_sources_above_the_limit():
    """Brightest first; not the faint one on a bright one's light, nor one outside the frame.

    Catches x and y exchanged, rows counted among the bright ones, and a limit on the total
    count rate of a source.
    """
    below, above = 0.9 * 22 / SHARE, 1.1 * 22 / SHARE
    table = vstack(
        [
            star(20, 60, below),
            star(70, 10, above),
            star(30, 20, 2 * above),
            star(31, 20, 0.02 * above),
            star(50, 40, 0.0),
            star(-40, 40, 1e3 * above),
        ]
    )
    assert named(table) == [2, 1]
    assert named(table[:1]) == named(table[:0]) == []


def test_two_sources_that_break_it_together():
    """Catches a rule that asks for the limit of each source alone."""
    pair = vstack([star(40, 40, 0.6 * 22 / SHARE)] * 2)
    assert named(pair) == [0, 1]
    assert named(pair[:1]) == []


def test_filters_count():
    """Catches limits on the rate at open-open."""
    bright = star(40, 40, 5 * 22 / SHARE)
    assert named(bright) == [0]
    assert named(bright, OBSERVATION.replace(filters=("open", "NF1"))) == []
    assert named(bright, OBSERVATION.replace(filters=("open", "N2500"))) == []


def test_the_message_names_three():
    table = vstack([star(20.3 + 15 * i, 30, (9 - i) * 22 / SHARE) for i in range(4)])
    with pytest.warns(ni.CountRateWarning) as caught:
        ni.simulate(table[[3, 0, 1, 2]], OBSERVATION)
    text = str(caught[-1].message)
    assert "Sources there: point at x = 20.3, y = 30.0 (row 1); point at x = 35.3" in text
    assert "(row 3) and 1 more." in text
    with pytest.warns(ni.CountRateWarning, match=r"Source there: point at .* \(row 0\)\. The"):
        ni.simulate(table[:1], OBSERVATION)


@pytest.mark.parametrize(
    ("filters", "peak", "cure"),
    [
        (("open", "open"), 22 * 9.99, "The neutral filter NF1 would cure it."),
        (("open", "open"), 22 * 99.9, "The neutral filter NF2 would cure it."),
        (("open", "open"), 22 * 999, "The neutral filter NF1 and NF2 would cure it."),
        (("open", "open"), 22 * 9999, "The neutral filter NF2 twice would cure it."),
        (("open", "open"), 22 * 10001, "No neutral filter cures it."),
        (("NF1", "open"), 22 * 9.99, "NF2 in place of NF1 would cure it."),
        (("N2500", "open"), 22 * 9.99, "The neutral filter NF1 would cure it."),
        (("N2500", "open"), 22 * 99.9, "The neutral filter NF2 would cure it."),
        (("N2500", "open"), 22 * 101, "No neutral filter cures it."),
        (("N2500", "NF1"), 22 * 9.99, "NF2 in place of NF1 would cure it."),
        (("N2500", "N2500"), 22 * 1.01, "No neutral filter cures it."),
    ],
)
def test_the_cure_leaves_curves_in_their_wheels(filters, peak, cure):
    """Catches a second neutral filter in a wheel that holds a curve."""
    observation = ni.Observation(filters=filters, shape=(1, 1))
    *_, message = count_rate_warnings(np.array([[peak]]), 0.0, observation=observation)
    assert message.endswith(cure)


def brief(table, observation=OBSERVATION):
    rate = ni.count_rate(table, observation)
    return long_and_brief(rate, observation.background_rate, table, observation)[1]


def test_in_a_line_or_two():
    """Catches another source than the brightest, a limit of the other kind, and a wrong cure."""
    above = 22 / SHARE
    assert brief(star(20, 60, 0.9 * above)) == ""
    stars = vstack([star(20, 60, 5 * above), star(70, 10, 30 * above), star(30, 20, 6 * above)])
    rate = ni.count_rate(stars, OBSERVATION).max() + OBSERVATION.background_rate
    assert brief(stars) == (
        f"Too bright: {rate:.3g} cps/px (limit 22), row 1 and 2 more. NF2 would cure it."
    )
    filtered = OBSERVATION.replace(filters=("NF1", "open"))
    assert brief(stars, filtered).endswith(", row 1. NF2 in place of NF1 would cure it.")
    wide = ni.source("uniform", 256, 256, 3e5 / 1.14e17, r_half=100.0)
    frame = OBSERVATION.replace(shape=(512, 512))
    assert brief(wide, frame) == "Too bright: 3e+05 cps in all (limit 2e+05). NF1 would cure it."

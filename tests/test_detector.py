"""Coincidence loss and rollover against closed forms, and a detector followed photon by photon."""

import numpy as np
import pytest
from astropy.io import fits

import napari_issis as ni
from napari_issis.counts import poisson_counts

STAR = ni.source("point", 16.2, 15.7, flux=1e-14)
SHAPE = (32, 32)
pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def test_an_ideal_detector_is_the_default_and_changes_nothing():
    """Catches noise or expected counts that move by a bit where no effect was asked for.

    The sum of these counts was 162,625 before there were any effects.
    """
    observation = ni.Observation(shape=SHAPE)
    exposure = ni.simulate(STAR, observation.replace(background=0.5), seed=3)
    named = observation.replace(background=0.5, detector=ni.Detector())
    assert ni.simulate(STAR, named, seed=3) == exposure
    assert exposure.counts.sum() == 162625
    rate = ni.count_rate(STAR, observation, tolerance=1e-8)
    np.testing.assert_allclose(exposure.expected, (rate + 0.5) * 100.0, rtol=1e-4)
    assert exposure.background == 50.0


def test_a_dead_time_followed_photon_by_photon():
    """Catches a paralyzable formula, and a dead time in the wrong place.

    The mean of 400 runs of 1 s at 2000 photons per second and 1 ms scatters by at most
    sqrt(667 / 400) = 1.3 counts; 6.5 of them is a false alarm in 1e10.
    """
    rng = np.random.default_rng(5)
    counted = 0
    for _ in range(400):
        blind_until = 0.0
        for arrival in np.sort(rng.random(rng.poisson(2000))):
            if arrival >= blind_until:
                counted += 1
                blind_until = arrival + 1e-3
    detected = ni.Detector(1e-3).detected(np.array([2000.0]))[0]
    assert detected == pytest.approx(counted / 400, abs=6.5)


def test_the_analogue_loses_one_per_cent_at_22_cps():
    """Catches a loss that is defined by the detected rate, or a wrong limit."""
    detector = ni.Detector.losing()
    assert detector.detected(np.array([22.0]))[0] == pytest.approx(0.99 * 22, rel=1e-14)
    assert detector.dead_time == pytest.approx(4.591e-4, rel=1e-3)
    half = ni.Detector.losing(0.5, rate=10.0)
    assert half.detected(np.array([10.0, 1e12])) == pytest.approx([5.0, 10.0])


def test_the_loss_acts_on_sources_sky_and_dark_rate_together():
    """Catches a loss of the sources alone, and one of counts in place of rates."""
    ideal = ni.Observation(shape=SHAPE, background=3.0, dark=2.0, exposure=40.0)
    dead = ideal.replace(detector=ni.Detector(0.01))
    before = ni.simulate(STAR, ideal, seed=1).expected / 40.0
    after = ni.simulate(STAR, dead, seed=1)
    np.testing.assert_allclose(after.expected / 40.0, before / (1 + 0.01 * before), rtol=1e-13)
    assert after.background == pytest.approx(5.0 / 1.05 * 40.0)
    # narrower than Poisson: the squared deviations over the variance have mean 1 +- sqrt(2 / 1024)
    variance = after.expected / (1 + 0.01 * before) ** 2
    scatter = (after.counts - after.expected) ** 2 / variance
    assert scatter.mean() == pytest.approx(1.0, abs=6 * np.sqrt(2 / 1024))


def test_a_memory_of_16_bits_wraps():
    """Catches saturation in place of rollover, and a wrap at 65535."""
    detector = ni.Detector(rollover=True)
    counts = np.array([0, 65535, 65536, 65537, 3 * 65536 + 5])
    assert detector.stored(counts).tolist() == [0, 65535, 0, 1, 5]
    long = ni.Observation(shape=SHAPE, background=0.0, exposure=1e4)
    whole = ni.simulate(STAR, long, seed=2)
    wrapped = ni.simulate(STAR, long.replace(detector=detector), seed=2)
    assert whole.counts.max() > 65536
    np.testing.assert_array_equal(wrapped.counts, np.mod(whole.counts, 2**16))
    np.testing.assert_array_equal(wrapped.expected, whole.expected)


def test_the_file_says_what_the_detector_did(tmp_path):
    """Catches a header that leaves the reader with unexplained counts."""
    observation = ni.Observation(shape=SHAPE, detector=ni.Detector(1e-4, rollover=True))
    ni.simulate(STAR, observation.replace(exposure=0.1)).write(tmp_path / "x.fits")
    header = fits.getheader(tmp_path / "x.fits")
    assert header["DEADTIME"] == 1e-4
    assert header["ROLLOVER"] is True


def test_a_picture_during_a_drag_has_the_effects_too():
    """Catches previews without the detector, at first or where only a window is drawn anew."""
    from napari_issis.plugin.picture import HeldSources, PictureMaker

    observation = ni.Observation(
        shape=SHAPE, exposure=1e4, detector=ni.Detector(1e-3, rollover=True), background=0.5
    )
    row, moved = np.array([0]), STAR.copy()
    held = HeldSources(STAR, row, frozenset({0}))
    maker = PictureMaker()
    for x in (16.2, 12.6, 18.0):
        moved["x"] = x
        shown = maker.preview(held, moved, row, observation, 4).exposure
        wanted = ni.simulate(moved, observation, seed=4)
        # a preview may be off by a twentieth of the sky's 5000 counts
        np.testing.assert_allclose(shown.expected, wanted.expected, rtol=1e-3, atol=250)
        drawn = poisson_counts(shown.expected, 4, dead_share=1e-3 / 1e4)
        np.testing.assert_array_equal(shown.counts, drawn % 2**16)
        wraps = wanted.expected > 2**16
        assert wraps.any()
        off = np.abs(shown.counts - wanted.expected % 2**16)
        assert np.median(off[wraps]) < 2000
        assert shown.counts.max() < 2**16


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ni.Detector(-1.0), "dead_time is -1.0"),
        (lambda: ni.Detector(np.nan), "dead_time is nan"),
        (lambda: ni.Detector("x"), "dead_time is 'x'"),
        (lambda: ni.Detector(0.0, rollover=16), "rollover is 16"),
        (lambda: ni.Detector.losing(1.0), "loss is 1.0"),
        (lambda: ni.Detector.losing(0.1, rate=0.0), "rate is 0.0"),
        (lambda: ni.Observation(detector=0.1), "detector is 0.1; give a Detector"),
    ],
)
def test_bad_values_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()

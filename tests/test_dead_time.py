"""Counts under coincidence loss: photon by photon, by the definition, and for long exposures.

The frames are fixed by their seeds, so a test passes or fails for good. Each statistical test
states how probable its failure would have been for another seed.
"""

import mpmath
import numpy as np
import pytest
from scipy import stats

from napari_issis.counts import poisson_counts
from napari_issis.dead_time import dead_time_quantile


def frame(photons, dead_share, *, seed=3, shape=(400, 500)):
    """Counts of a frame that receives the same light everywhere."""
    expected = np.full(shape, photons / (1 + photons * dead_share))
    return poisson_counts(expected, seed, dead_share=dead_share)


def photon_by_photon(photons, dead_share, runs, rng):
    """Counts of one pixel in many exposures of unit length, each photon looked at."""
    counted = []
    for number in rng.poisson(photons, runs):
        blind_until, count = 0.0, 0
        for arrival in np.sort(rng.random(number)).tolist():
            if arrival >= blind_until:
                count += 1
                blind_until = arrival + dead_share
        counted.append(count)
    return np.array(counted)


@pytest.mark.parametrize(
    ("photons", "dead_share"), [(20, 0.01), (20, 0.05), (60, 0.07), (3, 0.4), (0.7, 1.5)]
)
def test_as_photon_by_photon(photons, dead_share):
    """Chi-square of 40,000 exposures and 200,000 pixels; each fails in one of 1e6 seeds.

    Catches Poisson's width, a pixel that is blind at the start, and a dead time too many.
    """
    followed = photon_by_photon(photons, dead_share, 40_000, np.random.default_rng(11))
    drawn = frame(photons, dead_share).ravel()
    length = 1 + max(followed.max(), drawn.max())
    table = np.array([np.bincount(counts, minlength=length) for counts in (followed, drawn)])
    # bins at either end together, where fewer than ten of the smaller sample are expected
    rare = table.sum(axis=0) < 60
    middle = np.flatnonzero(~rare)
    low, high = middle[0], middle[-1]
    ends = table[:, : low + 1].sum(axis=1), table[:, high:].sum(axis=1)
    table = np.column_stack([ends[0], table[:, low + 1 : high], ends[1]])
    assert stats.chi2_contingency(table, correction=False).pvalue > 1e-6


def test_the_quantile_against_the_definition():
    """Catches a count off by one: k + 1 exponential waiting times end within T - k tau."""
    rng = np.random.default_rng(2)

    def cdf(k, photons, dead_share):
        if k < 0:
            return mpmath.mpf(0)
        left = mpmath.mpf(1) - k * mpmath.mpf(dead_share)
        if left <= 0:
            return mpmath.mpf(1)
        return 1 - mpmath.gammainc(k + 1, 0, mpmath.mpf(photons) * left, regularized=True)

    with mpmath.workdps(50):
        for _ in range(400):
            photons, dead_share = 10 ** rng.uniform(-2, 3.5), 10 ** rng.uniform(-5, 0.3)
            tail = 10 ** rng.uniform(-12, -0.3)
            u = float(rng.choice([rng.random(), tail, 1 - tail]))
            z = np.array([stats.norm.ppf(u)])
            k = int(dead_time_quantile(np.array([u]), np.array([photons]), dead_share, z)[0])
            assert cdf(k, photons, dead_share) >= u > cdf(k - 1, photons, dead_share)


@pytest.mark.parametrize("loss", [0.01, 0.5, 3.0])
def test_long_exposures(loss):
    """Mean n T / (1 + n tau) + x^2 / 2 (1 + x)^2, variance n T / (1 + n tau)^3, x = n tau.

    Renewal theory for long times (intervals of mean 1 / n + tau and variance 1 / n^2). Six
    standard errors, of mean and variance: each fails in one of 5e8 seeds.
    """
    photons = 2e4
    counts = frame(photons, loss / photons, shape=(512, 512)).astype(float)
    mean = photons / (1 + loss) + loss**2 / (2 * (1 + loss) ** 2)
    variance = photons / (1 + loss) ** 3
    assert counts.mean() == pytest.approx(mean, abs=6 * np.sqrt(variance / counts.size))
    assert counts.var() == pytest.approx(variance, rel=6 * np.sqrt(2 / counts.size))


@pytest.mark.parametrize(("dead_share", "most"), [(0.3, 4), (0.25, 4), (0.2501, 4), (3.0, 1)])
def test_a_blinded_pixel_counts_once_in_each_dead_time(dead_share, most):
    """Catches a pixel that counts on after the exposure, and one that stops early."""
    assert set(np.unique(frame(1e9, dead_share, shape=(30, 30)))) == {most}


def test_no_dead_time_is_poisson_and_a_tiny_one_nearly():
    """Catches a path of its own that is off from Poisson's."""
    expected = np.random.default_rng(1).gamma(0.3, 30.0, (100, 100))
    poisson = poisson_counts(expected, 5)
    np.testing.assert_array_equal(poisson_counts(expected, 5, dead_share=0.0), poisson)
    np.testing.assert_array_equal(poisson_counts(expected, 5, dead_share=1e-13), poisson)


def test_counts_follow_light_and_history():
    """Catches counts that fall when the light rises, and those of a drag that are others."""
    rng = np.random.default_rng(4)
    before = rng.gamma(0.3, 30.0, (60, 70))
    after = before.copy()
    window = (slice(10, 30), slice(5, 25))
    after[window] += 3.0
    share = 1e-3
    counts = poisson_counts(before, 1, dead_share=share)
    fresh = poisson_counts(after, 1, dead_share=share)
    assert (fresh >= counts).all()
    assert (fresh > counts).any()
    for windows in (None, [window]):
        previous = (before, counts)
        again = poisson_counts(after, 1, dead_share=share, previous=previous, windows=windows)
        np.testing.assert_array_equal(again, fresh)


def test_light_beyond_all_measure_is_named():
    """Catches a saturated pixel that goes on with infinite light."""
    expected = np.full((3, 4), 10.0)
    expected[1, 2] = 1e6
    with pytest.raises(ValueError, match=r"pixel \[1, 2\] receives inf photons"):
        poisson_counts(expected, 0, dead_share=1e-6)
    expected[1, 2] = 1e6 * (1 - 1e-15)
    with pytest.raises(ValueError, match=r"receives \d.*e\+\d+ photons in the exposure, more than"):
        poisson_counts(expected, 0, dead_share=1e-6)

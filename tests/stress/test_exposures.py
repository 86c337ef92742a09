"""Exposures from 1e-6 to 1e9 s and expected counts to 1e15, with a clear error beyond."""

import numpy as np
import pytest
from scipy import special

import napari_issis as ni

STAR = ni.source("point", 20.3, 17.8, 1e-15)
OBSERVATION = ni.Observation(shape=(40, 37), background=2e-3)


@pytest.mark.parametrize("exposure", [1e-6, 1e-3, 1.0, 1e5, 1e9])
def test_expected_counts_are_rate_times_time(exposure):
    """Catches an exposure that changes the rendering, or a time rounded to whole seconds."""
    one = ni.simulate(STAR, OBSERVATION.replace(exposure=1.0)).expected
    long = ni.simulate(STAR, OBSERVATION.replace(exposure=exposure)).expected
    np.testing.assert_allclose(long, one * exposure, rtol=1e-15, atol=0)


@pytest.mark.parametrize("exposure", [1e-6, 1e-2, 1.0, 1e3, 1e9])
def test_counts_scatter_as_poisson(exposure):
    """Catches counts rounded from a normal law, or lost at either end of the range.

    The sum over a frame of sky is Poisson too: within 5 sigma (6e-7 by chance), and the
    frame's variance is its mean within 5 of its own standard deviations.
    """
    observation = ni.Observation(shape=(512, 512), background=0.5, exposure=exposure)
    counts = ni.simulate(ni.random_sources("point", 0), observation, seed=3).counts
    lam, n = 0.5 * exposure, counts.size
    assert abs(counts.sum() - n * lam) <= 5 * np.sqrt(n * lam) + 1
    spread = np.mean((counts - lam) ** 2)
    assert abs(spread - lam) <= 5 * np.sqrt((2 * lam**2 + lam) / n) + 1 / n


def test_the_largest_expected_counts():
    """Catches integers or a quantile that give out before 1e15."""
    observation = ni.Observation(shape=(64, 64), background=1e6, exposure=1e9)
    counts = ni.simulate(ni.random_sources("point", 0), observation, seed=4).counts
    deviation = (counts - 10**15) / np.sqrt(1e15)
    assert abs(deviation.mean()) < 5 / 64
    assert 0.8 < deviation.std() < 1.2


@pytest.mark.filterwarnings("ignore::napari_issis.limits.CountRateWarning")
def test_beyond_is_a_clear_error():
    """Catches counts that overflow silently: the one pixel beyond 1e15 is named, with its value."""
    observation = OBSERVATION.replace(psf=ni.GaussianPSF(0.01), exposure=1e9)
    sigma = 0.01 / 0.036 / np.sqrt(8 * np.log(2))
    share = special.erf(0.5 / (np.sqrt(2) * sigma)) ** 2
    below = ni.simulate(ni.source("point", 20.0, 17.0, 8.7e-12), observation)
    assert below.counts[17, 20] == pytest.approx(share * 8.7e-12 * 1.14e26, rel=2e-6)
    with pytest.raises(ValueError, match=r"\[17, 20\] expects 1.003e[+]15 counts"):
        ni.simulate(ni.source("point", 20.0, 17.0, 8.8e-12), observation)


@pytest.mark.parametrize("exposure", [0.0, -1.0, np.inf, np.nan, "long"])
def test_a_bad_exposure_is_named(exposure):
    """Catches a time that ends as NaN or as negative counts."""
    with pytest.raises(ValueError, match="exposure is"):
        ni.Observation(exposure=exposure)

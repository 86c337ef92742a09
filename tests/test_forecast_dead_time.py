"""Forecasts for a detector with a dead time against fits to counts of our own."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special, stats

import napari_issis as ni

FWHM, SHAPE, SECONDS, TAU = 0.1, (17, 19), 30.0, 0.02
SIGMA = FWHM / 0.036 / np.sqrt(8 * np.log(2))
TRUTH = np.array([700.0, 9.2, 8.4])
FALSE_ALARM = 1e-6


def observation(dead_time=TAU, **changes):
    return ni.Observation(
        shape=SHAPE,
        exposure=SECONDS,
        psf=ni.GaussianPSF(FWHM),
        background=2.0,
        dark=0.0,
        detector=ni.Detector(dead_time),
        **changes,
    )


def star(where):
    return ni.source("point", TRUTH[1], TRUTH[2], TRUTH[0] / where.cps_per_flux)


def slopes(parameters):
    """Derivatives of a Gaussian star on pixels by rate, x and y."""
    rate, x, y = parameters

    def along(centre, n):
        edges = np.arange(n + 1) - 0.5 - centre
        value = np.diff(0.5 * special.erf(edges / (np.sqrt(2) * SIGMA)))
        return value, -np.diff(np.exp(-((edges / SIGMA) ** 2) / 2) / (np.sqrt(2 * np.pi) * SIGMA))

    (vx, sx), (vy, sy) = along(x, SHAPE[1]), along(y, SHAPE[0])
    shapes = [np.outer(vy, vx), rate * np.outer(vy, sx), rate * np.outer(sy, vx)]
    return np.array([each.ravel() for each in shapes])


def counted(rate, rng):
    """Counts of pixels that are blind for TAU after each: events one after the other."""
    most = int(SECONDS / TAU) + 2
    counts = []
    for one in rate:
        enough = min(most, int(one * SECONDS + 10 * np.sqrt(one * SECONDS) + 30))
        times = np.cumsum(rng.exponential(1 / one, enough)) + TAU * np.arange(enough)
        counts.append(np.searchsorted(times, SECONDS))
    return np.array(counts, dtype=float)


def fitted(counts):
    """Most likely star: Poisson counts in the time for which each pixel saw."""
    live = SECONDS - counts * TAU
    found = TRUTH.copy()
    for _ in range(6):
        own = slopes(found)
        rate = found[0] * own[0] + 2.0
        information = (own * live / rate) @ own.T
        found = found + np.linalg.solve(information, own @ (counts / rate - live))
    return found


def test_fits_scatter_as_forecast():
    """Catches errors of a linear detector, too small by a third, and a loss counted twice.

    The false-alarm rate is that of chi squared over 400 fits.
    """
    where = observation()
    row = ni.forecast(star(where), where)[0]
    errors = [row["flux_error"].value * where.cps_per_flux]
    errors = np.array([*errors, row["x_error"].value, row["y_error"].value])
    rate = TRUTH[0] * slopes(TRUTH)[0] + 2.0
    rng = np.random.default_rng(6)
    found = np.array([fitted(counted(rate, rng)) for _ in range(400)])
    ratio = np.var((found - TRUTH) / errors, axis=0, ddof=1)
    alarm = FALSE_ALARM / 6
    low, high = stats.chi2.ppf([alarm, 1 - alarm], 399) / 399
    assert np.all((ratio > low) & (ratio < high)), ratio
    assert row["snr_alone"] == pytest.approx(row["snr"], rel=1e-3)


def test_signal_to_noise_falls_by_the_loss():
    """Catches a loss of the wrong size: to first order in the dead time it is known."""
    short = 1e-6
    linear, lossy = observation(0.0), observation(short)
    before = ni.signal_to_noise(star(linear), linear)[0]
    after = ni.signal_to_noise(star(lossy), lossy)[0]
    share = slopes(TRUTH)[0]
    area = 1 / np.sum(share**2)
    variance = TRUTH[0] + 2.0 * area
    expected = 0.5 * short * variance / area
    assert 1 - after / before == pytest.approx(expected, rel=0.02)

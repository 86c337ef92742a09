"""Exposure times for goals, against the Fisher information of pixels of our own and by search."""

from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from scipy import optimize

import napari_issis as ni
from test_forecast import SCALE, SCENES, derivatives, model, observation, table

STARS = SCENES["one FWHM"]


def covariance(seconds: float) -> np.ndarray:
    truth = np.array(STARS).ravel()
    slopes = derivatives(truth) * seconds
    return np.linalg.inv((slopes / (model(truth) * seconds).ravel()) @ slopes.T)


def snr(seconds):
    spread = np.sqrt(np.diag(covariance(seconds)))
    return min(STARS[0][0] / spread[0], STARS[1][0] / spread[3])


def ratio_error(seconds):
    slope = np.zeros(6)
    slope[[0, 3]] = 1 / STARS[0][0], -1 / STARS[1][0]
    return np.sqrt(slope @ covariance(seconds) @ slope)


def position_error(seconds):
    spread = np.sqrt(np.diag(covariance(seconds)))
    return max(spread[4], spread[5]) * SCALE * 1e3


@pytest.mark.parametrize(
    ("goal", "rows", "value", "wanted"),
    [
        ({"snr": 20}, [0, 1], snr, 20),
        ({"flux_ratio": 0.01}, [0, 1], ratio_error, 0.01),
        ({"position": 1 * u.mas}, 1, position_error, 1.0),
    ],
)
def test_time_by_search(goal, rows, value, wanted):
    """Catches a lost covariance of the two fluxes, the best in place of the worst, a root."""
    expected = optimize.brentq(lambda t: np.log(value(t) / wanted), 1e-3, 1e6)
    found = ni.exposure_for(table(STARS), observation(), rows=rows, **goal)
    assert found.to_value(u.s) == pytest.approx(expected, rel=4e-3)


def test_forecast_of_that_exposure_meets_the_goal():
    """Catches a time that depends on the observation's own exposure."""
    seconds = ni.exposure_for(table(STARS), observation(exposure=7.0), rows=1, snr=33)
    result = ni.forecast(table(STARS), observation(exposure=seconds.value))
    assert result["snr"][1] == pytest.approx(33, rel=1e-9)


@pytest.mark.parametrize(
    ("stars", "options", "message"),
    [
        (STARS, {"rows": 0}, "0 goals"),
        (STARS, {"rows": 0, "snr": 3, "position": 1}, "2 goals"),
        (STARS, {"rows": 2, "snr": 3}, "no row 2"),
        (STARS, {"rows": 0, "snr": -3}, "-3"),
        (STARS, {"rows": [0], "flux_ratio": 0.1}, "two different rows"),
        ([STARS[0], (0.0, 5.0, 5.0)], {"rows": 1, "snr": 3}, "row 1 has no flux"),
        ([STARS[0], STARS[0]], {"rows": 1, "snr": 3}, "row 1 cannot be measured"),
    ],
)
def test_errors_name_what_is_wrong(stars, options, message):
    with pytest.raises(ValueError, match=message):
        ni.exposure_for(table(stars), observation(), **options)


def test_count_rate_limits_warn():
    """Catches a time for a star that the detector cannot count."""
    with pytest.warns(ni.CountRateWarning):
        ni.exposure_for(table([(1e5, 15.0, 15.0)]), observation(), rows=0, snr=20)

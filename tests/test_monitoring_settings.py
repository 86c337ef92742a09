"""A monitoring by a few numbers."""

import numpy as np
import pytest
from astropy.table import vstack

import napari_issis as ni
from napari_issis.monitoring_settings import MonitoringSettings, dithers

FRAME = ni.Observation(shape=(32, 40), exposure=20.0)
SCENE = vstack(
    [ni.source("exponential", 20, 15, 1e-15), ni.source("point", 9, 9), ni.source("point", 30, 9)]
)


def test_points_vary_each_with_its_delay_and_galaxies_do_not():
    """Catches delays counted by rows, and a galaxy that varies."""
    settings = MonitoringSettings(
        epochs=4, cadence=3.0, curve="sinusoid", amplitude=0.3, time_scale=40.0, delays=(0.0, 6.0)
    )
    factors = settings.plan(SCENE, FRAME).factors
    assert np.all(factors[:, 0] == 1)
    wave = [10 ** (0.12 * np.sin(2 * np.pi * t / 40)) for t in (0, 3, 6, 9)]
    np.testing.assert_allclose(factors[:, 1], wave)
    np.testing.assert_allclose(factors[2:, 2], wave[:2])


def test_epochs_roll_and_dithers():
    plan = MonitoringSettings(epochs=3, exposures=4, roll=10.0, dither=5.0, seed=9).plan(
        SCENE, FRAME
    )
    assert [one.time for one in plan.epochs] == [0.0, 5.0, 10.0]
    assert [one.roll for one in plan.epochs] == [0.0, 10.0, 20.0]
    steps = [one.dither for one in plan.exposures[:4]]
    assert steps[0] == (0, 0)
    np.testing.assert_allclose(np.hypot(*np.transpose(steps[1:])), 5.0)
    apart = np.subtract.outer(*[np.array(steps) @ [1, 1j]] * 2)
    assert np.abs(apart[np.triu_indices(4, 1)]).min() > 3
    assert dithers(1, 5.0) == [(0.0, 0.0)]


def test_constant():
    assert np.all(
        MonitoringSettings(curve="constant", delays=(1, 2)).plan(SCENE, FRAME).factors == 1
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"delays": (1.0,)}, "1 delays and 2 point sources"),
        ({"curve": "flare"}, "curve is 'flare'"),
        ({"amplitude": -1.0}, "amplitude is -1"),
        ({"epochs": 0}, "epochs is empty"),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(ValueError, match=message):
        MonitoringSettings(**options).plan(SCENE, FRAME)

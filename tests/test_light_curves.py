"""Shapes of light curves against their definitions, delays against lenstronomy's."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

import napari_issis as ni

FALSE_ALARM = 1e-6


def magnitudes(curve, times):
    return -2.5 * np.log10([curve(time) for time in times])


def test_sinusoid():
    """Catches radians, and an amplitude from faintest to brightest."""
    curve = ni.sinusoid(0.3, 8.0, 90.0)
    np.testing.assert_allclose(magnitudes(curve, [0, 2, 4, 8]), [-0.3, 0, 0.3, -0.3], atol=1e-12)


def test_damped_random_walk():
    """Catches a memory of another length and another amplitude, before and after time 0.

    2000 walks; variance and covariance against amplitude^2 exp(-|dt| / tau). The variance of
    a sample of normal numbers follows chi squared; Fisher's z of a correlation is normal of
    variance 1 / (n - 3). Together they raise a false alarm once in 10^6.
    """
    n, tau = 2000, 50.0
    times = np.array([-40.0, -10.0, 0.0, 5.0, 35.0, 70.0])
    walks = np.array([magnitudes(ni.damped_random_walk(0.2, tau, seed=s), times) for s in range(n)])
    share = FALSE_ALARM / 21 / 2
    low, high = stats.chi2.ppf([share, 1 - share], n)
    total = (walks**2).sum(axis=0) / 0.2**2
    assert np.all((total > low) & (total < high)), total / n
    found = np.arctanh(np.corrcoef(walks.T)[np.triu_indices(6, 1)])
    apart = np.abs(times[:, None] - times)[np.triu_indices(6, 1)]
    expected = np.arctanh(np.exp(-apart / tau))
    assert np.all(np.abs(found - expected) * np.sqrt(n - 3) < stats.norm.isf(share))


def test_a_walk_is_a_function_of_time():
    """Catches one that depends on the order of the questions, or jumps."""
    times = np.linspace(-30.0, 200.0, 60)
    forwards = magnitudes(ni.damped_random_walk(0.2, 50.0, seed=4), times)
    backwards = magnitudes(ni.damped_random_walk(0.2, 50.0, seed=4), times[::-1])[::-1]
    assert np.array_equal(forwards, backwards)
    assert np.ptp(forwards) > 0.05
    curve = ni.damped_random_walk(0.2, 50.0, seed=4)
    np.testing.assert_allclose(
        magnitudes(curve, [-1e-7, 2 - 1e-7]), magnitudes(curve, [1e-7, 2 + 1e-7]), atol=1e-6
    )
    other = magnitudes(ni.damped_random_walk(0.2, 50.0, seed=5), times)
    assert np.abs(other - forwards).max() > 0.05


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ni.sinusoid(-0.1, 10), "amplitude is -0.1"),
        (lambda: ni.sinusoid(0.1, 0), "period is 0"),
        (lambda: ni.sinusoid(0.1, 10, np.nan), "phase is nan"),
        (lambda: ni.damped_random_walk(0.1, 0), "tau is 0"),
        (lambda: ni.damped_random_walk(0.1, 1.0, seed=-1), "seed is -1"),
        (lambda: ni.damped_random_walk(0.1, 1e-3)(1e6), r"more than 200,000 tau from 0"),
        (lambda: ni.damped_random_walk(0.1, 1.0)(np.nan), "time nan"),
        (lambda: ni.isothermal_delays("Q2237+0305", z_lens=2), "z_lens is 2"),
        (lambda: ni.isothermal_delays("Q2237+0305", z_source=np.nan), "z_source of Q2237"),
    ],
)
def test_bad_input(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_delays_of_an_isothermal_lens():
    """Catches a delay of the wrong sign or distance: lenstronomy's arrival times are the same.

    A singular isothermal ellipsoid whose images are those that lenstronomy itself finds.
    """
    pytest.importorskip("lenstronomy")
    from astropy.cosmology import Planck18
    from lenstronomy.LensModel.lens_model import LensModel
    from lenstronomy.LensModel.Solver.lens_equation_solver import LensEquationSolver

    from napari_issis import lens_delays
    from napari_issis.lensed_quasars import find_quasar

    model = LensModel(["SIE"], z_lens=0.45, z_source=1.69, cosmo=Planck18)
    values = [{"theta_E": 1.2, "e1": 0.1, "e2": -0.05, "center_x": 0.0, "center_y": 0.0}]
    x, y = LensEquationSolver(model).image_position_from_source(0.05, 0.03, values)
    assert len(x) == 4
    arrival = model.arrival_time(x, y, values)
    system = find_quasar("HE0435-1223")
    moved = replace(
        system,
        # east is -x
        images={name: (0.3 - a, 0.1 + b) for name, a, b in zip("ABCD", x, y, strict=True)},
        lens=(0.3, 0.1),
        z_lens=0.45,
        z_source=1.69,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lens_delays, "find_quasar", lambda name: moved)
        delays = ni.isothermal_delays("any")
    np.testing.assert_allclose(list(delays.values()), arrival - arrival.min(), atol=1e-3)
    assert max(delays.values()) > 5


def test_plot(tmp_path):
    pytest.importorskip("matplotlib")
    stars = ni.source("point", 20, 15, 4e-15)
    plan = ni.monitor(stars, ni.Observation(shape=(32, 40), exposure=50.0), [0.0, 3.0, 5.0])
    table = ni.fit_light_curves(plan)
    figure = ni.plot_light_curves(
        table, tmp_path / "curve.png", names=["A"], title="a star", time_label="time, days"
    )
    (panel,) = figure.axes
    assert panel.get_xlabel() == "time, days"
    drawn = panel.containers[0].lines[0].get_xydata()
    np.testing.assert_allclose(drawn, np.transpose([[0, 3, 5], table["flux"].value]))
    bars = panel.containers[0].lines[2][0].get_segments()
    half = [0.5 * (bar[1, 1] - bar[0, 1]) for bar in bars]
    np.testing.assert_allclose(half, table["error"].value)
    assert (tmp_path / "curve.png").stat().st_size > 5000
    with pytest.raises(ValueError, match="2 names and 1 sources"):
        ni.plot_light_curves(table, names=["A", "B"])

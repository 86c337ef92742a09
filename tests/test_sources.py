"""Source tables: defaults, random populations, units, and what is refused."""

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable, Table, vstack

import napari_issis as ni
from napari_issis.sources import check_sources

FLUX = u.erg / u.s / u.cm**2 / u.AA


def test_defaults_are_the_papers():
    row = ni.source("exponential", 256, 256)[0]
    assert row["flux"] == 1e-14 * FLUX
    assert row["r_half"] == 20 * u.pix
    assert (row["ellipticity"], row["pa"]) == (0.5, 45 * u.deg)


def test_points_ignore_structure():
    nan = float("nan")
    table = ni.source("point", 1, 2, 1e-15, nan, nan, nan)
    arrays = check_sources(table)
    assert (arrays.r_half[0], arrays.ellipticity[0], arrays.pa[0]) == (0, 0, 0)


def test_magnitudes_become_fluxes_at_the_pivot_wavelength():
    """f_lambda = 10^(-0.4 (m + 48.6)) c / lambda^2 (Oke & Gunn 1983)."""
    table = ni.source("point", 1, 2, 20 * u.ABmag)
    assert table["flux"].unit == u.ABmag
    wavelength = 2494.141553
    expected = 10 ** (-0.4 * 68.6) * 2.99792458e18 / wavelength**2
    assert check_sources(table, pivot=wavelength).flux[0] == pytest.approx(
        expected, rel=1e-5, abs=0
    )


def test_units_are_converted():
    table = ni.source(
        "exponential", 1 * u.pix, 2, 1e-14, 0.36 * u.arcsec, 30 * u.percent, np.pi / 4 * u.rad
    )
    arrays = check_sources(table)
    assert arrays.r_half[0] == pytest.approx(10)
    assert arrays.ellipticity[0] == pytest.approx(0.3)
    assert arrays.pa[0] == pytest.approx(45)


def test_plain_tables_and_vstack_with_sersic():
    plain = Table({"kind": ["point "], "x": [1], "y": [2], "flux": [1e-15]})
    assert check_sources(plain).kind[0] == "point"
    both = vstack([ni.source("point", 1, 2), ni.source("sersic", 1, 2, n=3.0)])
    assert check_sources(both).index[1] == 3.0


def test_random_defaults_and_seed():
    """Uniform in all parameters: means of 4000 draws within 5 standard errors (6e-7 each)."""
    table = ni.random_sources("exponential", 4000, seed=5)
    ranges = {
        "x": (-0.5, 511.5),
        "y": (-0.5, 511.5),
        "flux": (1e-15, 1e-14),
        "r_half": (10, 30),
        "ellipticity": (0, 0.8),
        "pa": (0, 180),
    }
    for name, (low, high) in ranges.items():
        values = np.asarray(getattr(table[name], "value", table[name]))
        assert low <= values.min() <= values.max() <= high
        error = (high - low) / np.sqrt(12 * 4000)
        assert abs(values.mean() - 0.5 * (low + high)) < 5 * error, name
    again = ni.random_sources("exponential", 4000, seed=5)
    assert np.array_equal(table["flux"], again["flux"])
    log = np.log(ni.random_sources("point", 4000, flux_distribution="log", seed=5)["flux"].value)
    middle = 0.5 * (np.log(1e-15) + np.log(1e-14))
    assert abs(log.mean() - middle) < 5 * np.log(10) / np.sqrt(12 * 4000)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nova", 1, 2), "row 0, kind: 'nova' is unknown"),
        (("point", np.nan, 2), "row 0, x: nan"),
        (("point", 1e12, 2), "row 0, x: 1e.12 is not allowed"),
        (("point", "a", 2), "x is 'a'"),
        (("point", 1, 2, -1), "row 0, flux: -1"),
        (("point", 1, 2, np.inf), "row 0, flux: inf"),
        (("point", 1, 2, 3 * u.m), "flux has the unit m"),
        (("exponential", 1, 2, 1e-15, 0), "row 0, r_half: 0"),
        (("exponential", 1, 2, 1e-15, -3), "row 0, r_half: -3"),
        (("exponential", 1, 2, 1e-15, 10, 1.0), r"row 0, ellipticity: 1 .* \[0, 1\)"),
        (("exponential", 1, 2, 1e-15, 10, -0.1), "row 0, ellipticity: -0.1"),
        (("exponential", 1, 2, 1e-15, 10, 0.5, np.inf), "row 0, pa: inf"),
        (("sersic", 1, 2, 1e-15, 10, 0.5, 0, 9.0), r"row 0, n: 9 .* \[0.5, 8.0\]"),
        (("sersic", 1, 2), "column n"),
        (("gaussian", 1, 2, 1e-15, 10, 0.5, 0, 2.0), "only sources of kind 'sersic'"),
    ],
)
def test_bad_values_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        ni.source(*arguments)


def test_bad_tables_are_named():
    with pytest.raises(ValueError, match="no column y, flux"):
        check_sources(QTable({"kind": ["point"], "x": [1.0]}))
    with pytest.raises(ValueError, match="no column r_half, ellipticity, pa"):
        check_sources(QTable({"kind": ["gaussian"], "x": [1.0], "y": [1.0], "flux": [1.0]}))
    table = ni.random_sources("uniform", 5, seed=1)
    table["ellipticity"][3] = 1.5
    with pytest.raises(ValueError, match=r"row 3, ellipticity: 1\.5"):
        check_sources(table)
    masked = Table({"kind": ["point"], "x": [1.0], "y": [1.0], "flux": [1e-15]}, masked=True)
    masked["flux"].mask = [True]
    with pytest.raises(ValueError, match="row 0, flux: the value is missing"):
        check_sources(masked)
    with pytest.raises(ValueError, match="sources is None"):
        ni.count_rate(None)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n": -1}, "n is -1"),
        ({"n": 2.5}, "n is 2.5"),
        ({"kind": "nova"}, "kind is 'nova'"),
        ({"flux": (2e-15, 1e-15)}, "flux limits"),
        ({"flux": (-1, 1)}, "flux limits"),
        ({"flux": (0, 1e-15), "flux_distribution": "log"}, "above zero"),
        ({"flux_distribution": "normal"}, "flux_distribution is 'normal'"),
        ({"r_half": (0, np.inf)}, "finite"),
        ({"ellipticity": (0, 1)}, "ellipticity limits"),
        ({"pa": 3}, "give .lower, upper"),
        ({"shape": 5}, "shape is 5"),
        ({"shape": (-5, 5)}, "sides"),
    ],
)
def test_bad_populations_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        ni.random_sources(**{"kind": "exponential", "n": 3, **options})

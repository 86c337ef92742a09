from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable, Table

from napari_issis import random_sources, source
from napari_issis.exposure import same_table
from napari_issis.plugin.table import join, master_table


def test_a_table_in_the_standard_units_is_kept_as_it_is():
    table = random_sources("sersic", 5, seed=3)
    assert same_table(master_table(table), table)


def test_magnitudes_and_further_columns_survive():
    """Catches magnitudes turned into fluxes by the way through the layers."""
    table = source("point", 1, 2, flux=20.5 * u.ABmag)
    table["name"] = ["HD 1"]
    both = join(master_table(table), master_table(table), pivot=2500.0)
    assert both["flux"].unit == u.ABmag
    assert list(both["flux"].value) == [20.5, 20.5]
    assert list(both["name"]) == ["HD 1", "HD 1"]


def test_a_flux_joins_magnitudes_at_the_pivot_wavelength():
    """Catches a conversion at another wavelength; by AB's definition, -2.5 lg f_nu - 48.6."""
    both = join(
        master_table(source("point", 1, 2, flux=20.5 * u.ABmag)),
        master_table(source("point", 3, 4, flux=1e-14)),
        pivot=2500.0,
    )
    f_nu = 1e-14 * 2500.0**2 / 2.99792458e18
    assert both["flux"][1].value == pytest.approx(-2.5 * np.log10(f_nu) - 48.6, abs=1e-3)


def test_a_flux_of_zero_has_no_magnitude():
    with pytest.raises(ValueError, match="flux of 0"):
        join(
            master_table(source("point", 1, 2, flux=20.5 * u.ABmag)),
            master_table(source("point", 3, 4, flux=0.0)),
            pivot=2500.0,
        )


def test_whole_numbers_become_floats():
    """Catches integer columns, in which a moved source would jump by pixels."""
    table = Table({"kind": ["point"], "x": [3], "y": [4], "flux": [1]})
    master = master_table(table)
    assert master["x"].dtype == np.float64
    assert master["flux"].dtype == np.float64
    assert np.isnan(master["r_half"].value[0])


def test_radii_given_as_angles_become_pixels():
    table = QTable(source("gaussian", 1, 2, r_half=0.36 * u.arcsec))
    assert master_table(table)["r_half"][0] == 10 * u.pix


def test_an_index_column_is_added_where_needed():
    both = join(
        master_table(source("point", 1, 2)), master_table(source("sersic", 3, 4, n=2)), pivot=2500.0
    )
    assert np.isnan(both["n"][0])
    assert both["n"][1] == 2

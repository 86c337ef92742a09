"""Random populations against independent formulas.

The seeds are fixed. With other seeds each Kolmogorov-Smirnov test would raise a false alarm once
in 10^4 runs, each binomial one (4.5 standard errors) once in 10^5.
"""

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from scipy import stats
from scipy.integrate import quad
from scipy.optimize import brentq

import napari_issis as ni
from napari_issis.flux_distribution import draw_fluxes
from napari_issis.sources import check_sources

MANY = 20_000
FALSE_ALARM = 1e-4
LIMITS = (1e-17, 1e-14)
# Each is drawn flattened, turned and off the centre; PA turns +y towards -x.
SHAPE = {"centre": (300.0, 100.0), "radius": 40.0, "ellipticity": 0.4, "pa": 30.0}


def along_the_axes(table):
    """Major and minor coordinates of positions, the minor one stretched to a round cluster."""
    z = (np.asarray(table["x"]) - 300.0) + 1j * (np.asarray(table["y"]) - 100.0)
    z *= np.exp(-1j * np.radians(90.0 + 30.0))
    return z.real, z.imag / 0.6


def agrees(values, cumulative):
    assert stats.kstest(values, cumulative).pvalue > FALSE_ALARM


def test_a_seed_draws_the_population_it_always_drew():
    """Catches draws in another order: scenes that scripts name by their seed would change."""
    row = ni.random_sources("sersic", 3, flux_distribution="log", seed=7)[2]
    assert row["x"] == pytest.approx(396.6510734055391, rel=1e-14)
    assert row["flux"].value == pytest.approx(6.2671404668733895e-15, rel=1e-14, abs=0)
    assert row["n"] == pytest.approx(1.2535804438245963, rel=1e-14)


def test_a_plummer_cluster_is_drawn_from_the_projected_profile():
    """One coordinate of (1 + r^2/a^2)^-2 is distributed as a Student t of 2, scaled by a / sqrt 2.

    Catches the profile in space for the projected one, and an axis or angle that is wrong.
    """
    table = ni.star_cluster(MANY, profile="plummer", **SHAPE, seed=1)
    for coordinate in along_the_axes(table):
        agrees(coordinate, stats.t(2, scale=40 / np.sqrt(2)).cdf)


def test_a_gaussian_cluster_is_normal_on_both_axes():
    """Catches a radius that is sigma, or an ellipse turned the other way."""
    table = ni.star_cluster(MANY, profile="gaussian", **SHAPE, seed=2)
    assert ni.ClusterProfile("gaussian", **SHAPE).scale_radius == pytest.approx(40 / 1.17741)
    for coordinate in along_the_axes(table):
        agrees(coordinate, stats.norm(scale=40 / np.sqrt(2 * np.log(2))).cdf)


@pytest.mark.parametrize("concentration", [0.0, 0.5, 1.5, 3.0])
def test_a_king_cluster_follows_king(concentration):
    """King (1962, eq. 14), integrated numerically, its core radius found from the integral.

    Catches slips in the closed form of the cumulative, and stars beyond the tidal radius.
    """
    tidal = 10**concentration

    def number(r):
        def ring(s):
            # s is ln r: the core and the halo alike.
            x = np.exp(s)
            return x**2 * ((1 + x**2) ** -0.5 - (1 + tidal**2) ** -0.5) ** 2

        return quad(ring, np.log(1e-6), np.log(max(r, 1.1e-6)), limit=200)[0]

    half = brentq(lambda r: number(r) / number(tidal) - 0.5, 1e-3, tidal)
    core = 40 / half
    cluster = ni.ClusterProfile("king", concentration=concentration, **SHAPE)
    assert cluster.tidal_radius == pytest.approx(tidal * core, rel=1e-6)
    assert cluster.scale_radius == pytest.approx(core, rel=1e-6)
    table = ni.star_cluster(MANY, profile="king", concentration=concentration, **SHAPE, seed=3)
    major, minor = along_the_axes(table)
    r = np.hypot(major, minor)
    assert r.max() < tidal * core * (1 + 1e-6)
    grid = np.geomspace(1e-4 * tidal * core, tidal * core, 400)
    cumulative = [number(each / core) / number(tidal) for each in grid]
    agrees(r, lambda r: np.interp(r, grid, cumulative))
    agrees(np.arctan2(minor, major), stats.uniform(-np.pi, 2 * np.pi).cdf)


@pytest.mark.parametrize("profile", ["plummer", "king", "gaussian"])
def test_half_of_the_stars_stand_within_the_radius(profile):
    """Catches a radius that is a scale radius of another meaning, and an angle taken for pixels."""
    shape = {**SHAPE, "radius": 1.44 * u.arcsec, "pa": 30 * u.deg}
    table = ni.star_cluster(MANY, profile=profile, **shape, seed=4)
    inside = np.count_nonzero(np.hypot(*along_the_axes(table)) < 40)
    assert abs(inside - MANY / 2) < 4.5 * np.sqrt(MANY) / 2


def power_law(slope, low, high):
    """Cumulative of dN/dF ~ F^-slope."""
    if slope == 1:
        return lambda flux: np.log(flux / low) / np.log(high / low)
    b = 1 - slope
    return lambda flux: ((flux / low) ** b - 1) / ((high / low) ** b - 1)


@pytest.mark.parametrize("slope", [-2.0, 0.0, 0.7, 1.0, 1.4, 2.35, 4.0])
def test_fluxes_follow_the_power_law(slope):
    """Catches a slope of dN/dlogF taken for that of dN/dF, its sign, and the case of 1."""
    table = ni.random_sources(
        "point", MANY, flux=LIMITS, flux_distribution="power", flux_slope=slope, seed=5
    )
    fluxes = table["flux"].value
    agrees(fluxes, power_law(slope, *LIMITS))
    assert LIMITS[0] <= fluxes.min() < fluxes.max() <= LIMITS[1]


def test_a_power_law_is_smooth_through_one_and_safe_far_from_it():
    """Catches a formula that loses its digits near slope 1 or overflows at steep slopes."""

    def drawn(slope):
        return draw_fluxes(np.random.default_rng(6), 1000, LIMITS, "power", slope)

    exact = draw_fluxes(np.random.default_rng(6), 1000, LIMITS, "log")
    assert np.array_equal(drawn(1.0), exact)
    assert drawn(1 + 1e-12) == pytest.approx(exact, rel=1e-10, abs=0)
    # Below 1 the draw starts from the bright end: the same distribution, mirrored.
    mirrored = LIMITS[0] * LIMITS[1] / exact
    assert drawn(1 - 1e-12) == pytest.approx(mirrored, rel=1e-10, abs=0)
    for slope, end in ((400.0, LIMITS[0]), (-400.0, LIMITS[1])):
        assert drawn(slope) == pytest.approx(np.full(1000, end), rel=0.1, abs=0)


def test_one_flux_for_all():
    """Catches a division by the zero width of equal limits."""
    for distribution in ("uniform", "log", "power"):
        table = ni.star_cluster(
            5, flux=(2e-15, 2e-15), flux_distribution=distribution, flux_slope=2, seed=1
        )
        assert table["flux"].value == pytest.approx(2e-15, rel=1e-14, abs=0)


def test_fluxes_are_drawn_from_a_list_each_as_often():
    """Catches draws without replacement, favoured entries, and magnitudes taken for fluxes."""
    magnitudes = np.array([20.0, 21.0, 22.0, 23.0]) * u.ABmag
    table = ni.star_cluster(4000, flux_sample=magnitudes, seed=7)
    assert table["flux"].unit == u.ABmag
    values, often = np.unique(table["flux"].value, return_counts=True)
    assert np.array_equal(values, magnitudes.value)
    assert stats.chisquare(often).pvalue > FALSE_ALARM
    pivot = ni.Observation().channel_data.pivot
    fluxes = magnitudes.to(u.erg / u.s / u.cm**2 / u.AA, u.spectral_density(pivot * u.AA))
    same = ni.star_cluster(4000, flux_sample=fluxes, seed=7)
    converted = check_sources(table, pivot=pivot).flux
    assert converted == pytest.approx(same["flux"].value, rel=1e-12, abs=0)
    plain = ni.random_sources("exponential", 5, flux_sample=[3e-15], seed=1)
    assert set(plain["flux"].value) == {3e-15}
    column = QTable({"flux": [3e-15, 4e-15]})["flux"]
    assert set(ni.star_cluster(50, flux_sample=column, seed=1)["flux"].value) == {3e-15, 4e-15}


def test_galaxies_can_be_clustered_too():
    """Catches positions that are not those of the profile asked for."""
    cluster = ni.ClusterProfile("king", **SHAPE)
    galaxies = ni.random_sources("exponential", 50, positions=cluster, r_half=(2, 8), seed=8)
    stars = ni.star_cluster(50, profile="king", **SHAPE, seed=8)
    assert np.array_equal(galaxies["x"], stars["x"])
    assert np.array_equal(galaxies["y"], stars["y"])
    assert set(galaxies["kind"]) == {"exponential"}
    assert galaxies["r_half"].value.max() <= 8
    other = ni.star_cluster(50, profile="king", **SHAPE, seed=9)
    assert not np.any(other["x"] == stars["x"])
    assert len(ni.star_cluster(0)) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n": -1}, "n is -1"),
        ({"profile": "sersic"}, "profile is 'sersic'; known: king, plummer, gaussian"),
        ({"centre": 5}, "centre is 5; give .x, y."),
        ({"centre": (1, 2, 3)}, "give .x, y."),
        ({"centre": (1, np.nan)}, "centre is nan"),
        ({"centre": (1, 1e12)}, "within 1e.09"),
        ({"radius": 0}, "radius is 0; it must be above 0"),
        ({"radius": 1e6}, "radius is 1e.06"),
        ({"radius": "wide"}, "radius is 'wide'"),
        ({"radius": 3 * u.m}, "radius is .*3"),
        ({"concentration": -0.1}, "concentration is -0.1"),
        ({"concentration": 5}, r"in \[0.0, 4.0\]"),
        ({"ellipticity": 1}, "ellipticity is 1"),
        ({"pa": np.inf}, "pa is inf"),
        ({"flux": (0, 1e-15)}, "power-law flux needs them above zero"),
        ({"flux": (2e-15, 1e-15)}, "the lower exceeds the upper"),
        ({"flux_slope": np.nan}, "flux_slope is nan"),
        ({"flux_slope": "steep"}, "flux_slope is 'steep'"),
        ({"flux_distribution": "normal"}, "flux_distribution is 'normal'"),
        ({"flux_sample": []}, "flux_sample is empty"),
        ({"flux_sample": "bright"}, "flux_sample is 'bright'"),
        ({"flux_sample": [1e-15, -1e-15]}, "flux_sample: row 1, flux: -1e-15"),
        ({"flux_sample": [np.nan]}, "flux_sample: row 0, flux: nan"),
        ({"flux_sample": [3] * u.m}, "flux has the unit m"),
    ],
)
def test_bad_clusters_are_named(options, message):
    """Catches errors that do not name the value."""
    with pytest.raises(ValueError, match=message):
        ni.star_cluster(**{"n": 3, **options})


def test_positions_must_be_a_profile():
    with pytest.raises(ValueError, match="positions is 'king'; give a ClusterProfile"):
        ni.random_sources("point", 3, positions="king")

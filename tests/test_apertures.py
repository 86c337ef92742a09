"""Aperture photometry against integrals that are worked out here."""

import builtins
import re
import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.table import vstack
from scipy.special import erf

import napari_issis as ni
from napari_issis.encircled_energy import psf_table
from napari_issis.exposure import expose, noise_ready_rate

CPS_PER_FLUX = 1.14e17  # NUV, Shalyapin & Goicoechea 2014
FWHM = 0.1
SIGMA = FWHM / 0.036 / np.sqrt(8 * np.log(2))
SHAPE = (64, 72)
SKY = 3.5e-4


def observation(**changes):
    values = {"shape": SHAPE, "psf": ni.GaussianPSF(FWHM), "exposure": 1000.0}
    return ni.Observation(**(values | changes))


def star_on_pixels(x, y, shape=SHAPE):
    """Share of a star's light in each pixel: a Gaussian integrated over squares."""

    def along(centre, n):
        edges = np.arange(n + 1) - 0.5 - centre
        return np.diff(0.5 * (1 + erf(edges / (SIGMA * np.sqrt(2)))))

    return np.outer(along(y, shape[0]), along(x, shape[1]))


def in_circle(image, x, y, radius, fine=201):
    """Sum of an image in a circle, each pixel a square of fine x fine samples."""
    step = (np.arange(fine) + 0.5) / fine - 0.5
    total = 0.0
    for row in range(int(y - radius) - 1, int(y + radius) + 3):
        for column in range(int(x - radius) - 1, int(x + radius) + 3):
            inside = np.hypot((row + step - y)[:, None], column + step - x) < radius
            total += inside.mean() * image[row, column]
    return float(total)


@pytest.mark.parametrize("place", [(30.0, 25.0), (30.5, 25.0), (30.25, 24.6)])
@pytest.mark.parametrize("radius", [1.5, 4.0])
def test_a_star_of_a_gaussian_psf(place, radius):
    """Catches apertures half a pixel off, a PSF without its pixel, wrong units of the truth."""
    x, y = place
    long = observation(exposure=1e9)
    exposure = ni.simulate(ni.source("point", x, y, 1e-17), long)
    (row,) = ni.aperture_photometry(exposure, radius=radius)
    truth = 1e-17 * CPS_PER_FLUX * 1e9
    share = in_circle(star_on_pixels(x, y), x, y, radius)
    assert row["true_counts"].value == pytest.approx(truth, rel=1e-12)
    assert 1 / row["aperture_correction"] == pytest.approx(share, rel=2e-4)
    area = np.pi * radius**2
    assert row["area"].value == pytest.approx(area, rel=1e-9)
    assert row["sky"].value == pytest.approx(SKY * 1e9, rel=1e-12)
    counted = share * truth + area * SKY * 1e9
    assert row["aperture_counts"].value == pytest.approx(counted, rel=2e-4)
    # five standard deviations
    assert row["counts"].value == pytest.approx(truth, abs=5 * row["counts_error"].value)
    assert row["counts_error"].value == pytest.approx(np.sqrt(counted) / share, rel=1e-3)
    assert abs(row["bias_percent"]) < 1e-3


def in_ellipse(a, b, sigma_a, sigma_b):
    """Share of an elliptical Gaussian in an ellipse of the same axes, by quadrature."""
    t = (np.arange(720) + 0.5) * (2 * np.pi / 720)
    q = (a * np.cos(t) / sigma_a) ** 2 + (b * np.sin(t) / sigma_b) ** 2
    # int over the ellipse of the density: radial integral in closed form
    weight = a * b / (2 * np.pi * sigma_a * sigma_b)
    return float(np.mean(weight * 2 * np.pi * -np.expm1(-q / 2) / q))


@pytest.mark.parametrize("pa", [25.0, 155.0])
def test_an_inclined_galaxy(pa):
    """Catches a position angle of the wrong sense or zero point, and swapped axes."""
    shape, r_half, ellipticity = (151, 161), 20.0, 0.6
    galaxy = ni.source("gaussian", 80.0, 74.0, 1e-16, r_half, ellipticity, pa)
    exposure = ni.simulate(galaxy, observation(shape=shape, exposure=1e8))
    (row,) = ni.aperture_photometry(exposure, radius=2.0, scale=1.0)
    a, b = np.hypot(r_half, 2.0), np.hypot(0.4 * r_half, 2.0)
    assert (row["a"].value, row["b"].value) == pytest.approx((a, b))
    # PSF, pixel, and the pixel once more as the overlap is smooth by it
    blur = SIGMA**2 + 2 / 12
    sigma = [np.hypot(q * r_half / np.sqrt(2 * np.log(2)), np.sqrt(blur)) for q in (1, 0.4)]
    share = in_ellipse(a, b, *sigma)
    truth = 1e-16 * CPS_PER_FLUX * 1e8
    net = row["aperture_counts"].value - np.pi * a * b * SKY * 1e8
    assert net / truth == pytest.approx(share, rel=2e-4)
    assert 1 / row["aperture_correction"] == pytest.approx(share, rel=2e-4)
    assert row["net_counts"].value == pytest.approx(net, rel=1e-9)
    # that light lies along (-sin pa, cos pa): the mirrored aperture holds less
    mirrored = galaxy.copy()
    mirrored["pa"] = (180 - pa) * u.deg
    other = ni.Exposure(
        exposure.counts, exposure.expected, mirrored, exposure.observation, exposure.seed
    )
    (wrong,) = ni.aperture_photometry(other, radius=2.0, scale=1.0)
    assert wrong["net_counts"].value / truth < 0.85 * share


def test_the_bias_is_the_light_of_the_neighbour():
    """Catches a bias of the wrong sign or scale, and one that forgets the correction."""
    fluxes = 2e-17, 5e-17
    pair = vstack([ni.source("point", 30, 30, fluxes[0]), ni.source("point", 34, 31, fluxes[1])])
    table = ni.aperture_photometry(ni.simulate(pair, observation()), radius=3.0)
    own = in_circle(star_on_pixels(30, 30), 30, 30, 3.0)
    stray = in_circle(star_on_pixels(34, 31), 30, 30, 3.0)
    bias = 100 * stray / own * fluxes[1] / fluxes[0]
    assert table["bias_percent"][0] == pytest.approx(bias, rel=5e-4)
    expected = bias / 100 * fluxes[0] * CPS_PER_FLUX * 1000
    assert table["bias"][0].value == pytest.approx(expected, rel=5e-4)
    sigma = expected / table["counts_error"][0].value
    assert table["bias_sigma"][0] == pytest.approx(sigma, rel=5e-4)


def test_an_annulus_takes_away_what_the_known_sky_does_not():
    """Catches an annulus in the wrong place and a level that is not per pixel."""
    shape, rate = (140, 140), 2e-3
    # a disc without slope, far larger than annulus and frame
    radius = 400.0
    flux = rate * 2 * np.pi * radius**2 / CPS_PER_FLUX
    disc = ni.source("uniform", 70, 70, flux, radius, 0.0, 0.0)
    scene = vstack([ni.source("point", 70, 70, 2e-16), disc])
    exposure = ni.simulate(scene, observation(shape=shape, exposure=1e5))
    (known,) = ni.aperture_photometry(exposure, rows=0)
    assert known["bias"].value * (1 / known["aperture_correction"]) == pytest.approx(
        rate * 1e5 * np.pi * 25, rel=1e-4
    )
    for sky in ("mean", "median"):
        (row,) = ni.aperture_photometry(
            exposure, rows=0, sky=sky, annulus=(1.4, 8), sigma_clip=None
        )
        level = (rate + SKY) * 1e5
        pixels = np.pi * (40**2 - 7**2)
        assert abs(row["sky"].value - level) < 5 * np.sqrt(level / pixels) * 1.25
        assert abs(row["bias_percent"]) < 1e-3


def test_clipping_leaves_out_a_star_in_the_annulus():
    """Catches clipping that is parsed and then forgotten, and the median taken for the mean."""
    scene = vstack([ni.source("point", 35, 30, 1e-16), ni.source("point", 47, 30, 1e-15)])
    exposure = ni.simulate(scene, observation(exposure=1e6))

    def level(**options):
        return ni.aperture_photometry(exposure, rows=0, **options)["sky"][0].value

    true = SKY * 1e6
    assert level(sky="mean", sigma_clip=None) > 20 * true
    assert level(sky="mean") == pytest.approx(true, rel=0.2)
    assert true < level(sky="median", sigma_clip=None) < 2 * true
    assert level() == pytest.approx(true, rel=1e-12)


@pytest.mark.parametrize("options", [{}, {"sky": "mean", "sigma_clip": None}])
def test_the_scatter_is_the_error(options):
    """Catches an error without the sky's, the correction or the root of the area.

    Sum of 300 squares: it leaves its central 1 - 1e-6 with that probability.
    """
    scene, one = ni.source("point", 30.3, 30.7, 3e-17), observation(background=0.02)
    rate, _ = noise_ready_rate(scene, one)
    options = {"radius": 6.0, "annulus": (1, 1.15), **options}
    pulls = []
    for seed in range(300):
        (row,) = ni.aperture_photometry(expose(rate, scene, one, seed=seed), **options)
        pulls.append((row["counts"] - row["true_counts"] - row["bias"]) / row["counts_error"])
    pulls = np.array([float(p) for p in pulls])
    assert abs(pulls.mean()) < 4.9 / np.sqrt(300)
    assert 300 - 4.9 * np.sqrt(600) < (pulls**2).sum() < 300 + 4.9 * np.sqrt(600)


def test_the_correction_is_the_encircled_energy():
    """Catches a correction of another PSF; of a wide one the pixel does not matter."""
    one = ni.Observation(shape=(120, 120), psf=ni.MoffatPSF(0.8, 3.0), exposure=1e4)
    exposure = ni.simulate(ni.source("point", 60, 60, 1e-15), one)
    (row,) = ni.aperture_photometry(exposure, radius=0.5 * u.arcsec)
    share = psf_table(one.psf, [1.0])["encircled_energy"][0]
    assert 1 / row["aperture_correction"] == pytest.approx(share, rel=1e-3)


def test_the_corrections_of_many_stars():
    """Catches shares of another star's place, and light of the series that wraps around.

    The shares are those of closed-form pixels in photutils' own apertures, one after the other.
    """
    from photutils.aperture import CircularAperture

    rng = np.random.default_rng(4)
    places = rng.uniform(12, 50, (40, 2))
    # halves of a pixel round either way
    places[:3] = [(20.5, 30.5), (21.5, 31.0), (22.0, 31.5)]
    galaxy = ni.source("exponential", 30, 30, 3e-16, 4, 0.5, 20)
    stars = [ni.source("point", x, y, 1e-16) for x, y in places]
    scene = vstack([*stars[:7], galaxy, *stars[7:]])
    exposure = ni.simulate(scene, observation())
    rows = np.delete(rng.permutation(41), 5)
    table = ni.aperture_photometry(exposure, radius=3.3, rows=rows)
    np.testing.assert_array_equal(table["row"], rows)
    points = table[table["kind"] == "point"]
    for row in points:
        x, y = row["x"].value, row["y"].value
        own = CircularAperture((x, y), 3.3).do_photometry(star_on_pixels(x, y))[0][0]
        assert 1 / row["aperture_correction"] == pytest.approx(own, rel=1e-6)
    one = ni.aperture_photometry(exposure, radius=3.3, rows=7)[0]
    (same,) = table[table["row"] == 7]
    for name in ("aperture_counts", "net_counts", "true_counts", "counts", "bias"):
        assert same[name].value == pytest.approx(one[name].value, rel=1e-12)


@pytest.mark.parametrize("sky", ["mean", "median"])
def test_annuli_at_once_are_those_one_by_one(sky):
    """Catches a sky of another source's annulus, and clipping over several of them."""
    from astropy.stats import sigma_clip
    from photutils.aperture import EllipticalAnnulus

    scene = vstack(
        [ni.random_sources("point", 6, shape=SHAPE), ni.source("point", 900, 900, 1e-16)]
    )
    for x, y, pa in ((20, 30, 40), (44, 20, 0), (63, 40, 90)):
        scene = vstack([scene, ni.source("gaussian", x, y, 3e-16, 3, 0.6, pa)])
    exposure = ni.simulate(scene, observation(exposure=1e6), seed=3)
    table = ni.aperture_photometry(exposure, radius=3, sky=sky)
    for row in table:
        x, y, a, b = (row[name].value for name in ("x", "y", "a", "b"))
        ring = EllipticalAnnulus(
            (x, y), 2 * a, 3 * a, 3 * b, b_in=2 * b, theta=np.radians(row["pa"].value + 90)
        )
        values = ring.to_mask(method="center").get_values(exposure.counts)
        if not values.size:
            assert row["sky"].value == pytest.approx(exposure.background)
            continue
        kept = sigma_clip(values, sigma=3, maxiters=None, masked=False)
        level = kept.mean() if sky == "mean" else np.median(kept)
        assert row["sky"].value == pytest.approx(level, rel=1e-12)


def test_a_source_that_is_an_image():
    """Catches a kind that apertures do not know: alone it has no bias."""
    y, x = np.mgrid[-9:10, -9:10]
    blob = ni.image_source(np.exp(-(x**2 + y**2) / 18.0), 30, 28, flux=2e-16, pixel_scale=0.036)
    exposure = ni.simulate(blob, observation(exposure=1e6))
    (row,) = ni.aperture_photometry(exposure)
    assert 1 < row["aperture_correction"] < 1.3
    assert abs(row["bias_percent"]) < 1e-3


def test_sources_at_the_edge_outside_and_without_flux():
    """Catches NaN, and rows that are lost."""
    scene = vstack(
        [
            ni.source("point", 71.0, 30.0, 1e-16),
            ni.source("point", 500.0, 30.0, 1e-16),
            ni.source("point", 20.0, 30.0, 0.0),
        ]
    )
    table = ni.aperture_photometry(ni.simulate(scene, observation()), sky="mean")
    assert table["row"].tolist() == [0, 1, 2]
    assert table["complete"].tolist() == [False, False, True]
    assert table["bias_percent"][1] == pytest.approx(-100)
    assert -60 < table["bias_percent"][0] < -20
    for name in table.colnames:
        if name != "kind":
            assert np.isfinite(np.asarray(table[name], dtype=float)).all(), name


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"radius": 0}, "radius is 0"),
        ({"radius": 2 * u.s}, "number of pixels, or an angle"),
        ({"scale": -1.0}, "scale is -1.0"),
        ({"sky": "mode"}, "known, mean, median"),
        ({"annulus": (0.5, 2)}, "annulus is (0.5, 2)"),
        ({"annulus": 3}, "annulus is 3"),
        ({"sigma_clip": 0}, "sigma_clip is 0"),
        ({"rows": 7}, "there is no row 7; the table has 2 rows"),
        ({"scale": 500.0}, "row 1: its aperture or annulus reaches"),
    ],
)
def test_bad_options_are_named(options, words):
    scene = vstack([ni.source("point", 30, 30, 1e-16), ni.source("exponential", 30, 30, 1e-16)])
    exposure = ni.simulate(scene, observation())
    with pytest.raises(ValueError, match=re.escape(words)):
        ni.aperture_photometry(exposure, **options)


def test_the_extra_is_named_where_photutils_is_missing(monkeypatch):
    exposure = ni.simulate(ni.source("point", 30, 30, 1e-16), observation())
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name.startswith("photutils"):
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(ImportError, match=r"napari-issis\[photometry\]"):
        ni.aperture_photometry(exposure)


def test_importing_loads_no_photutils():
    code = "import sys, napari_issis; assert 'photutils' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)

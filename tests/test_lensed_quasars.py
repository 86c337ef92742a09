"""The library of lensed quasars, against astropy's sky and the separations of a catalogue."""

import tomllib
from itertools import combinations
from math import dist
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord

import napari_issis as ni
from independent_wcs import independent_wcs
from napari_issis.lensed_quasars import find_quasar, quasar_library
from napari_issis.sources import check_sources

FILE = Path(ni.__file__).parent / "lensed_quasars.toml"
SYSTEMS = tomllib.loads(FILE.read_text(encoding="utf-8"))["system"]
RATIOS = {2: (1.0, 0.5), 4: (1.0, 0.5, 0.4, 0.3)}


@pytest.mark.parametrize("entry", SYSTEMS, ids=lambda entry: entry["name"])
def test_the_widest_pair_is_as_far_apart_as_the_catalogue_has_it(entry):
    """Catches a digit or a sign mistyped: the separations come from another catalogue.

    They differ by up to 7 % where catalogues define them by other images.
    """
    if "separation" not in entry:
        return
    widest = max(dist(a, b) for a, b in combinations(entry["images"].values(), 2))
    assert widest == pytest.approx(entry["separation"], rel=0.07)
    assert len(entry.get("f814w", entry["images"])) == len(entry["images"])
    assert len(entry.get("ratios", entry["images"])) == len(entry["images"])


@pytest.mark.parametrize("name", quasar_library())
@pytest.mark.parametrize("roll", [0.0, 37.0, 250.0])
def test_images_lie_on_the_sky_where_the_file_says(name, roll):
    """Catches east to the right, a roll of the wrong sense, and a lens left at image A."""
    (entry,) = (one for one in SYSTEMS if one["name"] == name)
    images = list(entry["images"].values())
    centre = SkyCoord(150.0, 56.0, unit="deg")
    observation = ni.Observation(pointing=SkyCoord(150.001, 56.0005, unit="deg"), roll=roll)
    table = ni.lensed_quasar(
        name, observation, flux=1e-15, ratios=RATIOS[len(images)], centre=centre
    )
    arrays = check_sources(table)
    sky = independent_wcs(observation).pixel_to_world(arrays.x, arrays.y)
    assert sky[-1].separation(centre).arcsec < 1e-6
    for place, (east, north) in zip(sky[:-1], images, strict=True):
        found = centre.spherical_offsets_to(place)
        expected = (east - entry["lens"][0], north - entry["lens"][1])
        np.testing.assert_allclose([f.to_value(u.arcsec) for f in found], expected, atol=1e-4)
    np.testing.assert_allclose(arrays.flux[:-1], 1e-15 * np.array(RATIOS[len(images)]))


def test_the_lens_galaxy_turns_with_the_frame():
    """Catches a position angle that does not follow the roll, or follows it the wrong way.

    The end of the major axis is put on the sky; its position angle there is astropy's.
    """
    observation = ni.Observation(pointing=SkyCoord(10.0, 60.0, unit="deg"), roll=70.0)
    arrays = check_sources(ni.lensed_quasar("q2237 +0305", observation, centre=(200.0, 300.0)))
    x, y, pa = arrays.x[-1], arrays.y[-1], np.radians(arrays.pa[-1])
    start, end = independent_wcs(observation).pixel_to_world(
        [x, x - 10 * np.sin(pa)], [y, y + 10 * np.cos(pa)]
    )
    assert (x, y) == (200.0, 300.0)
    assert start.position_angle(end).deg % 180 == pytest.approx(65, abs=0.01)
    assert arrays.r_half[-1] == pytest.approx(1.44 / 0.036)


def test_fluxes():
    """Catches ratios relative to image A where another one is brightest, and a wrong AB zero.

    B1422+231: magnitudes 15.88, 15.85, 16.41, 19.68; AB 19 at 2000 A by F_nu lambda^-2 c.
    """
    fluxes = check_sources(ni.lensed_quasar("B1422+231", lens_galaxy=False, flux=2e-16)).flux
    assert fluxes[1] == 2e-16
    np.testing.assert_allclose(-2.5 * np.log10(fluxes / fluxes[1]), [0.03, 0, 0.56, 3.83])
    observation = ni.Observation("FUV")
    bright = check_sources(
        ni.lensed_quasar("Q0957+561", observation, flux=19 * u.ABmag, ratios={"B": 2, "A": 1})
    ).flux
    f_nu = 10 ** (-0.4 * (19 + 48.6))
    np.testing.assert_allclose(bright[1], f_nu * 2.99792458e18 / observation.pivot**2, rtol=1e-6)
    assert bright[0] / bright[1] == pytest.approx(0.5)
    # 15.92 mag below 1.13e-9, times (8140 / 2500)^1.5
    default = check_sources(ni.lensed_quasar("Einstein cross")).flux
    assert default[0] == pytest.approx(
        1.13e-9 * 10 ** (-0.4 * 15.92) * 3.256**1.5, rel=1e-12, abs=0
    )


def test_a_galaxy_of_ones_own():
    table = ni.lensed_quasar(
        "HE0435-1223", lens_galaxy={"kind": "sersic", "n": 3.0, "flux": 1e-16, "r_half": 0.36}
    )
    galaxy = check_sources(table).take([4])
    assert (galaxy.kind[0], galaxy.index[0], galaxy.flux[0]) == ("sersic", 3.0, 1e-16)
    assert galaxy.r_half[0] == pytest.approx(10.0)
    assert len(ni.lensed_quasar("HE0435-1223", lens_galaxy=False)) == 4


def test_the_list_has_every_system_with_its_references():
    table = ni.lensed_quasars()
    assert list(table["name"]) == [entry["name"] for entry in SYSTEMS]
    assert all(table["references"])
    assert "lens" in find_quasar("HE2149-2745").uncertain
    assert table[list(table["name"]).index("PG1115+080")]["images"] == "A1 A2 B C"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"name": "Q9999"}, "no lensed quasar 'Q9999' in the library; known: Q2237"),
        ({"name": "SBS1520+530", "flux": 1e-15}, "no flux ratios of SBS1520.530 .* A, B"),
        ({"name": "Q0957+561"}, "no flux of Q0957.561 is known here; give flux="),
        ({"flux": 19}, "flux is 19; .* 19 . u.ABmag"),
        ({"flux": -1}, "flux is -1"),
        ({"flux": 1 * u.m}, "flux is .* give one number"),
        ({"ratios": (1, 2)}, "ratios has 2 numbers"),
        ({"ratios": (1, 2, -3, 4)}, "image C is -3"),
        ({"ratios": (0, 0, 0, 0)}, "all 0"),
        ({"ratios": {"A": 1}}, "ratios are of A"),
        ({"lens_galaxy": {"size": 1}}, "lens_galaxy has 'size'; known: kind"),
        ({"lens_galaxy": 1e-15}, "lens_galaxy is 1e-15"),
        ({"centre": SkyCoord(1, 2, unit="deg")}, "no position on the sky"),
        ({"centre": (np.nan, 1)}, "centre is .* finite"),
        ({"centre": 5}, "centre is 5; give"),
    ],
)
def test_bad_input(options, message):
    with pytest.raises(ValueError, match=message):
        ni.lensed_quasar(**{"name": "Q2237+0305", **options})

"""Model lenses, against the closed solutions of isothermal spheres and ellipsoids."""

import sys

import numpy as np
import pytest

import napari_issis as ni
from napari_issis.sources import check_sources

pytest.importorskip("lenstronomy")
CENTRE = 255.5


def east_north(table):
    arrays = check_sources(table)
    return np.stack([-(arrays.x - CENTRE), arrays.y - CENTRE], axis=1) * 0.036


def test_isothermal_sphere():
    """Catches a mirrored sky, and a flux that is not magnified.

    Images at beta +- theta_E on the line through lens and source; magnifications
    1 +- theta_E / beta (Schneider, Ehlers & Falco 1992, section 8.1.4).
    """
    table = ni.lens_images(einstein_radius=1.2, quasar=(0.24, -0.32), flux=1e-16)
    direction = np.array([0.6, -0.8])
    np.testing.assert_allclose(
        east_north(table), np.outer([0.4 + 1.2, 0.4 - 1.2], direction), atol=1e-5
    )
    np.testing.assert_allclose(table["magnification"], [1 + 1.2 / 0.4, 1 - 1.2 / 0.4], rtol=1e-5)
    np.testing.assert_allclose(table["flux"].value, [4e-16, 2e-16], rtol=1e-5)


@pytest.mark.parametrize("pa", [0.0, 30.0, 120.0])
def test_isothermal_ellipsoid(pa):
    """Catches an angle from the wrong axis, or clockwise, and another Einstein radius.

    A source behind the centre has images on the axes (Kormann et al. 1994, section 4), at
    theta_E sqrt(q) / f arccos(q) on the major and theta_E sqrt(q) / f artanh(f) on the minor
    one, f^2 = 1 - q^2; the magnification is 1 / (1 - 2 kappa).
    """
    q, radius = 0.6, 1.5
    f = np.sqrt(1 - q**2)
    table = ni.lens_images(
        einstein_radius=radius, ellipticity=1 - q, pa=pa, quasar=(0, 0), flux=1e-16
    )
    places = east_north(table)
    major = np.array([np.sin(np.radians(pa)), np.cos(np.radians(pa))])
    minor = np.array([major[1], -major[0]])
    along, across = places @ major, places @ minor
    on_major = radius * np.sqrt(q) / f * np.arccos(q)
    on_minor = radius * np.sqrt(q) / f * np.arctanh(f)
    expected = {(-on_major, 0), (on_major, 0), (0, -on_minor), (0, on_minor)}
    found = np.stack([along, across], axis=1)
    assert len(found) == 4
    for image in expected:
        assert np.abs(found - image).max(axis=1).min() < 1e-4
    kappa = radius / (2 * np.sqrt(q * along**2 + across**2 / q))
    np.testing.assert_allclose(table["magnification"], 1 / (1 - 2 * kappa), rtol=1e-4)


def test_shear_stretches_along_its_position_angle():
    """Catches shear at right angles to where it should be.

    A source at b along the shear's axis: (1 - gamma) x = b + theta_E; at right angles,
    (1 + gamma) y = b + theta_E.
    """
    pa = np.radians(40.0)
    for angle, factor in ((pa, 1 - 0.1), (pa + np.pi / 2, 1 + 0.1)):
        direction = np.array([np.sin(angle), np.cos(angle)])
        table = ni.lens_images(
            einstein_radius=1.0, shear=0.1, shear_pa=40.0, quasar=0.3 * direction, flux=1e-16
        )
        outer = (east_north(table) @ direction).max()
        assert outer == pytest.approx(1.3 / factor, abs=1e-4)


def test_bad_input():
    good = {"einstein_radius": 1.0, "quasar": (0.1, 0.0), "flux": 1e-16}
    for options, message in (
        ({"einstein_radius": 0}, "einstein_radius is 0"),
        ({"ellipticity": 1}, "ellipticity is 1"),
        ({"shear": -0.1}, "shear is -0.1"),
        ({"pa": np.nan}, "pa is nan"),
        ({"quasar": 3}, "quasar is 3"),
        ({"quasar": (0, 0)}, "its image is a ring"),
        ({"flux": -1e-16}, "flux: -"),
    ):
        with pytest.raises(ValueError, match=message):
            ni.lens_images(**{**good, **options})


def test_without_lenstronomy_the_message_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "lenstronomy.LensModel.lens_model", None)
    with pytest.raises(ImportError, match=r'pip install "napari-issis\[lens\]"'):
        ni.lens_images(einstein_radius=1.0, quasar=(0.1, 0.0), flux=1e-16)

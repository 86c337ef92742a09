"""Arcs of a host galaxy: rings and magnifications of the isothermal sphere in closed form."""

import numpy as np
import pytest
from scipy import integrate, special

import napari_issis as ni

pytest.importorskip("lenstronomy")
SCALE = 0.018


def profile(r, r_half, n):
    """Sersic profile of unit flux."""
    b = special.gammaincinv(2 * n, 0.5)
    shape = np.exp(-b * (r / r_half) ** (1 / n))
    scale = integrate.quad(lambda t: 2 * np.pi * t * np.exp(-b * t ** (1 / n)), 0, np.inf)[0]
    return shape / (scale * r_half**2)


def places(arcs, scale=SCALE):
    """East and north of the centres of the samples, arcsec."""
    half = len(arcs) // 2
    along = np.arange(-half, half + 1) * scale
    return np.meshgrid(-along, along)


@pytest.mark.parametrize("n", [0.5, 1.0, 2.5])
def test_total_magnification_of_a_ring(n):
    """Catches a host whose flux is not that without the lens, and lost or doubled light.

    A point at b behind an isothermal sphere is magnified by 2 theta_E / b inside theta_E and by
    1 + theta_E / b outside (Schneider, Ehlers & Falco 1992, section 8.1.4); a host behind the
    centre by the mean over its light.
    """
    theta, r_half = 1.1, 0.25
    arcs = ni.host_arcs(
        einstein_radius=theta, quasar=(0, 0), flux=3e-16, r_half=r_half, n=n, width=12.0
    )

    def light(b, weight):
        return 2 * np.pi * b * profile(b, r_half, n) * weight

    inner = integrate.quad(lambda b: light(b, 2 * theta / b), 0, theta)[0]
    outer = integrate.quad(lambda b: light(b, 1 + theta / b), theta, 30)[0]
    assert arcs.sum() / 3e-16 == pytest.approx(inner + outer, rel=2e-3)


def test_surface_brightness_is_conserved():
    """Catches a mirrored sky and rays that are bent the wrong way.

    The isothermal sphere maps the place at t to t - theta_E t / |t|.
    """
    theta, r_half, quasar = 1.1, 0.2, np.array([0.3, -0.15])
    arcs = ni.host_arcs(einstein_radius=theta, quasar=quasar, flux=1.0, r_half=r_half)
    east, north = places(arcs)
    r = np.maximum(np.hypot(east, north), 1e-9)
    apart = np.hypot(east * (1 - theta / r) - quasar[0], north * (1 - theta / r) - quasar[1])
    expected = profile(apart, r_half, 1.0) * SCALE**2
    # away from the host's cusp and the lens's centre a sample is as bright as its middle
    smooth = (apart > 0.12) & (r > 0.15)
    np.testing.assert_allclose(arcs[smooth], expected[smooth], rtol=0.03)
    assert np.median(np.abs(arcs / expected - 1)[smooth]) < 2e-3
    outer = (theta / np.hypot(*quasar) + 1) * quasar
    column, row = np.rint(outer * [-1, 1] / SCALE).astype(int) + len(arcs) // 2
    assert arcs[row, column] > 0.8 * arcs.max()


def test_without_a_lens_it_is_the_host_itself():
    """Catches a position angle from the wrong axis or clockwise, and semi-axes exchanged."""
    pa, ellipticity, r_half = 30.0, 0.5, 0.4
    arcs = ni.host_arcs(
        einstein_radius=1e-9,
        quasar=(0.2, 0.1),
        flux=2e-16,
        r_half=r_half,
        n=0.5,
        host_ellipticity=ellipticity,
        host_pa=pa,
    )
    assert arcs.sum() / 2e-16 == pytest.approx(1.0, rel=1e-5)
    share, (east, north) = arcs / arcs.sum(), places(arcs)
    de, dn = east - (share * east).sum(), north - (share * north).sum()
    assert (share * east).sum() == pytest.approx(0.2, abs=1e-6)
    assert (share * north).sum() == pytest.approx(0.1, abs=1e-6)
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    along, across = de * sin + dn * cos, -de * cos + dn * sin
    sigma = r_half / 1.1774100225154747
    assert (share * along**2).sum() == pytest.approx(sigma**2, rel=2e-3)
    assert (share * across**2).sum() == pytest.approx((sigma * (1 - ellipticity)) ** 2, rel=2e-3)
    assert abs((share * along * across).sum()) < 1e-4 * sigma**2


def test_a_small_host_lies_where_the_quasar_does():
    """Catches another lens than that of the quasar's images: place and magnification."""
    lens = {
        "einstein_radius": 1.2,
        "ellipticity": 0.3,
        "pa": 30.0,
        "shear": 0.05,
        "shear_pa": 80.0,
        "quasar": (0.05, 0.1),
        "flux": 1e-16,
    }
    images = ni.lens_images(ni.Observation(shape=(101, 101)), **lens)
    arcs = ni.host_arcs(**lens, r_half=0.004, n=0.5, width=5.0, pixel_scale=0.006)
    east, north = places(arcs, 0.006)
    assert len(images) == 4
    for x, y, flux in zip(images["x"], images["y"], images["flux"].value, strict=True):
        e, n = -(x - 50) * 0.036, (y - 50) * 0.036
        near = np.hypot(east - e, north - n) < 0.15
        assert arcs[near].sum() / flux == pytest.approx(1.0, rel=0.05)
        assert np.average(east[near], weights=arcs[near]) == pytest.approx(e, abs=0.01)
        assert np.average(north[near], weights=arcs[near]) == pytest.approx(n, abs=0.01)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"einstein_radius": 0}, "einstein_radius is 0"),
        ({"r_half": 0}, "r_half is 0"),
        ({"n": 9}, "n is 9"),
        ({"flux": -1e-16}, "flux is -1e-16"),
        ({"flux": 19}, "flux is 19"),
        ({"host_ellipticity": 1}, "host_ellipticity is 1"),
        ({"host_pa": np.inf}, "host_pa is inf"),
        ({"quasar": 3}, "quasar is 3"),
        ({"pixel_scale": 1e-3}, "more than 1024 a side"),
        ({"width": -1.0}, "width is -1"),
    ],
)
def test_bad_input(options, message):
    good = {"einstein_radius": 1.0, "quasar": (0.1, 0.0), "flux": 1e-16, "r_half": 0.2}
    with pytest.raises(ValueError, match=message):
        ni.host_arcs(**{**good, **options})


def test_as_a_source_in_a_rolled_frame():
    """Catches arcs that are mirrored or turned the wrong way when they become a source.

    A small host has an arc about each image of the quasar, as bright as that image.
    """
    frame = ni.Observation(shape=(121, 121), exposure=100.0, roll=25.0, psf=ni.GaussianPSF(0.08))
    lens = {"einstein_radius": 1.2, "ellipticity": 0.3, "pa": 30.0, "quasar": (0.05, 0.1)}
    images = ni.lens_images(frame, **lens, flux=1e-15)
    arcs = ni.host_arcs(**lens, flux=1e-15, r_half=0.01, n=0.5, width=4.5, pixel_scale=0.012)
    host = ni.image_source(arcs, 60.0, 60.0, arcs.sum(), pixel_scale=0.012, pa=-frame.roll)
    rate = ni.count_rate(host, frame)
    y, x = np.indices(rate.shape)
    for image in images:
        at = float(image["x"]), float(image["y"])
        near = np.hypot(x - at[0], y - at[1]) < 8
        share = rate[near].sum() / (image["flux"].value * frame.cps_per_flux)
        assert share == pytest.approx(1.0, rel=0.1)
        assert np.average(x[near], weights=rate[near]) == pytest.approx(at[0], abs=0.5)
        assert np.average(y[near], weights=rate[near]) == pytest.approx(at[1], abs=0.5)

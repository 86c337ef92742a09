"""Half-light radii from 1e-4 to 1e5 pixels, ellipticities to 0.999, any position angle."""

import ellipse_quadrature
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import CPS, PIXEL, psf_of, table_of

import napari_issis as ni

SHAPE = (17, 22)
INDEX = {"gaussian": 0.5, "exponential": 1.0, "devaucouleurs": 4.0}
EXTENDED = ["uniform", "gaussian", "exponential", "devaucouleurs", "sersic"]
SIGMA_PER_FWHM = 1 / np.sqrt(8 * np.log(2))


def check(source, fwhm, tolerance):
    """Compare the brightest pixel, the corners and the source's own pixel with quadrature."""
    x, y = source[1:3]
    observation = ni.Observation(shape=SHAPE, psf=psf_of("gaussian", (fwhm,)))
    image = ni.count_rate(table_of([(1e-14, *source)]), observation, tolerance=tolerance)
    pixels = {tuple(int(i) for i in np.unravel_index(image.argmax(), SHAPE)), (0, 21), (16, 0)}
    pixels.add((int(np.clip(round(y), 0, 16)), int(np.clip(round(x), 0, 21))))
    pixels = sorted(pixels)
    expected = 1e-14 * CPS * ellipse_quadrature.rate(source, pixels, fwhm * SIGMA_PER_FWHM)
    got = np.array([image[p] for p in pixels])
    assert np.abs(got - expected).max() <= tolerance * image.max()


@pytest.mark.parametrize("ellipticity", [0.0, 0.999])
@pytest.mark.parametrize("r_half", [1e-4, 3.0, 1e5])
@pytest.mark.parametrize("kind", EXTENDED)
def test_corners_of_the_range(kind, r_half, ellipticity):
    """Catches a clamped radius, a needle cut into too few pieces, a lost cusp or edge."""
    check((kind, 9.3, 7.6, r_half, ellipticity, 31.0, INDEX.get(kind, 2.5)), 2.0, 1e-7)


@pytest.mark.parametrize("n", [0.5, 0.501, 1.0, 8.0])
@pytest.mark.parametrize("r_half", [1e-4, 1e5])
def test_extreme_indices(n, r_half):
    """Catches an index treated as its neighbour and a cusp that is not followed inwards."""
    check(("sersic", 9.3, 7.6, r_half, 0.6, 200.0, n), 1.2, 1e-7)


@given(
    st.sampled_from(EXTENDED),
    st.floats(-4, 5),
    st.sampled_from([0.0, 0.3, 0.9, 0.99, 0.999]),
    st.floats(-1000, 1000),
    st.floats(0.5, 8),
    st.floats(-3, 25),
    st.floats(-3, 20),
    st.floats(-8, -2),
)
def test_any_ellipse(kind, log_r, ellipticity, pa, n, x, y, log_tolerance):
    """Catches a wrong sign or period of the position angle, axes exchanged, a bad crossover."""
    check((kind, x, y, 10**log_r, ellipticity, pa, INDEX.get(kind, n)), 1.5, 10**log_tolerance)


PSFS = [
    psf_of("gaussian", (1.0,)),
    psf_of("moffat", (1.5, 2.5)),
    psf_of("telescope", (0.6, 0.35, 2500.0, 2500.0, 0.05)),
    ni.ImagePSF(np.outer([1, 4, 6, 4, 1], [1, 3, 1]), 1.7 * PIXEL),
]


@pytest.mark.parametrize("psf", PSFS, ids=lambda psf: type(psf).__name__)
@pytest.mark.parametrize("kind", EXTENDED)
def test_vanishing_size_is_a_point(kind, psf):
    """Catches a small source handled apart from points with another centre or flux."""
    observation = ni.Observation(shape=SHAPE, psf=psf)
    point = ni.count_rate(ni.source("point", 8.3, 9.5, 1e-14), observation, tolerance=1e-8)
    tiny = table_of([(1e-14, kind, 8.3, 9.5, 1e-6, 0.5, 20.0, INDEX.get(kind, 1.5))])
    image = ni.count_rate(tiny, observation, tolerance=1e-8)
    assert np.abs(image - point).max() <= 2e-8 * point.max()


@given(st.floats(-180, 180), st.sampled_from([-720, -360, -180, 180, 540]))
def test_half_a_turn_changes_nothing(pa, turn):
    """Catches angles reduced to 0-180 with a wrong sign, or not reduced at all."""
    observation = ni.Observation(shape=SHAPE, psf=psf_of("gaussian", (2.0,)))
    first, second = (
        ni.count_rate(
            ni.source("exponential", 9.2, 8.1, 1e-14, 4.0, 0.7, angle), observation, tolerance=1e-8
        )
        for angle in (pa, pa + turn)
    )
    assert np.abs(first - second).max() <= 2e-8 * first.max()

"""What must hold of any scene, whatever its exact image: random scenes of every kind and PSF."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_scene import CPS, PIXEL, psf_of, table_of
from random_scene import promised_error, random_scene

import napari_issis as ni

seeds = st.integers(10_000, 10**9)


def render(scene, tolerance=1e-5, **changes):
    """Return the image and the error promised for it."""
    scene = replace(scene, tolerance=tolerance, **changes)
    observation = ni.Observation(shape=scene.shape, psf=psf_of(*scene.psf))
    image = ni.count_rate(table_of(scene.sources), observation, tolerance=tolerance)
    return image, promised_error(scene, image.max(), CPS, PIXEL)


def moved(sources, dy, dx):
    return [(flux, kind, x + dx, y + dy, *rest) for flux, kind, x, y, *rest in sources]


@given(seeds, st.floats(-6, 6))
def test_linear_in_flux(seed, decades):
    """Catches an absolute threshold: a source dropped because its flux looks small."""
    scene = random_scene(seed)
    factor = 10**decades
    brighter = [(flux * factor, *rest) for flux, *rest in scene.sources]
    first, first_error = render(scene)
    second, second_error = render(scene, sources=brighter)
    assert np.abs(second - factor * first).max() <= second_error + factor * first_error


@given(seeds, seeds)
def test_superposition(first_seed, second_seed):
    """Catches sources that disturb each other: a faint one dropped beside a bright one."""
    scene, other = random_scene(first_seed), random_scene(second_seed)
    ratio = max(source[0] for source in scene.sources) / max(s[0] for s in other.sources)
    fainter = [(1e-4 * ratio * flux, *rest) for flux, *rest in other.sources]
    both, error = render(scene, 1e-6, sources=scene.sources + fainter)
    for part in (scene.sources, fainter):
        image, part_error = render(scene, 1e-6, sources=part)
        both = both - image
        error += part_error
    assert np.abs(both).max() <= error


@given(seeds, st.integers(-30, 30), st.integers(-30, 30), st.integers(0, 20), st.integers(0, 20))
def test_whole_pixel_shift_of_sources_and_frame(seed, dy, dx, more_y, more_x):
    """Catches a frame's edge, size or parity that changes what falls inside it."""
    scene = random_scene(seed)
    ny, nx = scene.shape
    first, error = render(scene)
    shape = (ny + more_y + abs(dy), nx + more_x + abs(dx))
    second, second_error = render(scene, shape=shape, sources=moved(scene.sources, dy, dx))
    in_first = first[max(-dy, 0) :, max(-dx, 0) :]
    in_second = second[max(dy, 0) : max(dy + ny, 0), max(dx, 0) : max(dx + nx, 0)]
    assert in_first.shape == in_second.shape
    assert np.abs(in_first - in_second).max(initial=0) <= error + second_error


@given(seeds)
def test_half_turn(seed):
    """Catches a centre half a pixel off, in a radial PSF of any kind."""
    scene = random_scene(seed)
    ny, nx = scene.shape
    turned = [(f, kind, nx - 1 - x, ny - 1 - y, *rest) for f, kind, x, y, *rest in scene.sources]
    first, error = render(scene)
    second, second_error = render(scene, sources=turned)
    assert np.abs(first[::-1, ::-1] - second).max() <= error + second_error


@given(seeds)
def test_transposition(seed):
    """Catches axes treated differently and angles counted from another axis: pa becomes 90 - pa."""
    scene = random_scene(seed)
    transposed = [(f, kind, y, x, r, e, 90 - pa, n) for f, kind, x, y, r, e, pa, n in scene.sources]
    first, error = render(scene)
    second, second_error = render(scene, shape=scene.shape[::-1], sources=transposed)
    assert np.abs(first.T - second).max() <= error + second_error


@given(seeds, st.randoms(use_true_random=False))
def test_order_of_the_sources(seed, shuffler):
    """Catches a row whose PSF, index or angle is taken from another row."""
    scene = random_scene(seed)
    sources = scene.sources + moved(scene.sources, 1.3, 2.1)
    first, error = render(scene, sources=sources)
    shuffler.shuffle(sources)
    second, _ = render(scene, sources=sources)
    assert np.abs(first - second).max() <= 2 * error


@given(seeds, st.floats(-7, -2))
def test_nothing_below_zero_beyond_the_tolerance(seed, log_tolerance):
    """Catches ringing of a filter: these profiles and PSFs have no negative light."""
    image, error = render(random_scene(seed), 10**log_tolerance)
    assert image.min() >= -error


@pytest.mark.parametrize("step", [1.0, 2.0])
def test_true_negative_light_is_removed_and_reported(step):
    """Catches negative expectations handed to Poisson, and a clip that goes unreported.

    A PSF image of one sample is a sinc: its trough is negative by far more than a tolerance.
    """
    psf = ni.ImagePSF([[1.0]], step * PIXEL, includes_pixel=True)
    observation = ni.Observation(shape=(15, 18), psf=psf, exposure=50.0)
    exposure = ni.simulate(ni.source("point", 8.3, 7.4, 1e-15), observation)
    image = (
        np.outer(np.sinc((np.arange(15) - 7.4) / step), np.sinc((np.arange(18) - 8.3) / step))
        / step**2
    )
    expected = 1e-15 * CPS * image
    assert expected.min() < -0.01 * expected.max()
    bound = 50.0 * 1e-6 * expected.max()
    assert abs(exposure.clipped + 50.0 * expected.min()) <= bound
    wanted = 50.0 * (np.maximum(expected, 0) + observation.sky_rate)
    assert np.abs(exposure.expected - wanted).max() <= bound
    assert exposure.counts.min() >= 0

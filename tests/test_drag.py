"""Sources moved on the rest of a scene: against a render of the whole, and without history."""

import numpy as np
import pytest
from astropy.table import vstack

import napari_issis as ni
from napari_issis.render import arrays_and_rates, moving
from napari_issis.render.optics import Optics
from watching import watch_transforms

SHAPE = (120, 100)
OBSERVATION = ni.Observation(shape=SHAPE)
Y, X = np.mgrid[-18:19, -18:19]
PSFS = {
    "channel": None,
    "rings": ni.TelescopePSF(1.7, 0.35, 2500.0, 0.03),
    # an image without symmetry, sampled well enough
    "image": ni.ImagePSF(
        np.exp(-0.1 * (Y**2 + X**2 + X * Y)) + 0.2 * np.exp(-0.2 * ((Y - 5) ** 2 + X**2)), 0.018
    ),
}
KINDS = ["point", "uniform", "gaussian", "exponential", "devaucouleurs"]


def scene(kind, seed=0):
    stars = ni.random_sources("point", 30, shape=SHAPE, seed=seed)
    moved = ni.source(kind, 50.0, 60.0, 5e-15, r_half=9.0, ellipticity=0.5, pa=30.0)
    return vstack([stars, moved])


def at(table, x, y):
    moved = table[-1:].copy()
    moved["x"], moved["y"] = x, y
    return moved


def worst(rate, table, observation):
    """Error over the peak against the whole rendered a hundred times better."""
    expected = ni.count_rate(table, observation, tolerance=1e-7)
    return np.abs(rate - expected).max() / expected.max()


@pytest.mark.parametrize("psf", PSFS)
@pytest.mark.parametrize("kind", KINDS)
def test_error_is_within_the_tolerance(kind, psf):
    """Catches a window cut too small, light wrapped around it, half a pixel, aliases unfolded."""
    observation = OBSERVATION.replace(psf=PSFS[psf])
    table = scene(kind)
    drag = ni.Drag(table, observation, [30], tolerance=1e-5)
    for x, y in [(50.0, 60.0), (20.37, 99.81), (-3.2, 40.5), (99.5, 119.5), (98.0, 3.0)]:
        moved = at(table, x, y)
        drag.move(moved)
        assert worst(drag.rate, vstack([table[:-1], moved]), observation) <= 1e-5


@pytest.mark.parametrize("kind", KINDS)
def test_editing_is_moving(kind):
    """Size, angle, flux and kind may change: catches a spectrum kept too long."""
    table = scene(kind)
    drag = ni.Drag(table, OBSERVATION, [30])
    edited = ni.source("exponential", 55.5, 30.25, 2e-15, r_half=5.0, ellipticity=0.3, pa=-20.0)
    for column, value in [("r_half", 6.0), ("pa", 80.0), ("ellipticity", 0.0), ("flux", 4e-15)]:
        edited[column][0] = value * (getattr(edited[column], "unit", None) or 1)
        drag.move(edited)
        assert worst(drag.rate, vstack([table[:-1], edited]), OBSERVATION) <= 1e-5


@pytest.mark.parametrize(("kind", "moves"), [("point", 10_000), ("exponential", 500)])
def test_thousands_of_moves_leave_nothing_behind(kind, moves):
    """Catches drift: light added and taken away again leaves rounding errors."""
    table = scene(kind)
    drag = ni.Drag(table, OBSERVATION, [30])
    rng = np.random.default_rng(1)
    moved = at(table, 0.0, 0.0)
    for x, y in rng.uniform(-20, 140, (moves, 2)):
        moved["x"], moved["y"] = x, y
        drag.move(moved)
    fresh = ni.Drag(vstack([table[:-1], moved]), OBSERVATION, [30])
    assert np.array_equal(drag.rate, fresh.rate)
    drag.move(moved[:0])
    assert np.array_equal(drag.rate, drag.rest)


def test_nothing_changes_outside_of_the_windows():
    table = scene("point")
    drag = ni.Drag(table, ni.Observation(shape=(400, 300)), [30])
    before = drag.rate.copy()
    windows = drag.move(at(table, 55.0, 63.0))
    touched = np.zeros(before.shape, dtype=bool)
    for window in windows:
        touched[window] = True
    assert np.array_equal(drag.rate != before, (drag.rate != before) & touched)
    assert 0 < touched.sum() < 0.2 * touched.size


def test_a_move_renders_nothing_else(monkeypatch):
    """A moved source is one small transform: no render of the frame, no new spectrum."""
    table = scene("exponential")
    drag = ni.Drag(table, OBSERVATION, [30])
    monkeypatch.setattr("napari_issis.render._render", None)
    monkeypatch.setattr(moving, "transform", None)
    drag.move(at(table, 33.3, 44.4))
    with pytest.raises(TypeError):
        drag.move(ni.source("exponential", 33.3, 44.4, 1e-15, r_half=2.0))


def test_a_source_off_the_frame_is_not_transformed(monkeypatch):
    """Catches a transform made for a window that misses the frame."""
    table = scene("exponential")
    drag = ni.Drag(table, OBSERVATION, [30])
    transforms = watch_transforms(monkeypatch)
    drag.move(at(table, -900.0, 44.4))
    assert not transforms
    assert np.array_equal(drag.rate, drag.rest)
    drag.move(at(table, 33.3, 44.4))
    assert transforms


def test_what_is_negligible_is_left_out():
    table = scene("exponential")
    drag = ni.Drag(table, OBSERVATION, [30], negligible=0.1)
    expected = ni.count_rate(table, OBSERVATION, tolerance=1e-7)
    error = np.abs(drag.rate - expected).max()
    assert 1e-5 * expected.max() < error <= 0.1


def test_many_sources_are_rendered_together():
    table = scene("gaussian")
    drag = ni.Drag(table, OBSERVATION, np.arange(30))
    moved = table[:30].copy()
    moved["x"] += 5.5
    drag.move(moved)
    assert worst(drag.rate, vstack([moved, table[30:]]), OBSERVATION) <= 1e-5


def test_what_no_window_holds_is_rendered():
    table = scene("exponential")
    drag = ni.Drag(table, OBSERVATION, [30])
    huge = ni.source("devaucouleurs", 50.0, 60.0, 1e-13, r_half=2000.0, ellipticity=0.2, pa=10.0)
    drag.move(huge)
    assert worst(drag.rate, vstack([table[:-1], huge]), OBSERVATION) <= 1e-5


def test_dark_sources_and_an_empty_scene():
    nothing = ni.source("point", 5.0, 5.0, 0.0)
    drag = ni.Drag(nothing, OBSERVATION, [0])
    assert not drag.rate.any()
    assert drag.move(nothing) == []


def test_refusals():
    table = scene("point")
    with pytest.raises(ValueError, match="rest has the shape"):
        ni.Drag(table, OBSERVATION, [30], rest=np.zeros((3, 4)))
    with pytest.raises(ValueError, match="row 40"):
        ni.Drag(table, OBSERVATION, [40])
    drag = ni.Drag(table, OBSERVATION, [30])
    before = drag.rate.copy()
    with pytest.raises(ValueError, match="row 0, x: nan"):
        drag.move(at(table, np.nan, 3.0))
    assert np.array_equal(drag.rate, before)


def test_a_source_too_faint_to_be_seen():
    """Catches the logarithm of a highest frequency of zero."""
    stars = ni.source("point", 30.0, 40.0, 1e-12)
    with np.errstate(divide="raise", invalid="raise"):
        drag = ni.Drag(
            vstack([stars, ni.source("exponential", 50.0, 60.0, 1e-24)]), OBSERVATION, [1]
        )
        drag.move(ni.source("exponential", 51.0, 60.0, 1e-24, r_half=12.0))
    assert np.abs(drag.rate - drag.rest).max() <= 1e-5 * drag.rest.max()


@pytest.mark.parametrize("r_half", [1.0, 1.03, 1.06])
def test_a_window_that_fills_the_frame_is_still_a_window(r_half):
    """Catches windows refused for what they are rounded up by, and the frame rendered instead."""
    optics = Optics(OBSERVATION.effective_psf, OBSERVATION.pixel_scale)
    table = ni.source("gaussian", 50.0, 60.0, 1e-12, r_half=20.0 * r_half)
    one, (rate,) = arrays_and_rates(table, OBSERVATION)
    allowed = 1e-5 * rate
    half = moving.half_sizes(optics, one, rate, moving.SHARE * allowed)
    made = moving.moving_source(optics, one, rate, allowed, half)
    assert made.half[0] >= half[0]
    assert made.half[1] >= half[1]

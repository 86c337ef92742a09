"""Gaussians painted by compiled code: right, the same in any number of threads, only where it pays.

The images of the random scenes in `stress/test_random_scenes.py` are made with it and without.
"""

import subprocess
import sys

import numpy as np
import pytest

import napari_issis as ni
from napari_issis.render import painting
from napari_issis.render.compiled_painting import painter
from napari_issis.render.gaussians import ellipse
from test_reference_images import load

CELL, SPREAD, CUT = 0.4, 0.7, 8.0
SHAPE = (301, 403)
# x, y, rate, major, minor, position angle
LIGHTS = {
    "round": (60.3, 50.2, 2.0, 3.0, 3.0, 0.0),
    "a point": (80.21, 60.93, 1.0, 0.0, 0.0, 0.0),
    "tilted left": (70.0, 61.4, 1.0, 6.0, 1.5, 40.0),
    "tilted right": (70.0, 61.4, 1.0, 6.0, 1.5, 140.0),
    "needle": (70.2, 61.4, 1.0, 5.0, 0.0, 45.0),
    "dark": (75.2, 41.4, -3.0, 4.0, 2.0, 100.0),
    "between cells": (75.4, 41.6, 1.0, 0.0, 0.0, 0.0),
}


def gaussians(names):
    x, y, rate, major, minor, pa = np.array([LIGHTS[name] for name in names]).T
    return ellipse(x, y, rate, major, minor, np.radians(pa))


def painted(names, dtype=float, shape=SHAPE):
    mesh = np.zeros(shape, dtype)
    painting.paint(mesh, (0.2, 0.3), CELL, gaussians(names), SPREAD, CUT, painter())
    return mesh


def exact(names):
    """The Gaussians by their definition, position angles from +y towards -x."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]] * CELL
    total = np.zeros(SHAPE)
    for name in names:
        centre_x, centre_y, rate, major, minor, pa = LIGHTS[name]
        dx, dy = x + 0.3 - centre_x, y + 0.2 - centre_y
        sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
        along, across = -dx * sin + dy * cos, dx * cos + dy * sin
        long, short = major**2 + SPREAD**2, minor**2 + SPREAD**2
        shape = np.exp(-0.5 * (along**2 / long + across**2 / short))
        total += rate * shape / (2 * np.pi * np.sqrt(long * short))
    return total


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("names", [*([name] for name in LIGHTS), list(LIGHTS)])
def test_every_gaussian_is_right(names, dtype):
    """Catches the sign of the tilt, a series that starts or ends a point too late, a row left
    out, a sign lost, half a cell."""
    expected = exact(names)
    accuracy = 2e-14 if dtype is np.float64 else 3e-7
    assert painted(names, dtype).dtype == dtype
    difference = np.abs(painted(names, dtype) - expected).max()
    assert difference <= accuracy * np.abs(expected).max()


def test_a_gaussian_at_the_edge_stays_on_the_mesh():
    """Catches writing beyond a row's end, which shows in the next row, or beyond the mesh."""
    names = list(LIGHTS)
    whole = painted(names)
    rows, columns = 160, 190  # the edges cut through all of them
    part = painted(names, shape=(rows, columns))
    np.testing.assert_allclose(part, whole[:rows, :columns], rtol=0, atol=2e-14 * whole.max())


def test_the_share_of_rows_changes_nothing(monkeypatch):
    """Catches rows painted twice or by none where threads share them, and a result that depends
    on where a share begins."""
    one = painted(list(LIGHTS))
    for rows in (1, 7, 1000):
        monkeypatch.setattr(painting, "ROWS", rows)
        assert np.array_equal(painted(list(LIGHTS)), one)


@pytest.fixture
def galaxies():
    return load("exponential100_telescope")[:2]


def test_painted_with_and_without(galaxies, monkeypatch):
    """Catches compiled code that is not used where it pays, and a fall-back that does not work."""
    compiled = ni.count_rate(*galaxies, tolerance=1e-8)
    monkeypatch.setattr(painting, "painter", lambda: None)
    plain = ni.count_rate(*galaxies, tolerance=1e-8)
    assert not np.array_equal(compiled, plain)
    np.testing.assert_allclose(compiled, plain, rtol=0, atol=3e-9 * plain.max())


def test_the_image_does_not_depend_on_what_was_painted_before(galaxies):
    """Catches compiled code that is used from when it happens to be loaded."""
    table, observation = galaxies
    before = ni.count_rate(table[:10], observation)
    ni.count_rate(table, observation)
    assert np.array_equal(ni.count_rate(table[:10], observation), before)


SMALL = """
import sys
import napari_issis as ni
ni.count_rate(ni.random_sources("exponential", 10, seed=1))
assert "numba" not in sys.modules
"""

MISSING = """
import sys
sys.modules["numba"] = None
import napari_issis as ni
from napari_issis.render.compiled_painting import painter
table = ni.random_sources("exponential", 60, seed=1)
assert ni.count_rate(table, tolerance=1e-8).max() > 0
assert painter() is None
"""

# what numba says where neither the package nor the user's directory can be written
NO_PLACE = """
import numba
def njit(*args, **options):
    raise RuntimeError("cannot cache function '_paint_rows': no locator available")
numba.njit = njit
import napari_issis as ni
from napari_issis.render.compiled_painting import painter
assert painter() is None
"""


@pytest.mark.parametrize(
    "code", [SMALL, MISSING, NO_PLACE], ids=["small scene", "numba is missing", "no directory"]
)
def test_numba_is_not_needed(code):
    """Catches half a second spent on a scene that gains a millisecond, and a crash without it."""
    subprocess.run([sys.executable, "-c", code], check=True)

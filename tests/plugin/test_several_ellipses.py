"""Several ellipses pulled at one handle: each is the affine image of what it was."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from qtpy.QtWidgets import QApplication
from small_scene import SMALL
from test_scene_edit import assert_consistent

from napari_issis import source
from napari_issis.exposure import same_table
from napari_issis.plugin.scene import open_scene

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def three_galaxies():
    return vstack(
        [
            source("point", 5.0, 5.0, 2e-15),
            source("exponential", 24.0, 20.0, 1e-14, r_half=6.0, ellipticity=0.4, pa=30.0),
            source("sersic", 50.5, 41.25, 5e-15, r_half=5.0, ellipticity=0.3, pa=100.0, n=2.5),
            source("gaussian", 58.0, 17.5, 3e-15, r_half=4.0, ellipticity=0.6, pa=155.0),
        ]
    )


def forms(table):
    """Centres (n, 2) as (x, y) and matrices of the ellipses (n, 2, 2), from the definitions.

    The matrix is a^2 m m^T + b^2 n n^T with the unit vectors m along the major axis, at the
    angle pa from +y counter-clockwise towards -x, and n across it.
    """
    pa = np.radians(table["pa"].value)
    a = table["r_half"].value
    b = a * (1 - table["ellipticity"])
    m = np.stack([-np.sin(pa), np.cos(pa)], axis=-1)
    n = np.stack([np.cos(pa), np.sin(pa)], axis=-1)
    matrix = (a**2)[:, None, None] * m[:, :, None] * m[:, None, :]
    matrix += (b**2)[:, None, None] * n[:, :, None] * n[:, None, :]
    return np.column_stack([table["x"], table["y"]]), matrix


def affine(before, after):
    """The affine map, x -> A x + t, that takes three corners of a box to where they are now."""
    corners = [0, 2, 4]
    old = np.column_stack([before[corners][:, ::-1], np.ones(3)])
    solution = np.linalg.solve(old, after[corners][:, ::-1])
    return solution[:2].T, solution[2]


@pytest.fixture
def galaxies(viewer):
    scene = open_scene(three_galaxies(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    yield scene
    viewer.layers.clear()
    while scene._live._jobs.busy:
        QApplication.processEvents()


# the handle, and where it goes in units of the box's half sides, from its middle
PULLS = {
    "sheared": (4, lambda corner: corner * (1.6, 0.6)),
    "mirrored": (4, lambda corner: corner * (-1.6, 1.1)),
    "mirrored twice": (0, lambda corner: -4.0 * corner),
    "stretched": (1, lambda edge: edge * 1.7),
    "rotated": (9, lambda handle: np.array([[0.6, 0.8], [-0.8, 0.6]]) @ handle),
}


@pytest.mark.parametrize("pull", list(PULLS))
def test_each_is_the_affine_image_of_what_it_was(galaxies, mouse, pull):
    """Catches axes and angles off by more than 1e-4 pixel, and what else a handle changes."""
    scene, before = galaxies, galaxies.sources
    layer = scene.editor.ellipses.layer
    scene.viewer.layers.selection.active = layer
    layer.mode = "select"
    layer.selected_data = {0, 1, 2}
    box = np.array(layer._selected_box, dtype=float)
    handle, move = PULLS[pull]
    middle = box[8]
    target = middle + move(box[handle] - middle)
    mouse.press(*box[handle][::-1])
    for share in (0.3, 0.7, 1.0):
        mouse.move(*(box[handle] + share * (target - box[handle]))[::-1])
        QApplication.processEvents()
    pulled = np.array(layer._selected_box, dtype=float)
    mouse.release(*target[::-1])
    scene.wait()
    matrix, shift = affine(box, pulled)
    assert np.abs(matrix - np.eye(2)).max() > 0.15
    if pull.startswith("mirrored"):
        assert (np.linalg.det(matrix) < 0) == (pull == "mirrored")
    now = scene.sources
    for name in ("kind", "flux", "n"):
        assert np.array_equal(now[name].astype(str), before[name].astype(str))
    assert same_table(now[:1], before[:1])

    centre, shape = forms(before[1:])
    new_centre, new_shape = forms(now[1:])
    assert np.abs(new_centre - (centre @ matrix.T + shift)).max() < 1e-4
    expected = matrix @ shape @ matrix.T
    widths = np.sqrt(np.linalg.eigvalsh(expected))
    assert np.abs(now["r_half"].value[1:] - widths[:, 1]).max() < 1e-4
    minor = now["r_half"].value[1:] * (1 - now["ellipticity"][1:])
    assert np.abs(minor - widths[:, 0]).max() < 1e-4
    # a point of the outline moves by half of what the matrix changes, over the semi-axis
    assert np.abs(new_shape - expected).max() / (2 * widths.min()) < 1e-4
    assert_consistent(scene)
    scene.undo()
    assert_consistent(scene)
    assert same_table(scene.sources, before)

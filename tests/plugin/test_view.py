"""The view panel: zoom, source model beside the image, scale bar and compass."""

from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.wcs import WCS
from napari._app_model import get_app_model
from napari.layers import Image, Points
from napari.utils.shortcuts import default_shortcuts
from qtpy.QtCore import QPoint, Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis import source
from napari_issis.fits_header import wcs_header
from napari_issis.plugin.canvas_geometry import find_canvas, screen_axis, to_view_box, view_box
from napari_issis.plugin.compass import Compass
from napari_issis.plugin.scene import open_scene
from napari_issis.plugin.side_by_side import FRAME_NAME, SideBySide
from napari_issis.plugin.trace_docks import FREEZE_KEY
from napari_issis.plugin.traces import traces_of
from napari_issis.plugin.view_form import ViewForm
from napari_issis.plugin.zoom import FIT_KEY, KEYS, Zoom

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def settle(milliseconds: int = 60) -> None:
    QTest.qWait(milliseconds)


@pytest.fixture
def form(scene, qtbot):
    form = ViewForm(scene)
    qtbot.addWidget(form)
    form.resume()
    yield form
    form.pause()


@pytest.fixture
def window(make_napari_viewer):
    """A scene and its view form in a window."""
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(1100, 700)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    form = ViewForm(scene)
    form.resume()
    viewer.window.add_dock_widget(form, name="view", area="right")
    settle(100)
    yield form
    form.pause()


# ---------------------------------------------------------------- zoom


@pytest.mark.parametrize("shape", [(512, 512), (256, 1024)])
@pytest.mark.parametrize("canvas", [(800, 600), (300, 1000)])
def test_a_zoom_shows_its_part_of_the_frame(scene, shape, canvas):
    """Catches zooms that leave a margin, or that cut the frame off."""
    scene.observation = SMALL.replace(shape=shape)
    scene.wait()
    scene.viewer.canvas.size = canvas
    zoom = Zoom(scene)
    for factor in (1, 2, 4, 8):
        zoom.to(factor)
        axes = [screen_axis(scene.viewer, scene.counts.layer, axis) for axis in (0, 1)]
        shown = [(axis.stop - axis.start) / abs(axis.step) for axis in axes]
        parts = [n / factor for n in shape]
        assert min(s / p for s, p in zip(shown, parts, strict=True)) == pytest.approx(1)
        for axis, n in zip(axes, shape, strict=True):
            assert axis.to_canvas((n - 1) / 2) == pytest.approx((axis.start + axis.stop) / 2)


@pytest.mark.needs_gl
def test_four_times_512_shows_128_pixels(window):
    """Catches a zoom that napari understands otherwise: its own corners of what is in sight."""
    scene = window.scene
    scene.observation = SMALL.replace(shape=(512, 512))
    scene.wait()
    settle()
    for factor, pixels in ((1, 512), (4, 128)):
        window.factors[factor].native.click()
        settle()
        corners = scene.counts.layer.corner_pixels
        short = int(np.argmin(scene.viewer.canvas.size))
        assert corners[1, short] - corners[0, short] + 1 == pytest.approx(pixels, abs=2)
    window.fit.native.click()
    settle()
    axes = [screen_axis(scene.viewer, scene.counts.layer, axis) for axis in (0, 1)]
    assert all(axis.visible(512) == (0, 512) for axis in axes)


def test_zoom_about_the_selected_sources(scene, form):
    """Catches a zoom about the sources of the other layer, or about the frame for none."""
    viewer, points, ellipses = scene.viewer, scene.editor.points.layer, scene.editor.ellipses.layer
    viewer.layers.selection.active = points
    form.centre.value = "selected"
    form.factors[4].native.click()
    assert viewer.scene.camera.center[1:] == pytest.approx((31.5 * 0.036, 39.5 * 0.036))
    points.selected_data = {0, 1}
    ellipses.selected_data = {0}
    form.factors[4].native.click()
    assert viewer.scene.camera.center[1:] == pytest.approx((31.25 * 0.036, 40.125 * 0.036))
    viewer.layers.selection.active = ellipses
    form.factors[8].native.click()
    assert viewer.scene.camera.center[1:] == pytest.approx((30 * 0.036, 40 * 0.036))
    form.centre.value = "frame"
    form.factors[4].native.click()
    assert viewer.scene.camera.center[1:] == pytest.approx((31.5 * 0.036, 39.5 * 0.036))


@pytest.mark.needs_gl
def test_keys_act_on_our_layers(window):
    """Catches keys that do nothing in a real window, and keys left on the layers of others."""
    scene, viewer = window.scene, window.scene.viewer
    canvas = find_canvas(window)
    control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
    assert not window.traces.frozen
    for layer in scene.layers:
        viewer.layers.selection.active = layer
        viewer.scene.camera.zoom = 1.0
        QTest.keyClick(canvas, Qt.Key.Key_4, control)
        box, step = view_box(viewer, layer), screen_axis(viewer, scene.counts.layer, 0).step
        assert abs(step) == pytest.approx(min(box.height / 16, box.width / 20))
        QTest.keyClick(canvas, Qt.Key.Key_R, shift)
        assert viewer.scene.camera.zoom < abs(step) / 0.036 / 4
        frozen = window.traces.frozen
        QTest.keyClick(canvas, Qt.Key.Key_F, shift)
        assert window.traces.frozen != frozen
    mine = viewer.add_points([[1.0, 1.0]])
    viewer.layers.selection.active = mine
    viewer.scene.camera.zoom = 1.0
    QTest.keyClick(canvas, Qt.Key.Key_4, control)
    assert viewer.scene.camera.zoom == 1.0


@pytest.mark.needs_gl
def test_the_keys_are_free(window):
    """Catches keys that napari has for its layers, its viewer or its menus."""
    viewer = window.scene.viewer
    keys = [FIT_KEY, FREEZE_KEY, *KEYS.values()]
    taken = {str(key) for key in (*viewer.class_keymap, *viewer.keymap)}
    for layer in window.scene.layers:
        taken |= {str(key) for key in type(layer).class_keymap}
    shortcuts = {str(rule.keybinding) for rule in get_app_model().keybindings}
    shortcuts |= {str(key) for keys in default_shortcuts.values() for key in keys}
    assert len(taken) > 20
    assert len(shortcuts) > 5
    for key in keys:
        spelling = key.replace("Control-", "Ctrl+").replace("-", "+")
        assert spelling not in taken | shortcuts


# ---------------------------------------------------------------- source model beside the image


def cells(scene) -> dict[str, tuple[int, int]]:
    layers, grid = scene.viewer.layers, scene.viewer.canvas.grid
    return {layer.name: grid.position(i, layers) for i, layer in enumerate(layers)}


def corners(layer) -> tuple[float, ...]:
    """World coordinates of two corners of an image, pixels' edges included."""
    ny, nx = layer.data.shape
    return (*layer.data_to_world((-0.5, -0.5)), *layer.data_to_world((ny - 0.5, nx - 0.5)))


def test_sources_left_image_right(scene, form):
    """Catches a source model on the image's side, and a selection of layers that changes."""
    viewer = scene.viewer
    viewer.layers.selection.update(scene.layers)
    selected = set(viewer.layers.selection)
    form.layout_.value = True
    assert cells(scene) == {
        "ISSIS counts": (0, 1),
        FRAME_NAME: (0, 0),
        "ISSIS extended sources": (0, 0),
        "ISSIS point sources": (0, 0),
    }
    assert set(viewer.layers.selection) == selected
    frame = viewer.layers[FRAME_NAME]
    assert corners(frame) == pytest.approx(corners(scene.counts.layer))
    scene.observation = SMALL.replace(shape=(32, 48))
    scene.wait()
    assert corners(frame) == pytest.approx(corners(scene.counts.layer))
    form.layout_.value = False
    assert FRAME_NAME not in viewer.layers
    assert not viewer.canvas.grid.enabled


def test_layers_of_others_and_their_grid_stay(viewer, qtbot):
    """Catches layers of the user's that are moved or hidden, and grid settings that are lost."""
    below = viewer.add_layer(Image(np.zeros((8, 8)), name="below"))
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    above = viewer.add_layer(Points([[1.0, 1.0]], name="above"))
    grid = viewer.canvas.grid
    grid.stride, grid.shape, grid.spacing = 2, (2, 3), 5
    order = [layer.name for layer in viewer.layers]
    state = [(layer.visible, layer.opacity, tuple(layer.translate)) for layer in (below, above)]
    beside = SideBySide(scene)
    beside.enabled = True
    places = cells(scene)
    assert places["below"] == places["ISSIS counts"] == (0, 1)
    assert places["above"] == places["ISSIS point sources"] == (0, 0)
    late = viewer.add_layer(Points([[2.0, 2.0]], name="late"))
    assert cells(scene)["ISSIS counts"] == (0, 1)
    assert cells(scene)["late"] == cells(scene)[FRAME_NAME] == (0, 0)
    viewer.layers.remove(late)
    assert cells(scene) == places
    beside.enabled = False
    assert [layer.name for layer in viewer.layers] == order
    assert (grid.enabled, grid.stride, grid.shape, grid.spacing) == (False, 2, (2, 3), 5)
    assert state == [
        (layer.visible, layer.opacity, tuple(layer.translate)) for layer in (below, above)
    ]
    viewer.layers.clear()


def test_many_layers_of_others_get_cells_of_their_own(viewer):
    """Catches images of the user's that come to lie on the source model."""
    for number in range(6):
        viewer.add_layer(Image(np.zeros((8, 8)), name=f"mine {number}"))
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    beside = SideBySide(scene)
    beside.enabled = True
    places = cells(scene)
    assert places["ISSIS counts"] == (0, 1)
    assert all(places[f"mine {n}"] != (0, 0) for n in range(6))
    beside.enabled = False
    viewer.layers.clear()


def test_the_end_of_side_by_side(scene, form):
    """Catches an empty frame left over when grid, frame or scene go by napari's own means."""
    viewer = scene.viewer
    form.layout_.value = True
    viewer.canvas.grid.enabled = False
    assert FRAME_NAME not in viewer.layers
    assert form.layout_.value is False
    form.layout_.value = True
    viewer.layers.remove(FRAME_NAME)
    assert not viewer.canvas.grid.enabled
    assert form.layout_.value is False
    form.layout_.value = True
    for layer in scene.layers:
        viewer.layers.remove(layer)
    assert list(viewer.layers) == []
    assert not viewer.canvas.grid.enabled


@pytest.mark.needs_gl
def test_sources_are_dragged_in_either_cell(window):
    """Catches drags that go astray in the grid, and a dead mouse with the empty frame active."""
    scene, viewer = window.scene, window.scene.viewer
    window.layout_.value = True
    settle(100)
    frame, image = viewer.layers[FRAME_NAME], scene.counts.layer
    canvas = find_canvas(window)
    row, column = 12.5, 20.25
    for layer, active in ((frame, scene.editor.points.layer), (image, frame), (frame, frame)):
        viewer.layers.selection.active = active
        shift = np.array([view_box(viewer, layer).left - view_box(viewer, image).left, 0.0])
        start = to_view_box(viewer, image, (row, column)) + shift
        row, column = row + 10, column + 8
        stop = to_view_box(viewer, image, (row, column)) + shift
        points = [QPoint(*(round(v) for v in start + (stop - start) * f)) for f in (0, 0.5, 1)]
        QTest.mouseMove(canvas, points[0])
        QTest.mousePress(canvas, Qt.MouseButton.LeftButton, pos=points[0])
        for point in points[1:]:
            QTest.mouseMove(canvas, point)
            QTest.qWait(20)
        QTest.mouseRelease(canvas, Qt.MouseButton.LeftButton, pos=points[-1])
        scene.wait()
        moved = scene.sources[0]
        step = abs(screen_axis(viewer, image, 1).step)
        assert (moved["x"], moved["y"]) == pytest.approx((column, row), abs=2 / step)
        assert scene.exposure.sources[0]["x"] == moved["x"]
        row, column = moved["y"], moved["x"]


@pytest.mark.needs_gl
def test_both_cells_zoom_together(window):
    """Catches cells with cameras of their own.

    The left edge of one marker in the left cell and of one star's light in the right one have
    to be as far from their cells' corners, in the picture of the canvas.
    """
    scene, viewer = window.scene, window.scene.viewer
    scene.sources = source("point", 50, 20, 1e-13)
    scene.wait()
    window.layout_.value = True
    settle(100)
    window.factors[2].native.click()
    settle()
    picture = viewer.screenshot(flash=False)[..., :3].astype(float)
    scale = picture.shape[1] / viewer.canvas.size[1]
    places = []
    for name, seen in (
        (FRAME_NAME, (picture[..., 0] > 80) & (picture[..., 1] < 40)),
        ("ISSIS counts", picture.min(axis=-1) > 200),
    ):
        box = view_box(viewer, viewer.layers[name])
        cell = seen[:, round(box.left * scale) : round((box.left + box.width) * scale)]
        places.append(np.argwhere(cell).mean(axis=0))
    assert places[0] == pytest.approx(places[1], abs=4)


# ---------------------------------------------------------------- scale bar and compass


def test_the_scale_bar_is_napari_s(scene, form):
    """Catches a box that does not follow napari's menu, or switches on by itself."""
    bar = scene.viewer.canvas.overlays.scale_bar
    assert not bar.visible
    form.scale_bar.value = True
    assert bar.visible
    bar.visible = False
    assert form.scale_bar.value is False
    bar.visible = True
    assert form.scale_bar.value is True


@pytest.mark.parametrize("roll", [0.0, 30.0, 200.0, -75.0])
def test_north_and_east_are_those_of_the_file(scene, qtbot, roll):
    """Catches a compass that turns the other way: the truth is the WCS of the FITS header."""
    compass = Compass(scene, None)
    qtbot.addWidget(compass)
    pointing = SkyCoord("10h0m0s +2d0m0s")
    scene.observation = SMALL.replace(pointing=pointing, roll=roll)
    scene.wait()
    wcs = WCS(wcs_header(scene.observation))
    centre = np.array([39.5, 31.5])
    for name, angle in (("N", 0), ("E", 90)):
        there = pointing.directional_offset_by(angle * u.deg, 0.5 * u.arcsec)
        step = np.array(wcs.world_to_pixel(there)) - centre
        x, y = compass.directions()[name]
        assert (x, -y) == pytest.approx(tuple(step / np.hypot(*step)), abs=1e-3)
    scene.viewer.scene.camera.orientation2d = ("down", "left")
    turned = compass.directions()["N"]
    scene.viewer.scene.camera.orientation2d = ("up", "right")
    assert turned == pytest.approx(tuple(-v for v in compass.directions()["N"]))


def test_north_is_up_and_east_left_at_roll_zero(scene, qtbot):
    compass = Compass(scene, None)
    qtbot.addWidget(compass)
    assert compass.directions()["N"] == pytest.approx((0, -1))
    assert compass.directions()["E"] == pytest.approx((-1, 0))


@pytest.mark.needs_gl
def test_the_compass_lies_over_the_image_and_lets_the_mouse_through(window):
    """Catches a compass in the way of the mouse, or one that stays behind when the window grows."""
    viewer = window.scene.viewer
    window.compass.native.click()
    settle()
    canvas = find_canvas(window)
    compass = canvas.findChild(Compass)
    assert compass.isVisible()
    assert 0 < canvas.width() - compass.geometry().right() < 15
    assert canvas.rect().contains(compass.geometry())
    place = canvas.mapToGlobal(compass.geometry().center())
    viewer.window._qt_window.raise_()
    assert QApplication.widgetAt(place) is not compass
    viewer.window.resize(900, 600)
    settle()
    assert 0 < canvas.width() - compass.geometry().right() < 15
    window.layout_.value = True
    settle()
    assert compass.x() > canvas.width() / 2
    window.compass.native.click()
    assert not compass.isVisible()


# ---------------------------------------------------------------- the form


def test_a_paused_form_follows_nothing(scene, form):
    """Catches a hidden panel that still works."""
    form.pause()
    scene.viewer.canvas.overlays.scale_bar.visible = True
    assert form.scale_bar.value is False
    form.resume()
    assert form.scale_bar.value is True


def test_a_layer_made_anew_has_its_keys(scene, form):
    """Catches keys that die with the first layer."""
    scene.viewer.layers.remove(scene.counts.layer)
    scene.restore()
    scene.wait()
    scene.viewer.scene.camera.zoom = 1.0
    bound = {str(key): call for key, call in scene.counts.layer.keymap.items()}
    bound["Ctrl+8"](scene.counts.layer)
    assert scene.viewer.scene.camera.zoom > 100
    assert traces_of(scene) is form.traces

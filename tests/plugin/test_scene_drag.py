"""Drags through napari's own mouse callbacks; at rest the picture is a fresh simulation."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import vstack
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis import render, simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin import picture
from napari_issis.plugin.layers import shapes_data

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def fresh(scene):
    return simulate(scene.sources, scene.observation, seed=scene.seed)


def row(scene, number):
    names = ("x", "y", "flux", "r_half", "ellipticity", "pa")
    return [
        getattr(scene.sources[name][number], "value", scene.sources[name][number]) for name in names
    ]


def assert_shows(scene, table):
    """The image on the layer, the exposure and the sources are those of the table."""
    scene.wait()
    expected = simulate(table, scene.observation, seed=scene.seed)
    assert same_table(scene.sources, table)
    assert np.array_equal(scene.counts.layer.data, expected.counts)
    assert scene.exposure == expected


def test_opened_scene_is_a_fresh_simulation(scene):
    assert_shows(scene, few_sources())


def test_dragging_a_star(scene, mouse):
    """Catches row and column exchanged, a stale picture, and a scale that is forgotten."""
    mouse.drag((20.25, 12.5), (25.0, 15.0), (30.0, 25.0), (33.25, 28.5))
    moved = few_sources()
    moved["x"][0], moved["y"][0] = 33.25, 28.5
    scene.wait()
    assert np.hypot(*(np.array(row(scene, 0)[:2]) - [33.25, 28.5])) < 1e-9
    # Mouse positions pass through arcsec: the last bits are napari's.
    moved["x"][0], moved["y"][0] = row(scene, 0)[:2]
    assert_shows(scene, moved)


def test_dragging_an_ellipse(scene, mouse):
    """Catches a drag that does not reach the layer that is not active, or changes the shape."""
    before = row(scene, 2)
    mouse.drag((40.0, 30.0), (42.0, 31.0), (50.0, 37.5))
    scene.wait()
    after = row(scene, 2)
    assert after[:2] == pytest.approx([50.0, 37.5], abs=1e-4)
    assert after[2:] == before[2:]
    moved = few_sources()
    moved["x"][2], moved["y"][2] = after[:2]
    assert_shows(scene, moved)


def test_one_press_picks_on_either_layer(scene, mouse):
    """Catches layers of which only the active one gets the mouse."""
    layers = scene.viewer.layers
    layers.selection.active = scene.editor.points.layer
    mouse.drag((40.0, 30.0), (44.0, 30.0))
    assert layers.selection.active is scene.editor.ellipses.layer
    mouse.drag((60.0, 50.0), (62.0, 50.0))
    assert layers.selection.active is scene.editor.points.layer
    scene.wait()
    assert row(scene, 2)[0] == pytest.approx(44.0, abs=1e-4)
    assert row(scene, 1)[0] == pytest.approx(62.0)


def test_the_tool_for_vertices_picks_as_the_arrow_does(scene, mouse):
    """Catches a press that does nothing: the two arrows of napari's tools look much the same."""
    ellipses = scene.editor.ellipses.layer
    scene.viewer.layers.selection.active = ellipses
    ellipses.mode = "direct"
    mouse.drag((60.0, 50.0), (63.0, 51.0))
    scene.wait()
    assert (scene.sources["x"][1], scene.sources["y"][1]) == (63.0, 51.0)


def test_a_layer_of_the_user_keeps_the_mouse(scene, mouse):
    """Catches a pick that takes the mouse from somebody else's layer."""
    own = scene.viewer.add_points(np.array([[0.0, 0.0]]))
    mouse.drag((40.0, 30.0), (44.0, 30.0))
    assert scene.viewer.layers.selection.active is own
    assert_shows(scene, few_sources())


def test_resizing_an_ellipse_by_its_handle(scene, mouse):
    """Catches r_half and ellipticity that do not follow the box."""
    layer = scene.editor.ellipses.layer
    mouse.drag((40.0, 30.0), (40.0, 30.0))
    assert layer.selected_data == {0}
    corner = layer.data[0][2].astype(float)
    centre = layer.data[0].astype(float).mean(axis=0)
    opposite = 2 * centre - corner
    target = opposite + 1.5 * (corner - opposite)
    mouse.drag(tuple(corner[::-1]), tuple((corner + 1)[::-1]), tuple(target[::-1]))
    scene.wait()
    x, y, flux, r_half, ellipticity, pa = row(scene, 2)
    assert flux == 1e-14
    assert not np.isclose(r_half, 6.0)
    table = few_sources()
    shown = scene.editor.ellipses.read()[0]
    drawn = shapes_data(scene.sources[2:3])[0]
    assert np.abs(np.sort(shown, axis=0) - np.sort(drawn, axis=0)).max() < 2e-4
    for name, value in zip(("x", "y", "ellipticity"), (x, y, ellipticity), strict=True):
        table[name][2] = value
    table["r_half"][2], table["pa"][2] = r_half * table["r_half"].unit, pa * table["pa"].unit
    assert_shows(scene, table)


def test_rotating_an_ellipse_by_its_handle(scene, mouse):
    """Catches the sense of rotation, and a rotation that touches anything but the angle."""
    layer = scene.editor.ellipses.layer
    mouse.drag((40.0, 30.0), (40.0, 30.0))
    before = row(scene, 2)
    handle = np.asarray(layer._selected_box[9], dtype=float)
    centre = np.array([30.0, 40.0])
    radius = handle - centre
    turn = np.radians(25.0)
    # Counter-clockwise as seen: y up, x to the right; from +x towards +y.
    y, x = radius
    turned = [y * np.cos(turn) + x * np.sin(turn), x * np.cos(turn) - y * np.sin(turn)]
    target = centre + np.array(turned)
    halfway = centre + 0.5 * (radius + target - centre)
    mouse.drag(tuple(handle[::-1]), tuple(halfway[::-1]), tuple(target[::-1]))
    scene.wait()
    after = row(scene, 2)
    assert after[5] == pytest.approx(before[5] + 25.0, abs=0.05)
    assert after[2:5] == before[2:5]
    assert after[:2] == before[:2]
    assert scene.exposure == fresh(scene)


def test_preview_renders_only_what_moves(scene, mouse, monkeypatch):
    """Catches a drag that renders the whole scene with each move."""
    renders = []
    real = render._render

    def counted(optics, shape, sources, *args):
        renders.append(len(sources))
        return real(optics, shape, sources, *args)

    monkeypatch.setattr(render, "_render", counted)
    previews = []
    mouse.press(20.25, 12.5)
    for step in range(1, 7):
        mouse.move(20.25 + step, 12.5)
        scene._refresh()
        while scene._live._jobs.busy:
            QApplication.processEvents()
        previews.append(scene.counts.layer.data.copy())
        assert not scene.picture.final
        # The star is where the mouse is.
        y, x = np.unravel_index(previews[-1][:25, :40].argmax(), (25, 40))
        assert abs(x - (20.25 + step)) <= 1.5
        assert abs(y - 12.5) <= 1.5
    assert renders == []
    mouse.release(26.25, 12.5)
    scene.wait()
    assert renders == [4]
    final = scene.exposure
    assert final == fresh(scene)
    # The last preview was as good as the eye can tell.
    assert np.abs(previews[-1] - final.counts).max() <= 1


def test_exposure_seed_and_neutral_filters_render_nothing(scene, monkeypatch):
    """Catches a rate that is rendered anew though it is known."""

    def refuse(*args, **options):
        raise AssertionError("rendered")

    monkeypatch.setattr(picture, "noise_ready_rate", refuse)
    scene.observation = SMALL.replace(exposure=500.0, filters=("NF1", "NF2"))
    scene.seed = 4
    scene.new_noise()
    assert scene.seed == 5
    scene.wait()
    monkeypatch.undo()
    assert_shows(scene, few_sources())


def test_what_is_no_edit_asks_for_no_picture(scene, monkeypatch, qtbot):
    """Catches pictures made because of zooming, hiding, selecting and sizes of points."""
    asked = []
    monkeypatch.setattr(scene._live._jobs, "request", asked.append)
    points = scene.editor.points.layer
    points.visible = False
    points.visible = True
    points.selected_data = {0}
    points.current_size = 20
    points.size = 15
    scene.viewer.scene.camera.zoom = 30
    scene.editor.ellipses.layer.selected_data = {1}
    scene.editor.ellipses.layer.edge_width = 2
    qtbot.wait(30)
    assert asked == []


def test_selecting_and_styling_changes_no_source(scene):
    """Catches physics taken from sizes and colours."""
    points = scene.editor.points.layer
    points.selected_data = {0}
    points.size = 3
    points.face_color = "blue"
    assert_shows(scene, few_sources())


def test_a_pause_in_a_drag_shows_the_final_picture(scene, mouse, qtbot):
    """Catches a preview that stays on the screen while the mouse rests."""
    mouse.press(20.25, 12.5)
    mouse.move(24.0, 15.0)
    qtbot.waitUntil(lambda: scene.settled, timeout=5000)
    assert np.array_equal(scene.counts.layer.data, fresh(scene).counts)
    mouse.release(24.0, 15.0)


def test_the_newest_state_is_shown_last(scene):
    """Catches an older picture that comes in after a newer one."""
    for step in range(10):
        table = few_sources()
        table["x"][0] = 10.0 + step
        scene.sources = table
        scene._refresh()
    assert_shows(scene, table)


def test_several_at_once(scene):
    layer = scene.editor.points.layer
    layer.data = layer.data + 2.0
    moved = few_sources()
    moved["x"][:2] += 2.0
    moved["y"][:2] += 2.0
    assert_shows(scene, moved)


def test_contrast_holds_still_in_a_drag_and_hand_set_limits_stay(scene, mouse):
    """Catches limits that flicker, and limits of the user's that are overwritten."""
    image = scene.counts.layer
    before = tuple(image.contrast_limits)
    mouse.drag((20.25, 12.5), (40.0, 30.0))
    scene.wait()
    assert tuple(image.contrast_limits) == before
    image.contrast_limits = (1, 7)
    scene.add(source("point", 5, 5, 1e-13))
    scene.wait()
    assert tuple(image.contrast_limits) == (1, 7)
    scene.observation = SMALL.replace(exposure=1.0)
    scene.wait()
    assert tuple(image.contrast_limits) != (1, 7)


def test_a_scene_of_one_galaxy(viewer, mouse):
    from napari_issis.plugin.scene import open_scene

    alone = open_scene(few_sources()[2:3], SMALL, viewer=viewer, dock=False)
    alone.wait()
    mouse.drag((40.0, 30.0), (30.0, 20.0), (20.0, 20.0))
    alone.wait()
    assert alone.exposure == fresh(alone)
    assert vstack([alone.sources])["x"][0] == pytest.approx(20.0, abs=1e-4)


def test_an_image_made_anew_leaves_the_mouse_alone(scene, mouse):
    """Catches a drag that never ends: the release went to the image that was made anew."""
    scene.viewer.layers.remove(scene.counts.layer)
    mouse.press(40.0, 30.0)
    mouse.move(42.0, 31.0)
    mouse.move(46.0, 34.0)
    QApplication.processEvents()
    assert scene.counts.layer is None
    scene.restore()
    assert scene.counts.layer is not None
    assert scene.viewer.layers.selection.active is scene.editor.ellipses.layer
    mouse.move(50.0, 37.5)
    mouse.release(50.0, 37.5)
    scene.wait()
    assert scene.editor.held is None
    assert row(scene, 2)[:2] == pytest.approx([50.0, 37.5], abs=1e-4)
    assert scene.exposure == fresh(scene)

"""What else the user does: draw, paste, delete, remove layers; and what goes wrong."""

from __future__ import annotations

import astropy.units as u
import numpy as np
import pytest
from astropy.table import vstack
from napari.utils.notifications import notification_manager
from small_scene import SMALL, few_sources

from napari_issis import simulate, source
from napari_issis.exposure import same_table
from napari_issis.plugin import picture
from napari_issis.plugin.scene import open_scene

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


def assert_consistent(scene):
    """Picture, layers and table tell the same, and ids are unique."""
    scene.wait()
    fresh = simulate(scene.sources, scene.observation, seed=scene.seed)
    assert scene.exposure == fresh
    if scene.counts.layer is not None:
        assert np.array_equal(scene.counts.layer.data, fresh.counts)
    ids = []
    for view in scene.editor.views:
        if view.layer is None:
            continue
        table = scene.sources[view.holds(scene.sources["kind"])]
        assert len(view.layer.data) == len(table)
        assert view.shows(table)
        features = view.layer.features
        assert list(features["kind"]) == list(table["kind"])
        assert np.array_equal(features["x"], table["x"])
        assert np.array_equal(features["flux"], table["flux"].value)
        ids += list(features["source_id"])
    assert sorted(ids) == sorted(set(ids))
    assert set(ids) == set(scene.editor.source_id.tolist())


def messages():
    return [str(note.message) for note in notification_manager.records]


@pytest.fixture(autouse=True)
def _no_old_notifications():
    notification_manager.records.clear()


def test_a_click_in_add_mode_adds_the_star_of_the_form(scene, mouse):
    """Catches clones of the star that was selected last: the flux is the form's."""
    points = scene.editor.points.layer
    points.selected_data = {0}
    scene.new_source = {**scene.new_source, "kind": "point", "flux": 7e-15}
    scene.viewer.layers.selection.active = points
    points.mode = "add"
    mouse.drag((5.5, 40.25), (5.5, 40.25))
    mouse.drag((9.5, 44.0), (9.5, 44.0))
    assert_consistent(scene)
    assert len(scene.sources) == 6
    assert list(scene.sources["kind"][-2:]) == ["point", "point"]
    assert list(scene.sources["flux"][-2:].value) == [7e-15, 7e-15]
    assert list(scene.sources["x"][-2:]) == pytest.approx([5.5, 9.5])
    assert list(scene.sources["y"][-2:]) == pytest.approx([40.25, 44.0])


def test_an_ellipse_drawn_by_hand(scene, mouse, qapp):
    """Catches a drawn ellipse of another kind or size, and none while it is drawn."""
    layer = scene.editor.ellipses.layer
    layer.selected_data = {1}
    scene.new_source = {**scene.new_source, "kind": "devaucouleurs", "flux": 3e-15}
    scene.viewer.layers.selection.active = layer
    layer.mode = "add_ellipse"
    mouse.press(10.0, 40.0)
    mouse.move(20.0, 45.0)
    qapp.processEvents()
    scene.editor.take_over()
    assert len(scene.sources) == 5
    mouse.move(30.0, 52.0)
    mouse.release(30.0, 52.0)
    assert_consistent(scene)
    new = scene.sources[-1]
    assert (new["kind"], new["flux"].value) == ("devaucouleurs", 3e-15)
    assert (new["x"], new["y"]) == pytest.approx((20.0, 46.0), abs=0.2)
    assert new["r_half"].value == pytest.approx(10.0, abs=0.2)
    assert new["ellipticity"] == pytest.approx(0.4, abs=0.02)
    assert new["pa"].value == pytest.approx(90.0)


def test_a_clicked_ellipse_has_the_size_of_the_form(scene, mouse):
    """Catches galaxies of 0.4 pixels by a click without a drag."""
    layer = scene.editor.ellipses.layer
    scene.new_source = {**scene.new_source, "r_half": 9.0, "ellipticity": 0.25, "pa": 10.0}
    scene.viewer.layers.selection.active = layer
    layer.mode = "add_ellipse"
    mouse.press(15.0, 45.0)
    mouse.release(15.0, 45.0)
    assert_consistent(scene)
    new = scene.sources[-1]
    assert new["kind"] == "exponential"
    assert (new["r_half"].value, new["ellipticity"], new["pa"].value) == (9.0, 0.25, 10.0)
    assert (new["x"], new["y"]) == pytest.approx((15.0, 45.0), abs=1.0)


def test_other_shapes_are_refused(scene, mouse):
    """Catches rectangles taken for galaxies, and ones left on the layer."""
    layer = scene.editor.ellipses.layer
    scene.viewer.layers.selection.active = layer
    layer.mode = "add_rectangle"
    mouse.drag((10.0, 40.0), (20.0, 45.0), (30.0, 52.0))
    assert_consistent(scene)
    assert same_table(scene.sources, few_sources())
    assert layer.nshapes == 2
    assert any("ellipse tool" in text for text in messages())


@pytest.mark.parametrize("role", ["points", "ellipses"])
def test_paste_copies_a_source_bit_for_bit(scene, role):
    """Catches pasted sources that share an id, or lose columns and digits (no data event)."""
    layer = getattr(scene.editor, role).layer
    layer.selected_data = {1}
    layer._copy_data()
    layer._paste_data()
    layer._paste_data()
    assert_consistent(scene)
    original = scene.sources[1 if role == "points" else 3]
    for copy in scene.sources[-2:]:
        for name in ("kind", "x", "y", "flux"):
            assert copy[name] == original[name]
        if role == "ellipses":
            for name in ("r_half", "ellipticity", "pa", "n"):
                assert copy[name] == original[name]


def test_cut_and_paste_brings_back_every_column(scene):
    """Catches further columns that are lost when a deleted source is pasted."""
    table = few_sources()
    table["name"] = ["a", "b", "c", "d"]
    scene.sources = table
    layer = scene.editor.points.layer
    layer.selected_data = {0}
    layer._copy_data()
    layer.remove_selected()
    assert_consistent(scene)
    assert list(scene.sources["name"]) == ["b", "c", "d"]
    layer._paste_data()
    assert_consistent(scene)
    assert list(scene.sources["name"]) == ["b", "c", "d", "a"]
    assert scene.sources["flux"][3] == table["flux"][0]


def test_delete_and_delete_all(scene):
    for view in scene.editor.views:
        view.layer.selected_data = {0}
        view.layer.remove_selected()
    assert_consistent(scene)
    assert [str(kind) for kind in scene.sources["kind"]] == ["point", "sersic"]
    for view in scene.editor.views:
        view.layer.selected_data = {0}
        view.layer.remove_selected()
    assert_consistent(scene)
    assert len(scene.sources) == 0


def test_integer_data_becomes_float(scene, mouse):
    """Catches points that jump by whole pixels."""
    layer = scene.editor.points.layer
    layer.data = np.array([[10, 20], [50, 60]])
    assert_consistent(scene)
    assert layer.data.dtype == np.float64
    mouse.drag((20.0, 10.0), (21.25, 10.5))
    assert_consistent(scene)
    assert scene.sources["x"][0] == pytest.approx(21.25)


def test_features_set_by_a_script_are_adopted(scene):
    """Catches edits of parameters that show nowhere, or move no ellipse."""
    layer = scene.editor.ellipses.layer
    layer.features = layer.features.assign(x=[33.0, 61.5], r_half=[8.0, 5.0])
    assert_consistent(scene)
    assert scene.sources["x"][2] == 33.0
    assert scene.sources["r_half"][2] == 8.0 * u.pix


def test_wrong_features_are_refused(scene):
    """Catches a scene that breaks on a value that no source has."""
    layer = scene.editor.ellipses.layer
    layer.features = layer.features.assign(ellipticity=[0.4, 1.5])
    assert_consistent(scene)
    assert same_table(scene.sources, few_sources())
    assert any("ellipticity" in text for text in messages())


def test_a_kind_that_changes_layer(scene):
    """Catches a galaxy that stays an ellipse though it is a star now."""
    layer = scene.editor.ellipses.layer
    layer.features = layer.features.assign(kind=["point", "sersic"])
    assert_consistent(scene)
    assert len(scene.editor.points.layer.data) == 3


def test_magnitudes_survive_a_drag(viewer, mouse):
    """Catches magnitudes that are taken for fluxes on the way through the layers."""
    table = source("point", 20.0, 12.0, flux=18.5 * u.ABmag)
    scene = open_scene(table, SMALL, viewer=viewer, dock=False)
    scene.wait()
    mouse.drag((20.0, 12.0), (30.0, 20.0))
    assert_consistent(scene)
    assert scene.sources["flux"].unit == u.ABmag
    assert scene.sources["flux"][0].value == 18.5
    assert scene.editor.points.layer.metadata["napari_issis"]["flux_unit"] == "mag(AB)"


def test_a_deleted_layer_takes_its_sources_and_comes_back_when_needed(scene):
    """Catches a scene that breaks, or sources that live on unseen."""
    viewer = scene.viewer
    viewer.layers.remove(scene.editor.points.layer)
    assert_consistent(scene)
    assert set(scene.sources["kind"]) == {"exponential", "sersic"}
    scene.add(source("point", 5.0, 6.0))
    assert_consistent(scene)
    assert [layer.name for layer in viewer.layers] == [
        "ISSIS counts",
        "ISSIS extended sources",
        "ISSIS point sources",
    ]
    viewer.layers.remove(scene.counts.layer)
    scene.sources = few_sources()
    assert_consistent(scene)
    assert viewer.layers[0] is scene.counts.layer


def test_all_layers_deleted_and_back(scene):
    viewer = scene.viewer
    viewer.layers.clear()
    assert len(scene.sources) == 0
    assert viewer.scene.camera.orientation2d == ("down", "right")
    scene.sources = few_sources()
    assert_consistent(scene)
    assert viewer.scene.camera.orientation2d == ("up", "right")


def test_renamed_and_reordered_layers_are_still_ours(scene, mouse):
    layers = scene.viewer.layers
    for layer in layers:
        layer.name = f"my {layer.name}"
    layers.reverse()
    mouse.drag((20.25, 12.5), (30.0, 20.0))
    assert_consistent(scene)
    assert scene.sources["x"][0] == pytest.approx(30.0)


def test_a_viewer_with_layers_keeps_them(viewer):
    """Catches a scene that takes over or changes layers that are not its own."""
    own = viewer.add_image(np.ones((30, 30)), name="mine")
    stars = viewer.add_points(np.array([[1, 2]]), name="my stars")
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    assert_consistent(scene)
    assert list(viewer.layers[:2]) == [own, stars]
    assert np.all(own.data == 1)
    assert stars.data.dtype == np.int64
    for layer in scene.layers:
        assert tuple(layer.scale) == (0.036, 0.036)
        assert [str(unit) for unit in layer.units] == ["arcsecond", "arcsecond"]
    assert open_scene(viewer=viewer, dock=False) is scene
    assert len(scene.sources) == 4


def test_the_view_in_a_viewer_with_layers(viewer):
    """Catches a scene that is a tiny stamp, that turns the user's image, or says nothing of it."""
    own = viewer.add_image(np.ones((512, 512)), name="mine")
    orientation = viewer.scene.camera.orientation2d
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    camera = viewer.scene.camera
    assert camera.orientation2d == orientation
    # 80 pixels of 0.036 arcsec fill most of the canvas, whose shorter side is 600.
    assert 0.5 * 600 < camera.zoom * 80 * 0.036 <= 800
    assert camera.center[-2:] == pytest.approx((31.5 * 0.036, 39.5 * 0.036), abs=0.04)
    told = [text for text in messages() if "arcsec" in text]
    assert len(told) == 1
    assert "row 0 drawn at the top" in told[0]
    for layer in scene.layers:
        viewer.layers.remove(layer)
    assert camera.orientation2d == orientation
    scene.sources = few_sources()
    assert [text for text in messages() if "arcsec" in text] == told
    viewer.layers.remove(own)


def test_a_viewer_without_other_layers_is_told_nothing(scene):
    assert not any("arcsec" in text for text in messages())


def test_wrong_input_leaves_the_scene_as_it_was(scene):
    before = scene.exposure
    wrong = few_sources()
    wrong["flux"][2] *= -1
    with pytest.raises(ValueError, match="row 2, flux"):
        scene.sources = wrong
    with pytest.raises(ValueError, match="row 2, flux"):
        scene.add(wrong)
    with pytest.raises(ValueError, match="give an Observation"):
        scene.observation = "NUV"
    with pytest.raises(ValueError, match="seed is -1"):
        scene.seed = -1
    with pytest.raises(ValueError, match="kind"):
        scene.new_source = {"kind": "quasar"}
    assert scene.exposure is before
    assert_consistent(scene)


def test_a_failed_render_keeps_the_last_picture(scene, monkeypatch):
    """Catches a scene that is stuck after an error in the worker."""
    good = scene.exposure

    def fail(*args, **options):
        raise MemoryError("no memory for a mesh")

    monkeypatch.setattr(picture, "noise_ready_rate", fail)
    scene.add(source("point", 5.0, 6.0))
    with pytest.raises(RuntimeError, match="no memory for a mesh"):
        scene.wait()
    assert np.array_equal(scene.counts.layer.data, good.counts)
    assert [text for text in messages() if "no memory" in text] == [
        "The scene could not be simulated: no memory for a mesh"
    ]
    monkeypatch.undo()
    scene.add(source("point", 15.0, 6.0))
    assert_consistent(scene)
    assert len(scene.sources) == 6


def test_changing_the_frame_keeps_the_sources(scene):
    scene.observation = SMALL.replace(shape=(256, 256))
    assert_consistent(scene)
    assert same_table(scene.sources, few_sources())
    assert scene.counts.layer.data.shape == (256, 256)


def test_edges_are_as_thick_on_the_screen_in_any_frame(scene, mouse, qtbot):
    """Catches ellipses that vanish in large frames, also those drawn afterwards."""
    layer = scene.editor.ellipses.layer
    for side in (1024, 512, 256):
        scene.observation = SMALL.replace(shape=(side, side))
        # The view fits the frame when its picture comes, and the edges follow the view.
        scene.wait()
        qtbot.waitUntil(lambda: not scene._zoomed.isActive(), timeout=2000)
        layer.selected_data = {0}
        scene.viewer.layers.selection.active = layer
        layer.mode = "add_ellipse"
        mouse.drag((10.0, 40.0), (20.0, 45.0), (30.0, 52.0))
        scene.editor.take_over()
        # Of a canvas of some 600 pixels.
        widths = 600 / side * np.array(layer.edge_width)
        assert np.all((widths >= 1.0) & (widths <= 2.0))
    assert len(widths) == 5
    assert_consistent(scene)


@pytest.mark.parametrize("side", [256, 512, 2048])
def test_markers_suit_the_frame(scene, side):
    """Catches markers that vanish in large frames, or hide each other and take all clicks."""
    scene.observation = SMALL.replace(shape=(side, side))
    scene.sources = vstack([source("point", 100.0, 100.0), source("point", 110.0, 100.0)])
    layer = scene.editor.points.layer
    assert np.all(600 / side * layer.size >= 5)
    if side < 2048:
        assert np.all(600 / side * layer.size <= 16)
        assert [layer.get_value((100.0, x)) for x in (100.0, 110.0)] == [0, 1]
    # vispy makes the border of a limited marker at least half of the lower limit thick.
    assert layer.canvas_size_limits[0] <= 2


def test_closing_in_the_middle_of_a_render(scene, qtbot):
    """Catches pictures that make layers in a viewer that has been emptied."""
    scene.sources = few_sources()[:2]
    scene._refresh()
    scene.viewer.layers.clear()
    qtbot.waitUntil(lambda: not scene._live._jobs.busy, timeout=5000)
    assert len(scene.viewer.layers) == 0


def test_edges_suit_the_zoom_that_stays_when_the_frame_changes(scene, qtbot):
    """Catches edges made for the whole of a new frame in a view that does not show it all."""
    scene.viewer.add_points([[0.5, 0.5]])
    camera, layer = scene.viewer.scene.camera, scene.editor.ellipses.layer
    camera.zoom = 8 * 1.5 / (layer.edge_width[0] * 0.036)
    qtbot.waitUntil(lambda: not scene._zoomed.isActive())
    scene.observation = SMALL.replace(shape=(1024, 1024))
    scene.wait()
    zoom = camera.zoom
    qtbot.waitUntil(lambda: np.allclose(0.036 * zoom * np.array(layer.edge_width), 1.5))
    assert camera.zoom == zoom


def test_edges_stay_thin_when_zoomed(scene, qtbot):
    """Catches ellipses as thick as the galaxies they mark; 1.5 pixels of the screen are meant."""
    camera, layer = scene.viewer.scene.camera, scene.editor.ellipses.layer
    whole = layer.edge_width[0]
    camera.zoom = 8 * 1.5 / (whole * 0.036)
    qtbot.waitUntil(lambda: np.allclose(layer.edge_width, whole / 8), timeout=2000)
    assert same_table(scene.sources, few_sources())
    camera.zoom = 0.1
    qtbot.waitUntil(lambda: np.allclose(layer.edge_width, whole), timeout=2000)

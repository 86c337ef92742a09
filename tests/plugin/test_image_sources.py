"""Images as sources in the live scene: outlines that are dragged, turned, listed and undone."""

from __future__ import annotations

import numpy as np
import pytest
from astropy import units as u
from astropy.io import fits
from astropy.table import vstack
from napari.utils.notifications import notification_manager
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources
from typed import enter

from napari_issis import Exposure, image_source, simulate
from napari_issis.exposure import same_table
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.exposure_layers import exposure_layers
from napari_issis.plugin.layers import features, shapes_data
from napari_issis.plugin.source_columns import changed, from_text, shown_values, to_text
from napari_issis.plugin.source_form import SourceForm
from napari_issis.plugin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")

NY, NX = 10, 16


def picture():
    y, x = np.mgrid[:NY, :NX]
    return np.exp(-0.5 * ((y - 3) ** 2 + (x - 9) ** 2) / 4) + 0.2 * (x < 4)


@pytest.fixture
def scene_with_image(scene):
    """A scene whose last source is an image of 16 x 10 pixels of the frame."""
    scene.add(image_source(picture(), 20.0, 40.0, 2e-14, pixel_scale=0.036, pa=20))
    scene.wait()
    notification_manager.records.clear()
    return scene


def assert_fresh(scene):
    scene.wait()
    expected = simulate(scene.sources, scene.observation, seed=scene.seed)
    assert np.array_equal(scene.counts.layer.data, expected.counts)
    assert scene.exposure == expected


def values(scene, row=-1):
    return {
        name: float(getattr(scene.sources[name][row], "value", scene.sources[name][row]))
        for name in ("x", "y", "flux", "r_half", "ellipticity", "pa")
    }


def test_it_is_drawn_as_its_outline(scene_with_image):
    """Catches an ellipse, sides exchanged, and an angle of the wrong sense."""
    layer = scene_with_image.editor.ellipses.layer
    assert list(layer.shape_type) == ["ellipse", "ellipse", "rectangle"]
    corners = np.asarray(layer.data[-1], dtype=float)
    angle = np.radians(20)
    expected = []
    for up, right in ((-5, -8), (5, -8), (5, 8), (-5, 8)):
        x = 20 + right * np.cos(angle) - up * np.sin(angle)
        y = 40 + right * np.sin(angle) + up * np.cos(angle)
        expected.append((y, x))
    np.testing.assert_allclose(corners, expected, atol=1e-4)
    assert_fresh(scene_with_image)


def test_dragging_it(scene_with_image, mouse):
    before = values(scene_with_image)
    mouse.drag((20.0, 40.0), (22.0, 39.0), (28.5, 33.25))
    scene_with_image.wait()
    after = values(scene_with_image)
    assert (after["x"], after["y"]) == pytest.approx((28.5, 33.25), abs=1e-4)
    assert {n: after[n] for n in after if n not in "xy"} == {
        n: before[n] for n in before if n not in "xy"
    }
    assert_fresh(scene_with_image)
    scene_with_image.undo()
    assert values(scene_with_image) == before
    assert_fresh(scene_with_image)


@pytest.mark.parametrize("steps", [(25,), (70, 140, 210), (-30, -60)])
def test_turning_it_by_the_handle(scene_with_image, mouse, steps):
    """Catches the sense, and an image that is upside down beyond 180 degrees."""
    layer = scene_with_image.editor.ellipses.layer
    mouse.drag((20.0, 40.0), (20.0, 40.0))
    before = values(scene_with_image)
    handle = np.asarray(layer._selected_box[9], dtype=float)
    centre = np.array([40.0, 20.0])
    y, x = handle - centre
    stops = []
    for degrees in steps:
        turn = np.radians(degrees)
        # counter-clockwise as seen: y up, x to the right
        stop = centre + np.array(
            [y * np.cos(turn) + x * np.sin(turn), x * np.cos(turn) - y * np.sin(turn)]
        )
        stops.append(tuple(stop[::-1]))
    mouse.drag(tuple(handle[::-1]), *stops)
    scene_with_image.wait()
    after = values(scene_with_image)
    assert after["pa"] == pytest.approx((before["pa"] + steps[-1]) % 360, abs=0.05)
    for name in ("flux", "r_half", "ellipticity"):
        assert after[name] == before[name]
    assert_fresh(scene_with_image)


def test_resizing_it_keeps_its_proportions(scene_with_image, mouse):
    """One side pulled to twice its length: the area doubles, the outline is drawn anew."""
    layer = scene_with_image.editor.ellipses.layer
    before = values(scene_with_image)
    corners = np.asarray(layer.data[-1], dtype=float)
    first = 0.5 * (corners[1] - corners[0] + corners[2] - corners[3])
    longer = corners + 0.5 * np.outer([-1, 1, 1, -1], first)
    layer.data = [*layer.data[:-1], longer]
    scene_with_image.wait()
    after = values(scene_with_image)
    assert after["r_half"] == pytest.approx(np.sqrt(2) * before["r_half"], rel=1e-5)
    for name in ("x", "y", "pa"):
        assert after[name] == pytest.approx(before[name], abs=1e-4)
    assert (after["ellipticity"], after["flux"]) == (0, before["flux"])
    shown = np.asarray(scene_with_image.editor.ellipses.layer.data[-1])
    np.testing.assert_allclose(shown, shapes_data(scene_with_image.sources[-1:])[0], atol=1e-4)
    assert_fresh(scene_with_image)


def test_delete_undo_and_paste(scene_with_image):
    before = scene_with_image.sources.copy()
    layer = scene_with_image.editor.ellipses.layer
    layer.selected_data = {2}
    layer._copy_data()
    layer.remove_selected()
    scene_with_image.wait()
    assert "image" not in scene_with_image.sources["kind"]
    scene_with_image.undo()
    assert same_table(scene_with_image.sources, before)
    assert list(layer.shape_type) == ["ellipse", "ellipse", "rectangle"]
    layer._paste_data()
    scene_with_image.wait()
    assert list(scene_with_image.sources["kind"][-2:]) == ["image", "image"]
    assert scene_with_image.sources["image"][-1] == before["image"][-1]
    assert not [r for r in notification_manager.records if "ellipse" in str(r.message)]
    assert_fresh(scene_with_image)


def test_a_rectangle_drawn_by_hand_is_no_image(scene_with_image):
    layer = scene_with_image.editor.ellipses.layer
    layer.selected_data = set()
    layer.add_rectangles([[[5, 5], [5, 15], [15, 15], [15, 5]]])
    scene_with_image.wait()
    assert list(scene_with_image.sources["kind"]).count("image") == 1
    assert list(layer.shape_type).count("rectangle") == 1
    assert_fresh(scene_with_image)


def test_text_of_the_list_and_back(scene_with_image):
    """What is copied can be pasted; the image is named by its text."""
    table = scene_with_image.sources
    shown = shown_values(table, SMALL, Units())
    assert shown["image"][-1].startswith("array#")
    assert shown["image"][0] == ""
    back = from_text(to_text(shown, range(len(table)), Units()), SMALL, Units())
    assert list(back["image"]) == list(table["image"])
    for name in ("x", "y", "r_half", "pa"):
        assert back[name][-1] == table[name][-1]
    with pytest.raises(ValueError, match=r"line 2 of the text, image: the image .* is not loaded"):
        from_text("kind\tx\ty\te\timage\nimage\t1\t2\t0\tarray#00", SMALL, Units())


def test_edits_in_the_list(scene_with_image):
    """An image is not squeezed; as another kind it is an ellipse, and undo brings it back."""
    row = len(scene_with_image.sources) - 1

    def edit(name, typed):
        table = changed(scene_with_image.sources, row, name, typed, SMALL, Units())
        scene_with_image.change(table)

    with pytest.raises(ValueError, match=r"ellipticity: 0.3 .* must be 0 for an image"):
        edit("ellipticity", "0.3")
    edit("pa", "200")
    assert values(scene_with_image)["pa"] == 200
    assert_fresh(scene_with_image)
    edit("kind", "gaussian")
    layer = scene_with_image.editor.ellipses.layer
    assert list(layer.shape_type) == 3 * ["ellipse"]
    scene_with_image.undo()
    assert list(layer.shape_type)[-1] == "rectangle"
    assert_fresh(scene_with_image)


def test_a_file_opened_in_napari(tmp_path):
    """The layers of a saved exposure are those of the scene."""
    one = image_source(picture(), 20.0, 40.0, 2e-14, pixel_scale=0.05, pa=20)
    exposure = simulate(vstack([few_sources(), one]), SMALL, seed=2)
    exposure.write(tmp_path / "scene.fits")
    layers = exposure_layers(Exposure.read(tmp_path / "scene.fits"))
    corners, options, _ = layers[1]
    assert options["shape_type"] == ["ellipse", "ellipse", "rectangle"]
    assert options["features"]["image"].iloc[-1] == one["image"][0]
    np.testing.assert_array_equal(corners[-1], shapes_data(one)[0])


def test_scenes_without_images_have_no_column(scene):
    assert "image" not in scene.sources.colnames
    assert list(features(scene.sources, scene.editor.source_id)["image"]) == 4 * [""]


# ---------------------------------------------------------------- the form


@pytest.fixture
def form(scene, qtbot):
    form = SourceForm(scene)
    qtbot.addWidget(form)
    form.resume()
    form.mode.value = "image"
    notification_manager.records.clear()
    yield form
    form.pause()


def test_a_file_is_chosen_and_added(scene, form, tmp_path, monkeypatch):
    path = tmp_path / "arcs.fits"
    fits.writeto(path, picture(), fits.Header([("PIXELSCL", 0.05)]))
    monkeypatch.setattr(form.image, "ask_path", lambda: str(path))
    form.image.choose.native.click()
    assert form.image.path.value == str(path)
    assert form.image.pixel_scale.number == 0.05
    for field, text in ((form.x, "30"), (form.y, "20.5"), (form.flux, "3e-15"), (form.pa, "70")):
        enter(field, text)
    form.image.mirrored.value = True
    form.button.native.click()
    expected = image_source(path, 30, 20.5, 3e-15, pa=70, mirrored=True)
    assert len(scene.sources) == 5
    for name in ("kind", "x", "y", "flux", "r_half", "pa", "image"):
        assert scene.sources[name][-1] == expected[name][0]
    assert_fresh(scene)
    scene.undo()
    assert same_table(scene.sources, few_sources())


def test_what_is_wrong_is_said_and_nothing_is_added(scene, form, tmp_path):
    form.button.native.click()
    assert "no image is chosen" in str(notification_manager.records[-1].message)
    form.image.path.value = str(tmp_path / "none.fits")
    form.button.native.click()
    assert "none.fits" in str(notification_manager.records[-1].message)
    bare = tmp_path / "bare.fits"
    fits.writeto(bare, picture() - 10)
    form.image.path.value = str(bare)
    form.image.path.native.editingFinished.emit()
    assert "does not say its pixel scale" in str(notification_manager.records[-1].message)
    form.button.native.click()
    assert "the sum must be positive" in str(notification_manager.records[-1].message)
    assert len(scene.sources) == 4


def test_magnitudes_of_images(form, tmp_path):
    path = tmp_path / "arcs.fits"
    fits.writeto(path, picture(), fits.Header([("PIXELSCL", 0.05)]))
    form.image.path.value = str(path)
    form.flux_unit.value = "AB mag"
    enter(form.flux, "19")
    f_nu = 10 ** (-0.4 * (19 + 48.6)) * u.erg / u.s / u.cm**2 / u.Hz
    flux = f_nu.to(
        u.erg / u.s / u.cm**2 / u.AA, u.spectral_density(form.scene.observation.pivot * u.AA)
    )
    assert form.table()["flux"][0].value == pytest.approx(flux.value, rel=1e-9)


@pytest.mark.needs_gl
def test_the_rows_fit_the_dock(make_napari_viewer, qtbot, tmp_path):
    """Catches rows that are wider than the panel of a small screen."""
    viewer = make_napari_viewer(show=True)
    widget = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(widget, area="right")
    widget.sources.mode.value = "image"
    widget.scene.add(
        image_source(
            np.kron(picture(), np.ones((6, 6))), 256.0, 256.0, 2e-14, pixel_scale=0.036, pa=20
        )
    )
    widget.scene.wait()
    viewer.window.resize(1366, 768)
    qtbot.wait(500)
    QApplication.processEvents()
    form, rows = widget.sources, widget.sources.image
    for field in (rows.path, rows.choose, rows.pixel_scale, rows.mirrored):
        corner = field.native.mapTo(form, field.native.rect().bottomRight())
        assert form.rect().contains(corner)
    viewer.window._qt_window.grab().save(str(tmp_path / "image.png"))

"""What the manifest declares, reached through napari's own menus, dialogs and drops."""

from __future__ import annotations

import traceback
from pathlib import Path

import numpy as np
import pytest
from astropy.io import fits
from napari.utils.notifications import notification_manager
from npe2 import PluginManifest
from qtpy.QtCore import QMimeData, QPointF, Qt, QUrl
from qtpy.QtGui import QDropEvent
from qtpy.QtWidgets import QFileDialog
from small_scene import SMALL, few_sources

from napari_issis import Exposure, simulate
from napari_issis.plugin.scene import open_scene, scene_of

pytestmark = [
    pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning"),
    pytest.mark.needs_gl,
]
MANIFEST = PluginManifest.from_file(Path(__file__).parents[2] / "napari.yaml")
WIDGETS = [widget.display_name for widget in MANIFEST.contributions.widgets]
SAMPLES = [sample.display_name for sample in MANIFEST.contributions.sample_data]


@pytest.fixture
def window(make_napari_viewer, npe2pm):
    """A real window of napari with the plugin of napari.yaml."""
    with npe2pm.tmp_plugin(manifest=MANIFEST):
        viewer = make_napari_viewer()
        notification_manager.records.clear()
        yield viewer
        viewer.layers.clear()


def action(viewer, *path):
    """The item of napari's menu bar with these words, menus built as a click builds them."""
    menu = viewer.window._qt_window.menuBar()
    for words in path:
        if hasattr(menu, "aboutToShow"):
            menu.aboutToShow.emit()
        # napari adds the plugin's name to some words.
        found = {
            one.text().replace("&", "").removesuffix(f" ({MANIFEST.display_name})"): one
            for one in menu.actions()
        }
        assert words in found, f"{words!r} is not among {list(found)}"
        item = found[words]
        menu = item.menu()
    return item


def told():
    return [str(note.message) for note in notification_manager.records]


def answer_dialog(monkeypatch, path):
    """Let napari's file dialogs return a file, if they offer its type."""

    def save(*args, **options):
        kinds = options["filter"].split(";;")
        fitting = [kind for kind in kinds if f"*{path.suffix})" in kind]
        return (str(path), fitting[0]) if fitting else ("", "")

    monkeypatch.setattr(QFileDialog, "getSaveFileName", save)
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *a, **o: ([str(path)], ""))


@pytest.mark.parametrize("name", WIDGETS)
def test_plugins_menu_opens_each_panel(window, name):
    """Catches a panel that is declared and never shown, or shown empty."""
    action(window, "Plugins", MANIFEST.display_name, name).trigger()
    docks = [str(words) for words in window.window.dock_widgets]
    assert any(name in words for words in docks), (docks, told())
    assert scene_of(window) is not None


@pytest.mark.parametrize("name", ["ISSIS simulator", "ISSIS sources"])
def test_layers_menu_opens_the_panels_too(window, name):
    """Catches a menu id that napari drops in silence."""
    action(window, "Layers", "Annotate", name).trigger()
    assert any(name in str(words) for words in window.window.dock_widgets)


@pytest.mark.parametrize("name", SAMPLES)
def test_open_sample_makes_a_live_scene(window, name, qtbot):
    """Catches a sample that opens as dead layers."""
    action(window, "File", "Open Sample", MANIFEST.display_name, name).trigger()
    qtbot.waitUntil(lambda: scene_of(window) is not None, timeout=20_000)
    scene = scene_of(window)
    scene.wait()
    assert len(scene.sources) > 0
    assert scene.counts.layer in window.layers


def test_save_selected_layers_and_open_file(window, tmp_path, monkeypatch, qtbot):
    """Catches a writer or reader that napari does not offer: the scene goes out and comes back."""
    scene = open_scene(few_sources(), SMALL.replace(channel="FUV", exposure=321), viewer=window)
    scene.wait()
    window.layers.selection = {scene.counts.layer}
    path = tmp_path / "through the menu.fits"
    answer_dialog(monkeypatch, path)
    action(window, "File", "Save Selected Layers...").trigger()
    assert path.exists(), told()
    saved = Exposure.read(path)
    assert saved == scene.exposure
    scene.add(few_sources()[:1])
    scene.seed = 5
    scene.wait()
    assert scene.exposure != saved
    # That the scene was edited meanwhile is asked about.
    monkeypatch.setattr("napari_issis.plugin.exposure_layers.may_replace", lambda count: True)
    action(window, "File", "Open File(s)...").trigger()
    qtbot.waitUntil(lambda: scene.observation == saved.observation and scene.seed == saved.seed)
    scene.wait()
    assert scene.exposure == saved
    assert len(window.layers) == 3


def test_an_ordinary_image_layer_is_saved(window, tmp_path, monkeypatch):
    """Catches a writer for our own image only."""
    layer = window.add_image(np.arange(12.0).reshape(3, 4), name="plain")
    window.layers.selection = {layer}
    answer_dialog(monkeypatch, tmp_path / "plain.fits")
    action(window, "File", "Save Selected Layers...").trigger()
    assert np.array_equal(fits.getdata(tmp_path / "plain.fits"), layer.data)


def test_an_error_of_saving_is_one_sentence(window, tmp_path, monkeypatch, qtbot):
    """Catches an error that is lost on its way: napari shows what reaches Qt's event loop."""
    scene = open_scene(few_sources(), SMALL, viewer=window)
    scene.wait()
    window.layers.selection = {scene.counts.layer}
    answer_dialog(monkeypatch, tmp_path / "missing" / "x.fits")
    with qtbot.capture_exceptions() as caught:
        action(window, "File", "Save Selected Layers...").trigger()
    words = [f"{kind.__name__}: {error}" for kind, error, _ in caught]
    for _, error, trace in caught:
        # They hold the window.
        error.__traceback__ = None
        traceback.clear_frames(trace)
    caught.clear()
    assert len(words) == 1
    assert words[0].startswith("FileNotFoundError: cannot write")
    assert words[0].endswith("does not exist; create it first.")
    assert not (tmp_path / "missing").exists()


def test_a_file_dropped_on_the_canvas(window, tmp_path, qtbot):
    """Catches a drop that napari does not hand to the reader."""
    exposure = simulate(few_sources(), SMALL, seed=9)
    exposure.write(tmp_path / "dropped.fits")
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(tmp_path / "dropped.fits"))])
    event = QDropEvent(
        QPointF(10, 10),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    window.window._qt_viewer.dropEvent(event)
    qtbot.waitUntil(lambda: scene_of(window) is not None, timeout=20_000)
    scene = scene_of(window)
    scene.wait()
    assert scene.exposure == exposure

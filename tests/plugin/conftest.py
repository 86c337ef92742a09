from __future__ import annotations

import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("napari")
pytest.importorskip("qtpy")

from napari.components import ViewerModel
from napari.utils._proxies import ReadOnlyWrapper
from napari.utils.interactions import (
    mouse_move_callbacks,
    mouse_press_callbacks,
    mouse_release_callbacks,
)
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis import autosave
from napari_issis.plugin.scene import Scene, open_scene


def has_screen() -> bool:
    if os.environ.get("QT_QPA_PLATFORM") == "offscreen":
        return False
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if has_screen():
        return
    for item in items:
        if item.get_closest_marker("needs_gl"):
            item.add_marker(pytest.mark.skip(reason="needs a screen or Xvfb"))


@pytest.fixture(autouse=True, scope="session")
def _without_gl():
    """Let napari make image layers where no OpenGL answers its questions."""
    if has_screen():
        return
    import napari._vispy.canvas
    import napari._vispy.layers.image
    import napari._vispy.layers.labels  # noqa: F401

    for name, module in list(sys.modules.items()):
        if name.startswith("napari._vispy"):
            if hasattr(module, "get_gl_extensions"):
                module.get_gl_extensions = lambda: ""
            if hasattr(module, "get_max_texture_sizes"):
                module.get_max_texture_sizes = lambda: (4096, 2048)


@pytest.fixture(autouse=True)
def _own_autosave_folder(tmp_path, monkeypatch):
    """Keep the tests' scenes apart from the user's."""
    folder = tmp_path / "autosave"
    folder.mkdir()
    monkeypatch.setattr(autosave, "autosave_folder", lambda: folder)


@pytest.fixture
def viewer(qapp: QApplication) -> ViewerModel:
    return ViewerModel()


@pytest.fixture
def scene(viewer: ViewerModel) -> Scene:
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    scene.wait()
    yield scene
    scene.viewer.layers.clear()
    _idle(scene)


def _idle(scene: Scene) -> None:
    while scene._live._jobs.busy:
        QApplication.processEvents()


class Mouse:
    """Presses and drags through napari's own callbacks, as its canvas runs them."""

    def __init__(self, viewer: ViewerModel) -> None:
        self.viewer = viewer

    def press(self, x: float, y: float) -> None:
        self._send(mouse_press_callbacks, "mouse_press", x, y)

    def move(self, x: float, y: float) -> None:
        self._send(mouse_move_callbacks, "mouse_move", x, y)

    def release(self, x: float, y: float) -> None:
        self._send(mouse_release_callbacks, "mouse_release", x, y)

    def drag(self, start: tuple[float, float], *stops: tuple[float, float]) -> None:
        """Press at ``start`` (x, y in pixels), move over ``stops`` and release at the last."""
        self.press(*start)
        for stop in stops:
            self.move(*stop)
            QApplication.processEvents()
        self.release(*stops[-1])

    def _send(self, run, kind: str, x: float, y: float) -> None:
        position = (y * 0.036, x * 0.036)
        event = ReadOnlyWrapper(
            SimpleNamespace(
                type=kind,
                position=position,
                pos=np.array([x, y]),
                modifiers=(),
                is_dragging=kind == "mouse_move",
                dims_displayed=[0, 1],
                dims_point=[0, 0],
                view_direction=None,
                up_direction=None,
                button=1,
                handled=False,
            ),
            exceptions=("handled",),
        )
        self.viewer.cursor.position = position
        for each in self.viewer.layers:
            # As a canvas sets it that shows a pixel as four by four on the screen.
            each.scale_factor = 0.036 / 4
        run(self.viewer, event)
        layer = self.viewer.layers.selection.active
        if layer is not None:
            run(layer, event)


@pytest.fixture
def mouse(viewer: ViewerModel) -> Mouse:
    return Mouse(viewer)

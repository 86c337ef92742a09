"""Zoom steps about the middle of the frame, or of the selected sources."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .canvas_geometry import to_view_box, view_box
from .scene import Scene

FACTORS = (1, 2, 4, 8)
# Keys of an active layer of ours; napari has Ctrl+0 and Ctrl+R.
FIT_KEY = "Shift-R"
KEYS = {factor: f"Control-{factor}" for factor in FACTORS}


class Zoom:
    """Sets the camera so that a given part of the frame fills the canvas.

    Parameters
    ----------
    scene : Scene
        The live scene.

    Attributes
    ----------
    centre : {"frame", "selected"}
        About what to zoom: without selected sources it is the frame.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.centre: Literal["frame", "selected"] = "frame"

    def fit(self) -> None:
        """Show the whole frame with a margin around it."""
        layer = self.scene.counts.layer
        if layer is not None:
            self.scene.viewer.reset_view(layers=[layer])

    def to(self, factor: float) -> None:
        """Let the frame's side, divided by ``factor``, fill the canvas.

        A factor of 1 shows the whole frame, 4 a quarter of its width and height: 128 pixels of
        512, along the side of the canvas in which they fit less well.
        """
        layer, viewer = self.scene.counts.layer, self.scene.viewer
        if layer is None or to_view_box(viewer, layer, (0.0, 0.0)) is None:
            return
        low, high = _frame(layer)
        centre = self._selected() if self.centre == "selected" else None
        height, width = np.abs(high - low)
        box = view_box(viewer, layer)
        viewer.scene.camera.center = tuple((low + high) / 2 if centre is None else centre)
        viewer.scene.camera.zoom = factor * min(box.height / height, box.width / width)

    def bind_keys(self, layer: Any) -> None:
        """Bind the keys on a layer of ours; they act while it is active."""
        layer.bind_key(FIT_KEY, lambda _: self.fit(), overwrite=True)
        for factor, key in KEYS.items():
            layer.bind_key(key, lambda _, factor=factor: self.to(factor), overwrite=True)

    def _selected(self) -> NDArray[np.float64] | None:
        """Middle of the selected sources, in world coordinates (y, x); None if there are none."""
        active = self.scene.viewer.layers.selection.active
        layers = sorted(self.scene.editor.layers, key=lambda layer: layer is not active)
        for layer in layers:
            if layer.selected_data:
                places = np.array([_position(layer, row) for row in layer.selected_data])
                middle: NDArray[np.float64] = (places.min(axis=0) + places.max(axis=0)) / 2
                return middle
        return None


def _position(layer: Any, row: int) -> NDArray[np.float64]:
    """World position of the middle of a point or an ellipse."""
    middle = np.asarray(layer.data[row], dtype=np.float64).reshape(-1, 2).mean(axis=0)
    return np.asarray(layer.data_to_world(middle), dtype=np.float64)


def _frame(layer: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """World coordinates of two opposite corners of the frame."""
    ny, nx = layer.data.shape
    low = np.asarray(layer.data_to_world((-0.5, -0.5)), dtype=np.float64)
    return low, np.asarray(layer.data_to_world((ny - 0.5, nx - 0.5)), dtype=np.float64)

"""Keeps the whole frame in sight when panels that open or close change the canvas."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from .canvas_geometry import to_view_box, view_box
from .single_shot import single_shot
from .zoom import Zoom

# pixels on the screen that may be cut off
SLACK = 1.0


class WholeFrame:
    """Fits a frame that was wholly in sight into a canvas of another size.

    A view that the user has zoomed or moved, so that a part of the frame is out of sight, stays.

    Parameters
    ----------
    zoom : Zoom
        What fits the frame.
    """

    def __init__(self, zoom: Zoom) -> None:
        self._zoom, self._scene = zoom, zoom.scene
        self._was_whole = False
        self._fitted: tuple[Any, ...] | None = None
        self._settled = single_shot(self._fit)

    def resume(self) -> None:
        """Follow canvas and camera."""
        viewer = self._scene.viewer
        viewer.canvas.events.size.connect(self._resized)
        for event in (viewer.scene.camera.events.zoom, viewer.scene.camera.events.center):
            event.connect(self._moved)
        self._moved()

    def pause(self) -> None:
        """Stop following them."""
        viewer = self._scene.viewer
        viewer.canvas.events.size.disconnect(self._resized)
        for event in (viewer.scene.camera.events.zoom, viewer.scene.camera.events.center):
            event.disconnect(self._moved)
        with suppress(RuntimeError):  # Qt has gone where a program ends with its window open
            self._settled.stop()

    @property
    def is_whole(self) -> bool:
        """Whether the whole frame is in sight."""
        layer, viewer = self._scene.counts.layer, self._scene.viewer
        if layer is None or layer not in viewer.layers:
            return False
        ny, nx = layer.data.shape
        box = view_box(viewer, layer)
        for corner in ((-0.5, -0.5), (ny - 0.5, nx - 0.5)):
            place = to_view_box(viewer, layer, corner)
            if place is None:
                return False
            x, y = place - np.array([box.left, box.top])
            if not (-SLACK <= x <= box.width + SLACK and -SLACK <= y <= box.height + SLACK):
                return False
        return True

    @property
    def _camera(self) -> tuple[Any, ...]:
        camera = self._scene.viewer.scene.camera
        return camera.zoom, *camera.center

    def _moved(self, event: Any = None) -> None:
        if not self._settled.isActive():
            self._was_whole = self.is_whole

    def _resized(self, event: Any = None) -> None:
        # once, when all panels have their sizes
        self._settled.start(0)

    def _fit(self) -> None:
        if (self._was_whole and not self.is_whole) or self._camera == self._fitted:
            self._zoom.fit()
            self._fitted = self._camera
        self._was_whole = self.is_whole

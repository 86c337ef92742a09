"""The source model beside the final image, as two cells of napari's grid with one camera."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.layers import Image
from napari.utils.events import EmitterGroup, Event

from ..observation import Observation
from . import layer_styles as styles
from .marks import MARKER
from .picking import activate, has_mouse, source_under
from .scene import Scene

FRAME_NAME = "ISSIS source model"
# Between the cells, pixels on the screen.
SPACING = 8


class SideBySide:
    """Shows the sources in the left cell of the grid, on an empty frame, the image in the right.

    The grid fills its cells from the uppermost layer down, so many layers to a cell. Layers of
    the user's stay where they are in the list: those above the sources are shown with them,
    those below with the image, or in further cells if they are many.

    Parameters
    ----------
    scene : Scene
        The live scene.

    Attributes
    ----------
    events : napari.utils.events.EmitterGroup
        ``enabled`` when the two frames were parted or joined.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.events = EmitterGroup(source=self, enabled=Event)
        self._frame: Image | None = None
        self._before: dict[str, Any] = {}
        self._busy = False

    @property
    def enabled(self) -> bool:
        """Whether the source model is beside the image; can be set."""
        return self._frame is not None

    @enabled.setter
    def enabled(self, enabled: bool) -> None:
        if enabled and not self.enabled and self.scene.layers:
            self._part()
        elif not enabled and self.enabled:
            self._join()

    def _part(self) -> None:
        viewer, grid = self.scene.viewer, self.scene.viewer.canvas.grid
        self._before = {
            name: getattr(grid, name) for name in ("enabled", "stride", "shape", "spacing")
        }
        self._frame = _empty_frame(self.scene.observation)
        self._busy = True
        selected = set(viewer.layers.selection)
        viewer.layers.insert(self._place(), self._frame)
        viewer.layers.selection.clear()
        viewer.layers.selection.update(selected)
        self._busy = False
        self._arrange()
        grid.enabled = True
        layers = viewer.layers.events
        for emitter in (layers.inserted, layers.removed, layers.reordered):
            emitter.connect(self._arrange)
        grid.events.enabled.connect(self._grid_switched)
        self.scene.events.observation.connect(self._reframe)
        viewer.mouse_drag_callbacks.append(self._pick)
        self._fit()
        self.events.enabled()

    def _join(self) -> None:
        viewer, grid = self.scene.viewer, self.scene.viewer.canvas.grid
        layers = viewer.layers.events
        for emitter in (layers.inserted, layers.removed, layers.reordered):
            emitter.disconnect(self._arrange)
        grid.events.enabled.disconnect(self._grid_switched)
        self.scene.events.observation.disconnect(self._reframe)
        viewer.mouse_drag_callbacks.remove(self._pick)
        frame, self._frame = self._frame, None
        if frame in viewer.layers:
            viewer.layers.remove(frame)
        for name, value in self._before.items():
            setattr(grid, name, value)
        self._fit()
        self.events.enabled()

    def _place(self) -> int:
        """Index in the layer list just below the sources, above the image."""
        layers = self.scene.viewer.layers
        sources = [layers.index(layer) for layer in self.scene.editor.layers]
        counts = self.scene.counts.layer
        above_image = 0 if counts is None else layers.index(counts) + 1
        return max(above_image, min(sources, default=len(layers)))

    def _arrange(self, event: Any = None) -> None:
        """Give the left cell all layers from the empty frame up."""
        layers = self.scene.viewer.layers
        if self._busy:
            return
        if self._frame not in layers or not self.scene.layers:
            self._join()
            return
        grid = self.scene.viewer.canvas.grid
        grid.shape = (1, -1)
        grid.spacing = SPACING
        grid.stride = -(len(layers) - layers.index(self._frame))

    def _grid_switched(self, event: Any = None) -> None:
        """Follow napari's own button."""
        if not self.scene.viewer.canvas.grid.enabled:
            self._before["enabled"] = False
            self._join()

    def _reframe(self, event: Any = None) -> None:
        geometry = _geometry(self.scene.observation)
        assert self._frame is not None
        if tuple(self._frame.scale) != geometry["scale"]:
            for name, value in geometry.items():
                setattr(self._frame, name, value)
            self._fit()

    def _fit(self) -> None:
        layer = self._frame or self.scene.counts.layer
        if layer is not None:
            self.scene.viewer.reset_view(layers=[layer])

    def _pick(self, _viewer: Any, event: Any) -> None:
        # The empty frame may have become the active layer by accident.
        layers = self.scene.viewer.layers
        if layers.selection.active is self._frame and has_mouse(layers, [self._frame]):
            found = source_under(layers, self.scene.layers, event.position)
            if found is not None and event.button == 1:
                activate(layers, found[0])


def _empty_frame(observation: Observation) -> Image:
    """Make a black layer of one pixel that covers the frame."""
    layer = Image(
        np.zeros((1, 1), np.uint8),
        name=FRAME_NAME,
        contrast_limits=(0, 1),
        metadata={MARKER: {"role": "frame"}},
        **{**styles.GEOMETRY, **_geometry(observation)},
    )
    border = layer.bounding_box
    border.visible, border.points, border.line_color = True, False, styles.FRAME_COLOR
    return layer


def _geometry(observation: Observation) -> dict[str, tuple[float, ...]]:
    step = observation.pixel_scale
    return {
        "scale": tuple(size * step for size in observation.shape),
        "translate": tuple((n - 1) / 2 * step for n in observation.shape),
    }

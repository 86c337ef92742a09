"""Where the canvas shows what: from pixels of an image to pixels of the screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from qtpy.QtWidgets import QMainWindow, QWidget


@dataclass(frozen=True)
class ViewBox:
    """The part of the canvas that shows a layer: all of it, or a cell of the grid.

    In pixels of the canvas widget.
    """

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True)
class ScreenAxis:
    """Where the pixels of one axis of an image lie along one direction of the canvas.

    Attributes
    ----------
    origin : float
        Where the centre of the first pixel lies.
    step : float
        From one centre to the next; negative where the axis runs to the left or upwards.
    start, stop : float
        Ends of the view box along this direction.
    """

    origin: float
    step: float
    start: float
    stop: float

    def to_canvas(self, position: Any) -> Any:
        """Return where positions on the image, in its pixels, lie on the canvas."""
        return self.origin + self.step * np.asarray(position, dtype=np.float64)

    def visible(self, length: int) -> tuple[int, int]:
        """Return the first and one past the last of ``length`` pixels that are in sight."""
        ends = sorted((edge - self.origin) / self.step for edge in (self.start, self.stop))
        first = int(np.clip(np.floor(ends[0] + 0.5), 0, length))
        return first, int(np.clip(np.ceil(ends[1] + 0.5), first, length))


def find_window(widget: QWidget) -> QMainWindow | None:
    """Find the main window in which a widget is docked (or from which it floats)."""
    parent = widget
    while parent is not None and not isinstance(parent, QMainWindow):
        parent = parent.parentWidget()
    return parent


def find_canvas(widget: QWidget) -> QWidget | None:
    """Find the canvas of the window in which a widget is docked.

    napari has no public name for it: it is vispy's widget in the middle of the window. None
    if there is none; what needs the canvas does without it then.
    """
    window = find_window(widget)
    centre = None if window is None else window.centralWidget()
    for child in [] if centre is None else centre.findChildren(QWidget):
        if any(base.__module__.startswith("vispy.") for base in type(child).__mro__):
            return child
    return None


def view_box(viewer: Any, layer: Any) -> ViewBox:
    """Return the part of the canvas that shows a layer."""
    height, width = viewer.canvas.size
    grid, layers = viewer.canvas.grid, viewer.layers
    if not grid.enabled:
        return ViewBox(0.0, 0.0, width, height)
    rows, columns = grid.actual_shape(layers)
    row, column = grid.position(layers.index(layer), layers)
    cell_height, cell_width = viewer.canvas.viewbox_size(layers)
    across = (width - columns * cell_width) / max(columns - 1, 1)
    down = (height - rows * cell_height) / max(rows - 1, 1)
    return ViewBox(
        max(column, 0) * (cell_width + across),
        max(row, 0) * (cell_height + down),
        cell_width,
        cell_height,
    )


def to_view_box(viewer: Any, layer: Any, position: Any) -> NDArray[np.float64] | None:
    """Return the canvas position (x, y) of a position (row, column) on a layer in two dimensions.

    None where the canvas shows other axes than the two of the layer, or three.
    """
    dims, camera = viewer.dims, viewer.scene.camera
    shown = [axis - (dims.ndim - 2) for axis in dims.displayed]
    if dims.ndisplay != 2 or sorted(shown) != [0, 1]:
        return None
    world = np.asarray(layer.data_to_world(position), dtype=np.float64)[shown]
    down, right = world - np.asarray(camera.center[-2:], dtype=np.float64)
    vertical, horizontal = camera.orientation2d
    box = view_box(viewer, layer)
    return np.array(
        [
            box.left + box.width / 2 + camera.zoom * (right if horizontal == "right" else -right),
            box.top + box.height / 2 + camera.zoom * (down if vertical == "down" else -down),
        ]
    )


def screen_axis(viewer: Any, layer: Any, axis: int) -> ScreenAxis | None:
    """Return where the pixels along an axis of an image lie on the canvas.

    Parameters
    ----------
    viewer : napari.Viewer
        The viewer.
    layer : napari.layers.Image
        The image, of two dimensions.
    axis : {0, 1}
        0 for the rows, down or up the canvas; 1 for the columns, across it.

    Returns
    -------
    ScreenAxis or None
        None where the canvas does not show this axis in this direction.
    """
    unit = (1.0, 0.0) if axis == 0 else (0.0, 1.0)
    first = to_view_box(viewer, layer, (0.0, 0.0))
    second = to_view_box(viewer, layer, unit)
    if first is None or second is None:
        return None
    direction = 1 - axis
    step = float(second[direction] - first[direction])
    if step == 0:
        return None
    box = view_box(viewer, layer)
    start, length = (box.top, box.height) if axis == 0 else (box.left, box.width)
    return ScreenAxis(float(first[direction]), step, start, start + length)

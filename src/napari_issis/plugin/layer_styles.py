"""How the layers look: colours, symbols and sizes in one place (colours after the paper)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..sources import IMAGE

ELLIPSE_COLORS = {
    "uniform": "cyan",
    "gaussian": "lightgreen",
    "exponential": "yellow",
    "devaucouleurs": "orange",
    "sersic": "magenta",
    IMAGE: "dodgerblue",
}
# Beside the scale, which is the camera's.
GEOMETRY: dict[str, Any] = {
    "units": ("arcsec", "arcsec"),
    "axis_labels": ("y", "x"),
}
POINTS: dict[str, Any] = {
    "name": "ISSIS point sources",
    "symbol": "star",
    "face_color": "transparent",
    "border_color": "red",
    "border_width": 0.06,
    # Pixels on the screen: when zoomed in, the marker does not hide the star. vispy draws the
    # border of a limited marker at least half as thick as the lower limit.
    "canvas_size_limits": (2, 16),
    "out_of_slice_display": False,
    **GEOMETRY,
}
ELLIPSES: dict[str, Any] = {
    "name": "ISSIS extended sources",
    "face_color": "transparent",
    "edge_color": ELLIPSE_COLORS["exponential"],
    **GEOMETRY,
}
# On a screen of 1366 x 768, in its pixels: the longest side of a frame that fits napari's canvas,
# the edge of an ellipse and the width of a marker.
CANVAS, EDGE, MARKER_WIDTH = 600.0, 1.5, 14.0
# A click this near (half of it, in pixels of the frame) takes a star; crowded stars need less.
WIDEST_MARKER = 18.0
# The brightness scale at first.
SCALE = "sqrt"
FRAME_COLOR = "#7a7f88"
COUNTS: dict[str, Any] = {
    "name": "ISSIS counts",
    "colormap": "gray",
    "interpolation2d": "nearest",
    **GEOMETRY,
}


def edge_width(shape: tuple[int, int]) -> float:
    """Return the width of the ellipses' edges in pixels of a frame of this shape."""
    return EDGE * max(shape) / CANVAS


def marker_size(shape: tuple[int, int]) -> float:
    """Return the size of the markers in pixels of a frame of this shape."""
    return min(MARKER_WIDTH * max(shape) / CANVAS, WIDEST_MARKER)


def shape_types(kinds: Iterable[str]) -> list[str]:
    """Return how each kind is drawn: images as the rectangles that they are."""
    return ["rectangle" if kind == IMAGE else "ellipse" for kind in kinds]


def edge_colors(kinds: Iterable[str]) -> list[str]:
    """Return the colour of the ellipse of each kind (white for none)."""
    return [ELLIPSE_COLORS.get(str(kind), "white") for kind in kinds]


def kind_color(kind: str) -> str:
    """Return the colour of a kind's marker."""
    return str(POINTS["border_color"]) if kind == "point" else edge_colors([kind])[0]

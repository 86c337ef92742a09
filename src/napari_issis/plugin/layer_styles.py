"""How the layers look: colours, symbols and sizes in one place (colours after the paper)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..instrument import PIXEL_SCALE

ELLIPSE_COLORS = {
    "uniform": "cyan",
    "gaussian": "lightgreen",
    "exponential": "yellow",
    "devaucouleurs": "orange",
    "sersic": "magenta",
}
GEOMETRY: dict[str, Any] = {
    "scale": (PIXEL_SCALE, PIXEL_SCALE),
    "units": ("arcsec", "arcsec"),
    "axis_labels": ("y", "x"),
}
POINTS: dict[str, Any] = {
    "name": "ISSIS point sources",
    "symbol": "star",
    "size": 9.0,
    "face_color": "transparent",
    "border_color": "red",
    "border_width": 0.06,
    # Pixels on the screen: when zoomed in, the marker does not hide the star.
    "canvas_size_limits": (6, 16),
    "out_of_slice_display": False,
    **GEOMETRY,
}
ELLIPSES: dict[str, Any] = {
    "name": "ISSIS extended sources",
    "face_color": "transparent",
    "edge_color": ELLIPSE_COLORS["exponential"],
    "edge_width": 0.6,
    **GEOMETRY,
}
FRAME_COLOR = "#7a7f88"
COUNTS: dict[str, Any] = {
    "name": "ISSIS counts",
    "colormap": "gray",
    "interpolation2d": "nearest",
    "gamma": 0.5,
    **GEOMETRY,
}


def edge_colors(kinds: Iterable[str]) -> list[str]:
    """Return the colour of the ellipse of each kind (white for none)."""
    return [ELLIPSE_COLORS.get(str(kind), "white") for kind in kinds]

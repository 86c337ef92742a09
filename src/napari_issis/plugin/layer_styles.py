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
    "size": 10.0,
    "face_color": [1.0, 0.0, 0.0, 0.25],
    "border_color": "red",
    "border_width": 0.09,
    "canvas_size_limits": (8, 18),
    "out_of_slice_display": False,
    **GEOMETRY,
}
ELLIPSES: dict[str, Any] = {
    "name": "ISSIS extended sources",
    "face_color": "transparent",
    "edge_color": ELLIPSE_COLORS["exponential"],
    "edge_width": 0.8,
    **GEOMETRY,
}
COUNTS: dict[str, Any] = {
    "name": "ISSIS counts",
    "colormap": "gray",
    "interpolation2d": "nearest",
    **GEOMETRY,
}


def edge_colors(kinds: Iterable[str]) -> list[str]:
    """Return the colour of the ellipse of each kind."""
    return [ELLIPSE_COLORS[str(kind)] for kind in kinds]

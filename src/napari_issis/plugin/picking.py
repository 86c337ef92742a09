"""The source under the pointer, on whichever of our layers it is: two layers that act as one."""

from __future__ import annotations

from typing import Any

# "direct" moves single vertices, which ellipses and images have none of
PICKING_MODES = ("pan_zoom", "select", "direct")


def source_under(layers: Any, ours: list[Any], position: Any) -> tuple[Any, int | None] | None:
    """Find the uppermost source at a position.

    Parameters
    ----------
    layers : napari.components.LayerList
        The viewer's layers, from the bottom up.
    ours : list of layers
        Image, ellipses and points of the scene.
    position : sequence of float
        World coordinates.

    Returns
    -------
    (layer, row) or None
        Row is None on a handle of the selected ellipses, which may lie outside them.
    """
    for layer in reversed(list(layers)):
        if not any(layer is own for own in ours) or not hasattr(layer, "selected_data"):
            continue
        if not layer.visible or not layer.editable:
            continue
        value = layer.get_value(position, world=True)
        hit, handle = value if isinstance(value, tuple) else (value, None)
        if hit is not None or (handle is not None and layer is layers.selection.active):
            return layer, None if hit is None else int(hit)
    return None


def has_mouse(layers: Any, ours: list[Any]) -> bool:
    """Whether the mouse picks sources: one of our layers is active and nothing is being drawn.

    Layers of others, and a layer of ours in a drawing or editing mode, keep the mouse.
    """
    active = layers.selection.active
    return any(active is own for own in ours) and active.mode in PICKING_MODES


def activate(layers: Any, layer: Any) -> None:
    """Make a layer of sources active, ready to select and drag.

    napari hands a press to the active layer only, after the viewer's own callbacks; so a
    layer made active in those gets the same press and drags the source.
    """
    if layers.selection.active is not layer:
        layers.selection.active = layer
    if layer.mode != "select":
        layer.mode = "select"

"""Press on a source of either layer to select and drag it: two layers that act as one."""

from __future__ import annotations

from typing import Any


def activate_source_under(layers: Any, ours: list[Any], event: Any) -> None:
    """Make the layer active that has a source under the pointer.

    napari hands a press to the active layer only, after the viewer's own callbacks; so a
    layer made active here gets the same press and drags the source. Layers of others, and
    a layer of ours in a drawing or editing mode, keep the mouse.

    Parameters
    ----------
    layers : napari.components.LayerList
        The viewer's layers, from the bottom up.
    ours : list of layers
        Image, ellipses and points of the scene.
    event : napari mouse event
        The press.
    """
    active = layers.selection.active
    if active not in ours or active.mode not in ("pan_zoom", "select") or event.button != 1:
        return
    sources = [layer for layer in ours if hasattr(layer, "selected_data")]
    for layer in reversed(list(layers)):
        if layer not in sources or not layer.visible or not layer.editable:
            continue
        value = layer.get_value(event.position, world=True)
        hit = value[0] if isinstance(value, tuple) else value
        # The handles of selected ellipses lie outside them.
        handle = isinstance(value, tuple) and value[1] is not None and layer is active
        if hit is not None or handle:
            if active is not layer:
                layers.selection.active = layer
            if layer.mode != "select":
                layer.mode = "select"
            return

"""Keys of the scene's layers: those of the viewer belong to the user."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .scene import Scene

# Arrow keys: a pixel to the right and up; with Shift a part of it.
ARROWS = {"Left": (-1, 0), "Right": (1, 0), "Down": (0, -1), "Up": (0, 1)}
FINE_STEP = 0.1
KIND_KEY = "Shift-K"
DELETE_KEYS = ("Delete", "Backspace")


class LayerKeys:
    """Binds keys to what they do in a scene.

    Parameters
    ----------
    scene : Scene
        The scene.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._has_arrows = False

    def bind(self, layer: Any) -> None:
        """Bind the keys on a layer of the scene."""
        scene = self._scene
        layer.bind_key("Control-Z", scene.undo, overwrite=True)
        layer.bind_key("Control-Shift-Z", scene.redo, overwrite=True)
        layer.bind_key(KIND_KEY, scene.next_kind, overwrite=True)
        for key in DELETE_KEYS:
            layer.bind_key(key, self._remove_selected, overwrite=True)
        self._bind_arrows(layer)

    def follow_selection(self) -> None:
        """Let the arrow keys move the selected sources; without any they are napari's."""
        if self._has_arrows != bool(self._scene.editor.selected_ids):
            self._has_arrows = not self._has_arrows
            for layer in self._scene.layers:
                self._bind_arrows(layer)

    def _remove_selected(self, layer: Any) -> None:
        """Remove what is selected on either layer; napari would on the active one alone."""
        if not getattr(layer, "_is_creating", False):
            self._scene.remove(self._scene.editor.selected_ids)

    def _bind_arrows(self, layer: Any) -> None:
        for key, (right, up) in ARROWS.items():
            for modifier, step in (("", 1.0), ("Shift-", FINE_STEP)):

                def move(_: Any, right: float = step * right, up: float = step * up) -> None:
                    self._scene.nudge(right, up)

                layer.bind_key(modifier + key, move if self._has_arrows else None, overwrite=True)

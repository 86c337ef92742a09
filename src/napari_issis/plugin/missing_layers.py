"""A row that says which layers of the scene the user deleted, and brings them back."""

from __future__ import annotations

from typing import Any

from napari.utils.notifications import show_error
from qtpy.QtWidgets import QHBoxLayout, QLabel, QWidget

from .push_button import push_button
from .scene import Scene

NAMES = {"counts": "the final image", "ellipses": "extended sources", "points": "point sources"}


class MissingLayers(QWidget):  # type: ignore[misc]
    """Is seen while a layer of the scene is missing, unless the user does without it.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self.scene = scene
        self.text = QLabel()
        self.text.setWordWrap(True)
        self.button = push_button("Restore", "", self._restore)
        self.leave = push_button(
            "Leave", "Do without: a layer of sources comes back with its next source", self._leave
        )
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 4, 0)
        row.addWidget(self.text, 1)
        row.addWidget(self.button)
        row.addWidget(self.leave)
        self._left: tuple[str, ...] = ()
        self.show_missing()

    def resume(self) -> None:
        """Follow the scene."""
        self.scene.events.missing.connect(self.show_missing)
        self.show_missing()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.missing.disconnect(self.show_missing)

    def show_missing(self, event: Any = None) -> None:
        """Say which layers are missing, and how many sources went with them."""
        missing = self.scene.missing
        self._left = tuple(role for role in self._left if role in missing)
        noun = "layer" if len(missing) == 1 else "layers"
        names = ", ".join(NAMES[role] for role in missing)
        gone = len(self.scene.editor.with_lost().source_id) - len(self.scene.editor.source_id)
        sources = f" with {gone} source{'s'[: gone != 1]}" if gone else ""
        self.text.setText(f"Deleted {noun}: {names}{sources}.")
        self.button.setToolTip(
            f"Make the {noun} anew" + (", and bring those sources back" if gone else "")
        )
        self.setVisible(set(missing) > set(self._left))

    def _restore(self) -> None:
        try:
            self.scene.restore()
        except ValueError as error:
            show_error(str(error))

    def _leave(self) -> None:
        self._left = self.scene.missing
        self.show_missing()

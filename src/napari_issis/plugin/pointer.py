"""What the pointer does over a scene: it picks, removes and describes sources."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from qtpy.QtGui import QCursor
from qtpy.QtWidgets import QApplication, QToolTip
from superqt.utils import qthrottled

from .picking import activate, has_mouse, source_under
from .readout import pixel_text, source_text

# Milliseconds between two descriptions.
REST = 50


class Pointer:
    """The pointer over the canvas of a scene.

    Parameters
    ----------
    scene : Scene
        The live scene. The viewer's mouse callbacks keep it alive.
    """

    def __init__(self, scene: Any) -> None:
        self.scene, self.viewer = scene, scene.viewer
        self.shown = ""
        self._told = ""
        self.viewer.mouse_drag_callbacks.append(self._press)
        self.viewer.mouse_double_click_callbacks.append(self._double_click)
        self.viewer.cursor.events.position.connect(self._moved)
        self.viewer.events.status.connect(self._status)
        self._describe_soon = qthrottled(self.describe, timeout=REST)
        self._tell_anew_soon = qthrottled(self._tell_anew, timeout=REST)
        # the pixel under a pointer at rest changes with the picture
        scene.events.shown.connect(self._picture_shown)

    def _press(self, _viewer: Any, event: Any) -> Iterator[None]:
        """Let the press pick the source under the pointer, and only it unless Shift is held.

        What is selected on the active layer is napari's business. A source that is selected
        already keeps those on the other layer with it, unless it is clicked and not dragged.
        """
        self.hide()
        layers, ours, editor = self.viewer.layers, self.scene.layers, self.scene.editor
        if event.button != 1 or not has_mouse(layers, ours):
            return
        found = source_under(layers, ours, event.position)
        if found is not None:
            activate(layers, found[0])
        if {"Shift", "Control"} & set(event.modifiers):
            return
        active, start = layers.selection.active, event.position
        keeps = found is not None and (found[1] is None or _id(*found) in editor.selected_ids)
        if not keeps:
            editor.deselect_all_but(active)
        draws_box = found is None and active.mode == "select"
        moved = False
        yield
        while event.type == "mouse_move":
            moved = True
            yield
        if draws_box and moved:
            editor.select_in_box(active, start, event.position)
        elif keeps and not moved:
            editor.deselect_all_but(active)

    def _double_click(self, _viewer: Any, event: Any) -> None:
        """Remove the source under the pointer."""
        layers = self.viewer.layers
        if event.button != 1 or not has_mouse(layers, self.scene.layers):
            return
        found = source_under(layers, self.scene.layers, event.position)
        if found is not None and found[1] is not None:
            self.scene.remove([_id(*found)])

    def _moved(self, event: Any = None) -> None:
        if has_mouse(self.viewer.layers, self.scene.layers):
            self._describe_soon()
        elif self.shown:
            self.hide()

    def describe(self) -> None:
        """Show the parameters of the source under the pointer beside it, or nothing."""
        text = ""
        if self.scene.editor.held is None and self.viewer.mouse_over_canvas:
            text = self.source_here()
        if not text:
            self.hide()
        elif text != self.shown or not QToolTip.isVisible():
            self.shown = text
            QToolTip.showText(QCursor.pos(), text, QApplication.widgetAt(QCursor.pos()))

    def hide(self) -> None:
        """Take the description away; a tooltip of others stays."""
        if self.shown:
            self.shown = ""
            QToolTip.hideText()

    def source_here(self) -> str:
        """Describe the source under the pointer; empty if there is none."""
        layers, scene = self.viewer.layers, self.scene
        found = source_under(layers, scene.layers, self.viewer.cursor.position)
        if found is None or found[1] is None:
            return ""
        place = scene.editor.row_of(_id(*found))
        if place is None:
            return ""
        return source_text(scene.editor.sources[place], scene.observation, scene.units)

    def _picture_shown(self, event: Any = None) -> None:
        if self._told and self.viewer.status == self._told:
            self._tell_anew_soon()

    def _tell_anew(self) -> None:
        if self.viewer.status == self._told:
            self._status()

    def _status(self, event: Any = None) -> None:
        """Put the pixel under the pointer into the status line, where napari shows its own."""
        image = self.scene.counts.layer
        picture = self.scene.picture
        active = self.viewer.layers.selection.active
        if image is None or picture is None or not any(active is own for own in self.scene.layers):
            return
        y, x = image.world_to_data(self.viewer.cursor.position)[-2:]
        text = pixel_text(picture.exposure, x, y)
        if not text:
            return
        self._told = text
        if self.viewer.status != text:
            self.viewer.status = text


def _id(layer: Any, row: int | None) -> int:
    return int(layer.features["source_id"].iloc[row])

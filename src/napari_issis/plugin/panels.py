"""Our dock widgets beside the canvas: opened once, then shown and hidden."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from qtpy.QtWidgets import QDockWidget, QWidget

LIST_NAME = "ISSIS sources"


def toggle_panel(viewer: Any, name: str, make: Callable[[Any], QWidget], area: str) -> None:
    """Show a dock widget if it is hidden or was never opened, else hide it.

    Parameters
    ----------
    viewer : napari.Viewer
        The viewer.
    name : str
        Its title, by which it is found again.
    make : callable
        Makes the widget for the viewer.
    area : str
        Where it is docked at first.
    """
    # napari adds the plugin's name to the title of what its own menus open
    for title, widget in viewer.window.dock_widgets.items():
        if title.startswith(name):
            dock = _dock_of(widget)
            dock.setVisible(not dock.isVisible())
            return
    viewer.window.add_dock_widget(make(viewer), name=name, area=area)


def _dock_of(widget: QWidget) -> QWidget:
    dock = widget
    while not isinstance(dock, QDockWidget):
        dock = dock.parentWidget()
    return dock

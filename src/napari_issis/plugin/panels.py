"""Our dock widgets beside the canvas: opened once, then shown and hidden."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from qtpy.QtCore import Qt
from qtpy.QtWidgets import QDockWidget, QMainWindow, QWidget

from .canvas_geometry import find_window

LIST_NAME, ROW_NAME = "ISSIS sources", "ISSIS row trace"
BOTTOM = Qt.DockWidgetArea.BottomDockWidgetArea
# Heights in pixels on the screen: so much that at 768 of them the canvas keeps the half.
ROW_HEIGHT, LIST_HEIGHT = 120, 150


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
    widget = make(viewer)
    viewer.window.add_dock_widget(widget, name=name, area=area)
    window = find_window(widget)
    if window is not None:
        stack_at_bottom(window)


def stack_at_bottom(window: QMainWindow) -> None:
    """Put the list of sources below the row trace, where Qt has them side by side.

    The trace has the axis of the canvas, and needs its width.
    """
    found: dict[str, QDockWidget] = {}
    for dock in window.findChildren(QDockWidget):
        for name in (ROW_NAME, LIST_NAME):
            here = window.dockWidgetArea(dock) == BOTTOM and not dock.isFloating()
            if here and not dock.isHidden() and dock.windowTitle().startswith(name):
                found[name] = dock
    heights = {ROW_NAME: ROW_HEIGHT, LIST_NAME: LIST_HEIGHT}
    if len(found) == 2 and not window.tabifiedDockWidgets(found[ROW_NAME]):
        window.splitDockWidget(found[ROW_NAME], found[LIST_NAME], Qt.Orientation.Vertical)
    window.resizeDocks(
        list(found.values()), [heights[name] for name in found], Qt.Orientation.Vertical
    )


def _dock_of(widget: QWidget) -> QWidget:
    dock = widget
    while not isinstance(dock, QDockWidget):
        dock = dock.parentWidget()
    return dock

"""Our dock widgets beside the canvas: opened once, then shown and hidden."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from qtpy.QtCore import Qt, QTimer
from qtpy.QtWidgets import QDockWidget, QMainWindow, QWidget

from .canvas_geometry import find_window

LIST_NAME, ROW_NAME = "ISSIS sources", "ISSIS row trace"
BOTTOM = Qt.DockWidgetArea.BottomDockWidgetArea
# Heights in pixels on the screen: alone, and so much together that at 768 of them the canvas
# keeps the half.
ALONE = 150
TOGETHER = {ROW_NAME: 120, LIST_NAME: 150}


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

    def stack() -> None:
        # the window may have been closed meanwhile
        with suppress(RuntimeError):
            stack_at_bottom(window)

    if window is not None and name == LIST_NAME:
        # napari shows it a little later
        QTimer.singleShot(0, stack)


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
    if len(found) == 2 and not window.tabifiedDockWidgets(found[ROW_NAME]):
        # one that is being shown just now is not moved unless it is taken out first
        window.removeDockWidget(found[LIST_NAME])
        window.splitDockWidget(found[ROW_NAME], found[LIST_NAME], Qt.Orientation.Vertical)
        found[LIST_NAME].show()
    heights = [TOGETHER[name] if len(found) == 2 else ALONE for name in found]
    window.resizeDocks(list(found.values()), heights, Qt.Orientation.Vertical)


def _dock_of(widget: QWidget) -> QWidget:
    dock = widget
    while not isinstance(dock, QDockWidget):
        dock = dock.parentWidget()
    return dock

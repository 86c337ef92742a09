"""Our dock widgets beside the canvas: opened once, then shown and hidden."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from qtpy.QtCore import Qt, QTimer
from qtpy.QtWidgets import QDockWidget, QMainWindow, QWidget

from .canvas_geometry import find_window

DOCK_NAME, LIST_NAME, ROW_NAME = "ISSIS simulator", "ISSIS sources", "ISSIS row trace"
RIGHT, BOTTOM = Qt.DockWidgetArea.RightDockWidgetArea, Qt.DockWidgetArea.BottomDockWidgetArea
# Height of the window, pixels on the screen, from which list and row trace have room below the
# canvas together; and their heights, alone and together.
ROOMY = 900
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
            dock = find_dock(widget)
            assert dock is not None
            # a tab behind another one is no less visible for Qt
            in_sight = dock.isVisible() and not dock.visibleRegion().isEmpty()
            dock.setVisible(not in_sight)
            dock.raise_()
            return
    windows = [find_window(widget) for widget in viewer.window.dock_widgets.values()]
    # side by side for a moment, two panels may be wider than the screen
    low = any(window is not None and window.height() < ROOMY for window in windows)
    viewer.window.add_dock_widget(make(viewer), name=name, area=area, tabify=low)


def find_dock(widget: QWidget) -> QDockWidget | None:
    """Find the dock that holds a widget."""
    parent = widget
    while parent is not None and not isinstance(parent, QDockWidget):
        parent = parent.parentWidget()
    return parent


def widths_at_right(viewer: Any) -> dict[QDockWidget, int]:
    """Return the docks in sight at the right of a viewer's window, and their widths."""
    window = getattr(viewer, "window", None)  # a viewer model has none
    for widget in [] if window is None else window.dock_widgets.values():
        if (window := find_window(widget)) is not None:
            return {dock: dock.width() for dock in docks_at_right(window)}
    return {}


class FirstPlace:
    """Gives a widget's dock its place when it is shown first.

    Parameters
    ----------
    widget : QWidget
        The widget, not docked yet.
    viewer : napari.Viewer
        The viewer that will dock it.
    place : callable
        Moves the dock in its window.
    """

    def __init__(
        self, widget: QWidget, viewer: Any, place: Callable[[QMainWindow, QDockWidget], None]
    ) -> None:
        self._widget, self._place, self._taken = widget, place, False
        # before napari makes room for this one
        self._widths = widths_at_right(viewer)

    def take(self) -> QDockWidget | None:
        """Move the dock as soon as it has been shown; return it, the first time.

        Other docks get back the widths that they had before.
        """
        window, dock = find_window(self._widget), find_dock(self._widget)
        if window is None or dock is None or self._taken:
            return None
        self._taken = True

        def move() -> None:
            # the window may have been closed meanwhile
            with suppress(RuntimeError):
                if not dock.isFloating():
                    self._place(window, dock)
                    docks, widths = list(self._widths), list(self._widths.values())
                    window.resizeDocks(docks, widths, Qt.Orientation.Horizontal)

        QTimer.singleShot(0, move)
        return dock


def follow(pairs: Iterable[tuple[Any, Callable[..., Any]]], on: bool) -> None:
    """Connect slots to the emitters of napari events, or disconnect them."""
    for emitter, slot in pairs:
        if on:
            emitter.connect(slot)
        else:
            emitter.disconnect(slot)


def docks_at_right(window: QMainWindow) -> list[QDockWidget]:
    """Return the docks in sight at the right of a window."""
    return [
        dock
        for dock in window.findChildren(QDockWidget)
        if window.dockWidgetArea(dock) == RIGHT and dock.isVisible() and not dock.isFloating()
    ]


def share_place(window: QMainWindow, dock: QDockWidget) -> None:
    """Make a dock a tab of the simulator panel's place, if napari put it above or below that."""
    for panel in window.findChildren(QDockWidget):
        if (
            panel.windowTitle().startswith(DOCK_NAME)
            and panel is not dock
            and not panel.isHidden()
            and not panel.isFloating()
            and window.dockWidgetArea(panel) == window.dockWidgetArea(dock)
            and dock not in window.tabifiedDockWidgets(panel)
        ):
            window.tabifyDockWidget(panel, dock)
            dock.raise_()


def place_at_bottom(window: QMainWindow, dock: QDockWidget) -> None:
    """Move a dock from where napari puts new ones to below the canvas.

    List of sources and row trace are one below the other there, or tabs where the window is
    low. The trace has the axis of the canvas, and needs its width.
    """
    if window.dockWidgetArea(dock) == RIGHT:
        window.addDockWidget(BOTTOM, dock)
    if window.dockWidgetArea(dock) != BOTTOM:
        return
    found: dict[str, QDockWidget] = {}
    for other in window.findChildren(QDockWidget):
        for name in (ROW_NAME, LIST_NAME):
            here = window.dockWidgetArea(other) == BOTTOM and not other.isFloating()
            if here and not other.isHidden() and other.windowTitle().startswith(name):
                found[name] = other
    heights = list(found.values()), [ALONE] * len(found)
    if len(found) == 2 and not window.tabifiedDockWidgets(dock):
        row, listed = found[ROW_NAME], found[LIST_NAME]
        if window.height() < ROOMY:
            window.tabifyDockWidget(row, listed)
        else:
            # one that is being shown just now is not moved unless it is taken out first
            window.removeDockWidget(listed)
            window.splitDockWidget(row, listed, Qt.Orientation.Vertical)
            heights = [row, listed], [TOGETHER[ROW_NAME], TOGETHER[LIST_NAME]]
            listed.show()
    window.resizeDocks(*heights, Qt.Orientation.Vertical)
    dock.raise_()

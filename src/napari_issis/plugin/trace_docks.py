"""The dock widgets of the traces: a plot below the canvas, another to its right."""

from __future__ import annotations

from typing import Any, cast

from napari.utils.notifications import show_error, show_info
from qtpy.QtCore import Qt, QTimer
from qtpy.QtGui import QHideEvent, QShowEvent
from qtpy.QtWidgets import (
    QCheckBox,
    QDockWidget,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QMainWindow,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from .canvas_geometry import find_window
from .panels import RIGHT, ROW_NAME, docks_at_right, find_dock, place_at_bottom
from .scene import open_scene
from .trace_plot import TracePlot
from .traces import Along, Trace, traces_of

FREEZE_KEY = "Shift-F"
# Pixels on the screen.
COLUMN_WIDTH = 150


class TraceWidget(QWidget):  # type: ignore[misc]
    """A trace plot with its title, the freeze box and a button to save.

    Parameters
    ----------
    napari_viewer : napari.Viewer
        The viewer; its live scene is made if there is none.
    """

    along: Along = "row"

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.traces = traces_of(open_scene(viewer=napari_viewer, dock=False))
        self.plot = TracePlot(self.traces, self.along)
        self.title = QLabel()
        self.title.setTextFormat(Qt.TextFormat.RichText)
        self.title.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.frozen = QCheckBox("Freeze")
        self.frozen.setToolTip(
            f"Keep row and column where they are; they follow the picture all the same "
            f"({FREEZE_KEY.replace('-', '+')} with an ISSIS layer active)"
        )
        self.save = QPushButton("Save…")
        self.save.setToolTip(f"Save position, counts and expected counts of this {self.along}")
        self.frozen.toggled.connect(self._freeze)
        self.save.clicked.connect(self.save_trace)
        self._placed = self._following = False
        self._arrange()

    def _arrange(self) -> None:
        raise NotImplementedError

    def _text(self, trace: Trace) -> list[str]:
        """Title of the plot, in parts."""
        colors = self.plot.colors
        count, expected = trace.counts[trace.position], trace.expected[trace.position]
        digits = ".0f" if expected >= 1000 else ".4g"
        place, across = ("Row y", "x") if self.along == "row" else ("Column x", "y")
        return [
            f"<b>{place} = {trace.index}</b>",
            f"{across} = {trace.position}",
            f'<span style="color:{colors.counts.name()}">C = {count}</span>',
            f'<span style="color:{colors.expected.name()}">expected {expected:{digits}}</span>',
        ]

    def show_title(self, event: Any = None) -> None:
        """Say what is traced, and what the pixel under the pointer holds."""
        trace = self.traces.trace(self.along)
        if trace is not None:
            self.title.setText(self._joined(self._text(trace)))

    def _joined(self, parts: list[str]) -> str:
        raise NotImplementedError

    def show_frozen(self, event: Any = None) -> None:
        """Show whether the traces are frozen."""
        self.frozen.setChecked(self.traces.frozen)

    def _freeze(self, frozen: bool) -> None:
        self.traces.frozen = frozen

    def save_trace(self, event: Any = None) -> None:
        """Ask for a file and save the trace in it; errors are shown."""
        path = self.ask_path()
        if path is None:
            return
        target = path if path.lower().endswith(".ecsv") else f"{path}.ecsv"
        try:
            # The dialog has asked before choosing a file that exists, by the name typed.
            self.traces.save(self.along, target, overwrite=target == path)
        except (OSError, ValueError) as error:
            show_error(str(error))
        else:
            show_info(f"Saved {target}")

    def ask_path(self) -> str | None:
        """Ask for the file to write; None if the user changed his mind."""
        trace = self.traces.trace(self.along)
        name = f"{self.along}{0 if trace is None else trace.index}.ecsv"
        dialog = QFileDialog(self, f"Save {self.along}", name, "ECSV table (*.ecsv)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("ecsv")
        return dialog.selectedFiles()[0] if dialog.exec() else None

    # ---------------------------------------------------------------- only while in sight

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the traces; take a place beside the canvas when shown first."""
        if not self._following:
            self._following = True
            self.traces.events.changed.connect(self.show_title)
            self.traces.scene.viewer.events.theme.connect(self.show_title)
            self.traces.events.frozen.connect(self.show_frozen)
            self.show_title()
            self.show_frozen()
        super().showEvent(event)
        if not self._placed:
            # Docks cannot be moved while they are being shown.
            QTimer.singleShot(0, self.place)

    def hideEvent(self, event: QHideEvent) -> None:
        """Cost nothing while hidden."""
        if self._following:
            self._following = False
            self.traces.events.changed.disconnect(self.show_title)
            self.traces.scene.viewer.events.theme.disconnect(self.show_title)
            self.traces.events.frozen.disconnect(self.show_frozen)
        super().hideEvent(event)

    def place(self) -> None:
        """Move from where napari docks new widgets to the side of the canvas."""
        window, dock = find_window(self), find_dock(self)
        if window is None or dock is None or self._placed:
            return
        self._placed = True
        if not dock.isFloating():
            self._dock_beside_canvas(window, dock)

    def _dock_beside_canvas(self, window: QMainWindow, dock: QDockWidget) -> None:
        raise NotImplementedError


class RowTrace(TraceWidget):
    """The row through the pointer, below the canvas."""

    along: Along = "row"
    # The corner of the window that the plot cedes to the docks at the right while it is shown.
    _corner: Any = None

    def _arrange(self) -> None:
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        line = QHBoxLayout()
        line.setContentsMargins(6, 0, 6, 0)
        line.addWidget(self.title, 1)
        line.addWidget(self.frozen)
        line.addWidget(self.save)
        layout.addLayout(line)
        layout.addWidget(self.plot, 1)

    def _joined(self, parts: list[str]) -> str:
        return "&nbsp;&nbsp; ".join(parts)

    def _dock_beside_canvas(self, window: QMainWindow, dock: QDockWidget) -> None:
        place_at_bottom(window, dock)

    def showEvent(self, event: QShowEvent) -> None:
        """Leave the docks at the right their height."""
        super().showEvent(event)
        window = find_window(self)
        if window is not None and self._corner is None:
            self._corner = window.corner(Qt.Corner.BottomRightCorner)
            window.setCorner(Qt.Corner.BottomRightCorner, RIGHT)

    def hideEvent(self, event: QHideEvent) -> None:
        """Give the corner back."""
        super().hideEvent(event)
        window = find_window(self)
        if window is not None and self._corner is not None:
            window.setCorner(Qt.Corner.BottomRightCorner, self._corner)
        self._corner = None


class ColumnTrace(TraceWidget):
    """The column through the pointer, to the right of the canvas."""

    along: Along = "column"

    def _arrange(self) -> None:
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 4)
        layout.setSpacing(2)
        layout.addWidget(self.plot, 1)
        for widget in (self.title, self.frozen, self.save):
            line = QHBoxLayout()
            line.setContentsMargins(6, 0, 6, 0)
            line.addWidget(widget)
            layout.addLayout(line)

    def _joined(self, parts: list[str]) -> str:
        return "<br>".join(parts)

    def _dock_beside_canvas(self, window: QMainWindow, dock: QDockWidget) -> None:
        if window.dockWidgetArea(dock) != RIGHT:
            return
        others = [other for other in docks_at_right(window) if other is not dock]
        others.sort(key=lambda other: other.y())
        widths = [other.width() for other in others[:1]]
        tabs = {other: window.tabifiedDockWidgets(other) for other in others}
        for number, other in enumerate(others):
            above = others[number - 1]
            if number == 0:
                window.splitDockWidget(dock, other, Qt.Orientation.Horizontal)
            elif other in tabs[above]:
                window.tabifyDockWidget(above, other)
            else:
                window.splitDockWidget(above, other, Qt.Orientation.Vertical)
        window.resizeDocks([dock, *others[:1]], [COLUMN_WIDTH, *widths], Qt.Orientation.Horizontal)


ROW_DOCK, COLUMN_DOCK = ROW_NAME, "ISSIS column trace"
_WIDGETS: dict[str, type[TraceWidget]] = {ROW_DOCK: RowTrace, COLUMN_DOCK: ColumnTrace}


def trace_widgets(viewer: Any) -> list[TraceWidget]:
    """Return the trace widgets that a viewer's window has, hidden ones too."""
    docked = viewer.window.dock_widgets
    return [docked[name] for name in docked if isinstance(docked[name], TraceWidget)]


def traces_shown(viewer: Any) -> bool:
    """Whether a viewer's window has a trace dock that is not hidden."""
    docks = [find_dock(widget) for widget in trace_widgets(viewer)]
    return any(dock is not None and not dock.isHidden() for dock in docks)


def show_traces(viewer: Any, visible: bool = True) -> None:
    """Show both traces beside the canvas, docked if they are not yet, or hide them.

    Parameters
    ----------
    viewer : napari.Viewer
        The viewer.
    visible : bool
        Whether they are shown.
    """
    widgets = trace_widgets(viewer)
    if visible:
        there = {type(widget): widget for widget in widgets}
        for name, kind in _WIDGETS.items():
            widget = there.get(kind) or _dock(viewer, name, kind)
            dock = cast(QDockWidget, find_dock(widget))
            dock.show()
            widget.place()
            dock.raise_()
        return
    docks = [cast(QDockWidget, find_dock(widget)) for widget in widgets]
    windows = {find_window(widget) for widget in widgets}
    others = [dock for w in windows if w for dock in docks_at_right(w) if dock not in docks]
    widths = [other.width() for other in others]
    for dock in docks:
        dock.hide()
    # The room goes back to the canvas, not to the panels beside the column.
    for window in windows:
        if window is not None and others:
            window.resizeDocks(others, widths, Qt.Orientation.Horizontal)


def _dock(viewer: Any, name: str, kind: type[TraceWidget]) -> TraceWidget:
    try:
        _, widget = viewer.window.add_plugin_dock_widget("napari-issis", name)
    except (KeyError, ValueError):
        # The plugin is switched off in napari's plugin manager.
        widget = kind(viewer)
        area = "bottom" if kind is RowTrace else "right"
        viewer.window.add_dock_widget(widget, name=name, area=area, add_vertical_stretch=False)
    return cast(TraceWidget, widget)

"""The dock widget: instrument, sources, save."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import PushButton
from napari.utils.notifications import show_error, show_info
from qtpy.QtCore import Qt
from qtpy.QtGui import QHideEvent, QKeySequence, QShortcut, QShowEvent
from qtpy.QtWidgets import (
    QFileDialog,
    QFrame,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from .crash_guard import CrashGuard
from .display_form import DisplayForm
from .instrument_form import InstrumentForm
from .keys import show_keys
from .missing_layers import MissingLayers
from .panels import DOCK_NAME, LIST_NAME, toggle_panel
from .png_menu import PngMenu
from .progress_row import ProgressRow
from .push_button import push_button
from .scene import open_scene
from .sheet_dialog import SheetDialog
from .source_form import SourceForm
from .source_list import SourceList
from .view_form import ViewForm
from .writer import fits_path

# The file types that the dialog offers, and what is written.
FITS_FORMS: dict[str, dict[str, Any]] = {
    "Whole exposure": {},
    "Whole exposure, compressed": {"compress": True},
    "Counts alone": {"whole": False},
    "Counts alone, as floats": {"whole": False, "dtype": "float64"},
    "Count rate alone": {"image": "rate", "whole": False},
    "Expected counts alone": {"image": "expected", "whole": False},
    "SNR alone": {"image": "snr", "whole": False},
}


class SimulatorWidget(QWidget):  # type: ignore[misc]
    """Controls of the live scene; makes one in its viewer if there is none.

    Parameters
    ----------
    napari_viewer : napari.Viewer
        The viewer.
    """

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.scene = open_scene(viewer=napari_viewer, dock=False)
        self.instrument = InstrumentForm(self.scene)
        self.sources = SourceForm(self.scene)
        self.display = DisplayForm(self.scene)
        self.view = ViewForm(self.scene)
        self.save = PushButton(
            text="Sav&e FITS…", tooltip="Save the exposure as a FITS file: whole, or one image"
        )
        self.save.changed.connect(self.save_fits)
        self.sheet = push_button(
            "Sheet…",
            "Write a proposal sheet: both channels, forecasts, commands",
            self.ask_sheet,
        )
        self._sheet_dialog: SheetDialog | None = None
        self.form = next(iter(FITS_FORMS))
        tools = QHBoxLayout()
        tools.setContentsMargins(4, 0, 4, 0)
        # what they would do is told by `show_steps`
        self.undo = push_button("Undo", "", self.scene.undo)
        self.redo = push_button("Redo", "", self.scene.redo)
        self.list = push_button("S&ources", "Show or hide the list of sources", self.toggle_list)
        self.png = QPushButton("PNG")
        self.png.setToolTip("Save the final image, the source model or RGBA data as a picture")
        self.png.setMenu(PngMenu(self.scene, self))
        self.keys = push_button("Ke&ys", "List the keys", lambda: show_keys(self))
        for button in (self.undo, self.redo, self.list, self.png, self.keys):
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            tools.addWidget(button, 3 if button is self.list else 2)
        for keys, action in (
            (QKeySequence.StandardKey.Undo, self.scene.undo),
            (QKeySequence.StandardKey.Redo, self.scene.redo),
        ):
            shortcut = QShortcut(QKeySequence(keys), self)
            shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            shortcut.activated.connect(action)
        self._following = False

        self.pages = QTabWidget()
        self.pages.addTab(_page(self.instrument, self.sources), "Scene")
        self.pages.addTab(_page(self.display, self.view), "View")
        self.pages.setTabToolTip(0, "Instrument, and sources to add")
        self.pages.setTabToolTip(1, "Brightness, frames, zoom, traces")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 4)
        self.guard = CrashGuard(self.scene)
        layout.addWidget(self.guard)
        self.missing = MissingLayers(self.scene)
        layout.addWidget(self.missing)
        layout.addWidget(self.pages)
        self.progress = ProgressRow(self.scene)
        layout.addWidget(self.progress)
        buttons = QHBoxLayout()
        buttons.setContentsMargins(4, 0, 4, 0)
        buttons.addWidget(self.sources.button.native)
        buttons.addWidget(self.save.native)
        buttons.addWidget(self.sheet)
        layout.addLayout(buttons)
        layout.addLayout(tools)
        self.setMinimumWidth(330)

    def save_fits(self, event: Any = None) -> None:
        """Ask for a file and save the exposure in it; errors are shown."""
        self.instrument.apply_typed()
        path = self.ask_path()
        if path is None:
            return
        target = fits_path(path)
        try:
            # The dialog has asked before choosing a file that exists, by the name typed.
            self.scene.exposure.write(target, overwrite=target == path, **FITS_FORMS[self.form])
        except (OSError, ValueError, RuntimeError) as error:
            show_error(str(error))
        else:
            show_info(f"Saved {target}")

    def ask_sheet(self) -> None:
        """Open the dialog of the proposal sheet."""
        self.instrument.apply_typed()
        if self._sheet_dialog is None:
            self._sheet_dialog = SheetDialog(self.scene, self)
        self._sheet_dialog.open_for_selection()

    def toggle_list(self) -> None:
        """Show or hide the list of sources."""
        toggle_panel(self.scene.viewer, LIST_NAME, SourceList, "bottom")

    def show_steps(self, event: Any = None) -> None:
        """Say on the buttons what would be undone and done again."""
        history = self.scene.editor.history
        for button, what, step, keys in (
            (self.undo, "Undo", history.last_step, "Ctrl+Z"),
            (self.redo, "Redo", history.next_step, "Ctrl+Shift+Z"),
        ):
            button.setEnabled(bool(step))
            button.setToolTip(f"{what}: {step} ({keys})" if step else f"Nothing to {what.lower()}")

    def ask_path(self) -> str | None:
        """Ask for the file to write; None if the user changed his mind."""
        dialog = QFileDialog(self, "Save exposure", "issis.fits")
        dialog.setNameFilters([f"{form} (*.fits)" for form in FITS_FORMS])
        dialog.selectNameFilter(f"{self.form} (*.fits)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("fits")
        if not dialog.exec():
            return None
        self.form = dialog.selectedNameFilter().removesuffix(" (*.fits)")
        return str(dialog.selectedFiles()[0])

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the scene while visible (napari gives docked widgets no close event)."""
        if not self._following:
            self._following = True
            self.instrument.resume()
            self.sources.resume()
            self.scene.events.picture.connect(self.show_steps)
            self.show_steps()
            self.display.resume()
            self.view.resume()
            self.progress.resume()
            self.missing.resume()
        super().showEvent(event)

    def hideEvent(self, event: QHideEvent) -> None:
        """Cost nothing while hidden."""
        if self._following:
            self._following = False
            self.instrument.pause()
            self.sources.pause()
            self.scene.events.picture.disconnect(self.show_steps)
            self.display.pause()
            self.view.pause()
            self.progress.pause()
            self.missing.pause()
        super().hideEvent(event)


def _page(*forms: QWidget) -> QScrollArea:
    page = QWidget()
    column = QVBoxLayout(page)
    column.setContentsMargins(4, 2, 4, 2)
    column.setSpacing(4)
    for form in forms:
        column.addWidget(form)
    column.addStretch(1)
    scroll = QScrollArea()
    scroll.setWidgetResizable(True)
    scroll.setFrameShape(QFrame.Shape.NoFrame)
    scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    scroll.setWidget(page)
    return scroll


def dock_simulator(viewer: Any) -> None:
    """Dock the widget at the right of the viewer, unless it is there already."""
    if DOCK_NAME in " ".join(viewer.window.dock_widgets):
        return
    try:
        viewer.window.add_plugin_dock_widget("napari-issis", DOCK_NAME)
    except (KeyError, ValueError):
        # The plugin is switched off in napari's plugin manager.
        viewer.window.add_dock_widget(SimulatorWidget(viewer), name=DOCK_NAME, area="right")

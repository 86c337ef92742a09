"""The list of sources: sortable, editable, in step with the layers."""

from __future__ import annotations

from typing import Any

import numpy as np
from napari.utils.notifications import show_error, show_info
from qtpy.QtCore import (
    QItemSelection,
    QItemSelectionModel,
    QModelIndex,
    Qt,
)
from qtpy.QtGui import QHideEvent, QKeySequence, QShortcut, QShowEvent
from qtpy.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QCheckBox,
    QFileDialog,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QTableView,
    QToolTip,
    QVBoxLayout,
    QWidget,
)
from superqt.utils import qthrottled

from ..catalogue import READABLE, SUFFIXES, read_catalogue, write_sources
from .cell_editors import CellEditors
from .list_forecast import ListForecast, with_forecast
from .panels import FirstPlace, follow, place_at_bottom
from .photometry_dialog import PhotometryDialog
from .push_button import push_button
from .reader import tell_notes
from .scene import open_scene
from .source_columns import COLUMNS, from_text, to_text
from .source_model import ALL_COLUMNS, SourceModel

# Milliseconds between two updates during a drag.
REST = 100
# Characters that the columns are wide enough for.
WIDTHS = {"kind": 20, "flux": 18, "counts": 11, "spectrum": 30, "position_error_mas": 12}
PLACES = {column.name: place for place, column in enumerate(ALL_COLUMNS)}
TABLES = f"Source tables ({' '.join('*' + suffix for suffix in SUFFIXES)})"
CATALOGUES = f"Catalogues ({' '.join('*' + suffix for suffix in READABLE)})"


class SourceList(QWidget):  # type: ignore[misc]
    """The sources of the live scene as a table.

    Parameters
    ----------
    napari_viewer : napari.Viewer
        The viewer; it gets a scene if it has none.
    """

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.scene = open_scene(viewer=napari_viewer, dock=False)
        self.forecast = ListForecast(self.scene)
        self.model = SourceModel(self.scene, self.forecast)
        self.view = QTableView()
        self.view.setModel(self.model)
        self.view.setToolTip(
            "The sources: click a heading to sort, double click a cell (or F2) to edit it"
        )
        self.view.setItemDelegate(CellEditors(self.view))
        self.view.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.view.setSortingEnabled(True)
        self.view.setWordWrap(False)
        # Tab goes on to the buttons; the arrows go from cell to cell
        self.view.setTabKeyNavigation(False)
        across, down = self.view.horizontalHeader(), self.view.verticalHeader()
        across.setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        across.setSortIndicatorClearable(True)
        # of the list's own selection, the headings would ask Qt's flags of every cell
        across.setSelectionModel(QItemSelectionModel(self.model, across))
        down.setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        down.setDefaultSectionSize(self.fontMetrics().height() + 6)
        down.setToolTip("Number of the source, from 0")
        character = self.fontMetrics().averageCharWidth()
        for section, column in enumerate(ALL_COLUMNS):
            self.view.setColumnHidden(section, section >= len(COLUMNS))
            self.view.setColumnWidth(section, (WIDTHS.get(column.name, 9)) * character + 14)
        # beside the other numbers
        across.moveSection(PLACES["spectrum"], len(ALL_COLUMNS) - 1)
        self.count = QLabel()
        self.forecast_box = QCheckBox("Forecast")
        self.forecast_box.setToolTip(
            "Show what can be measured of each source in the crowd, all fitted together"
        )
        self.forecast_box.toggled.connect(self._forecast_toggled)
        self.forecast.changed.connect(self.model.show_forecast)
        row = QHBoxLayout()
        row.addWidget(self.count)
        row.addWidget(self.forecast_box)
        row.addStretch(1)
        for label, tooltip, action in (
            ("Undo", "Take back the last edit (Ctrl+Z)", self.scene.undo),
            ("Redo", "Do it again (Ctrl+Shift+Z)", self.scene.redo),
            ("Copy", "Copy the selected rows as text (Ctrl+C)", self.copy),
            ("Paste", "Add sources from text, as of a spreadsheet (Ctrl+V)", self.paste),
            ("Delete", "Remove the selected sources (Del)", self.delete),
            ("&Import…", "Add a catalogue: ECSV, CSV, FITS, VOTable, DS9", self.load),
            ("Expor&t…", "Write the sources to a file: ECSV, CSV, FITS, VOTable", self.save),
            ("Photometry…", "Measure sources in apertures, beside the truth", self.photometry),
        ):
            row.addWidget(push_button(label, tooltip, action))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 2, 4, 4)
        layout.addWidget(self.view)
        layout.addLayout(row)
        for keys, action in (
            (QKeySequence.StandardKey.Undo, self.scene.undo),
            (QKeySequence.StandardKey.Redo, self.scene.redo),
            (QKeySequence.StandardKey.Copy, self.copy),
            (QKeySequence.StandardKey.Paste, self.paste),
            (QKeySequence.StandardKey.Delete, self.delete),
        ):
            shortcut = QShortcut(QKeySequence(keys), self)
            shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
            shortcut.activated.connect(action)
        self.view.selectionModel().selectionChanged.connect(self._rows_selected)
        self.model.refused.connect(self._tell_refused)
        self._photometry: PhotometryDialog | None = None
        self._following = self._selecting = False
        self._place = FirstPlace(self, napari_viewer, place_at_bottom)
        self._soon = qthrottled(self.refresh, timeout=REST)

    # ---------------------------------------------------------------- list and layers

    def refresh(self) -> None:
        """Show the sources and the selection as they are now."""
        if not self._following:
            return
        self.model.refresh()
        self.view.setColumnHidden(PLACES["image"], not np.any(self.model.values["image"] != ""))
        self.forecast.follow()
        self._show_selection()

    def _sources_changed(self, event: Any = None) -> None:
        self._soon()

    def _show_selection(self, event: Any = None) -> None:
        """Select in the list what is selected in the layers."""
        if self._selecting or self.model._seen is None:
            return
        rows = self.model.rows_of(self.scene.editor.selected_ids)
        self.count.setText(_count(len(self.model.source_id), rows.size))
        chosen = QItemSelection()
        last = len(ALL_COLUMNS) - 1
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            if run.size:
                first, end = self.model.index(int(run[0]), 0), self.model.index(int(run[-1]), last)
                chosen.select(first, end)
        self._selecting = True
        try:
            flags = QItemSelectionModel.SelectionFlag.ClearAndSelect
            self.view.selectionModel().select(chosen, flags)
        finally:
            self._selecting = False
        if rows.size == 1 and not self.view.hasFocus():
            self.view.scrollTo(self.model.index(int(rows[0]), 0))

    def _rows_selected(self, *_: Any) -> None:
        """Select in the layers what is selected in the list."""
        if self._selecting:
            return
        self._selecting = True
        try:
            ids = self.selected_ids()
            self.scene.editor.select(ids)
            self.count.setText(_count(len(self.model.source_id), len(ids)))
        finally:
            self._selecting = False

    def selected_ids(self) -> list[int]:
        """Ids of the selected rows, from the top down."""
        ranges = self.view.selectionModel().selection()
        rows = sorted({row for one in ranges for row in range(one.top(), one.bottom() + 1)})
        return self.model.ids_of(rows)

    def _tell_refused(self, index: QModelIndex, reason: str) -> None:
        place = self.view.visualRect(index).bottomLeft()
        QToolTip.showText(self.view.viewport().mapToGlobal(place), reason, self.view)
        show_error(reason)

    # ---------------------------------------------------------------- copy, paste, files

    def copy(self) -> None:
        """Put the selected rows on the clipboard as tab-separated text with all digits."""
        rows = self.model.order[self.model.rows_of(self.selected_ids())]
        if rows.size:
            columns = ALL_COLUMNS if self._has_forecast() else COLUMNS
            text = to_text(self.model.values, rows, self.scene.units, columns)
            QApplication.clipboard().setText(text)

    def paste(self) -> None:
        """Add the sources that the clipboard holds as text."""
        try:
            table = from_text(
                QApplication.clipboard().text(), self.scene.observation, self.scene.units
            )
        except ValueError as error:
            show_error(f"Nothing was pasted: {error}")
            return
        self.scene.add(table)
        self._select_last(len(table))

    def delete(self) -> None:
        """Remove the selected sources."""
        self.scene.remove(self.selected_ids())

    def load(self) -> None:
        """Ask for a file and add its sources; an error changes nothing."""
        path, _ = QFileDialog.getOpenFileName(self, "Add sources of a file", "", CATALOGUES)
        if not path:
            return
        try:
            catalogue = read_catalogue(path, self.scene.observation)
            self.scene.add(catalogue.sources)
        except (OSError, ValueError) as error:
            show_error(str(error))
            return
        self._select_last(len(catalogue.sources))
        tell_notes(path, len(catalogue.sources), catalogue.notes)

    def save(self) -> None:
        """Ask for a file and write the sources to it; an error is shown."""
        dialog = QFileDialog(self, "Write the sources", "sources.ecsv", TABLES)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("ecsv")
        if not dialog.exec():
            return
        path = dialog.selectedFiles()[0]
        try:
            forecast = self._has_forecast()
            table = with_forecast(self.scene.sources, self.model.values if forecast else None)
            # The dialog has asked before it chose a file that exists.
            write_sources(table, path, overwrite=True)
        except (OSError, ValueError) as error:
            show_error(str(error))
        else:
            without = self.forecast.on and not forecast
            show_info(f"Saved {path}{', without the forecast still in the making' * without}")

    def _forecast_toggled(self, on: bool) -> None:
        self.forecast.on = on
        for section in range(len(COLUMNS), len(ALL_COLUMNS)):
            self.view.setColumnHidden(section, not on)
        if on:
            self.forecast.follow()
        else:
            self.forecast.pause()
        self.model.show_forecast()

    def _has_forecast(self) -> bool:
        """Whether there is a forecast of the sources as they are now."""
        self.refresh()
        return self.forecast.on and not self.forecast.pending

    def photometry(self) -> None:
        """Open the dialog of aperture photometry."""
        if self._photometry is None:
            self._photometry = PhotometryDialog(self.scene, self)
        self._photometry.show()
        self._photometry.raise_()

    def _select_last(self, count: int) -> None:
        self.scene.editor.select(self.scene.editor.source_id[-count:].tolist())

    # ---------------------------------------------------------------- shown and hidden

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the scene while visible (napari gives docked widgets no close event)."""
        self._follow(True)
        super().showEvent(event)
        if (dock := self._place.take()) is not None:
            # a tab behind another one gets no event
            dock.visibilityChanged.connect(self._follow)

    def hideEvent(self, event: QHideEvent) -> None:
        """Cost nothing while hidden."""
        self._follow(False)
        super().hideEvent(event)

    def _follow(self, on: bool) -> None:
        if on == self._following:
            return
        self._following = on
        events = self.scene.events
        pairs = (
            (events.sources, self._sources_changed),
            (events.observation, self._sources_changed),
            (events.picture, self._sources_changed),
            (events.selection, self._show_selection),
            (self.scene.units.events.changed, self._sources_changed),
        )
        follow(pairs, on)
        if on:
            self.refresh()
        else:
            self.forecast.pause()


def _count(sources: int, selected: int) -> str:
    text = f"{sources} source" if sources == 1 else f"{sources} sources"
    return f"{text}, {selected} selected" if selected else text

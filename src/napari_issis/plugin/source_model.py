"""The source table as a Qt model: sorted, in the chosen units, editable."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from qtpy.QtCore import QAbstractTableModel, QModelIndex, Qt, Signal
from qtpy.QtGui import QColor

from .layer_styles import kind_color
from .list_forecast import FORECAST_COLUMNS, ListForecast
from .scene import Scene
from .source_columns import COLUMNS, TEXTS, changed, exact_text, heading, shown_values, text

SELECTABLE = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
EDITABLE = SELECTABLE | Qt.ItemFlag.ItemIsEditable
ALL_COLUMNS = COLUMNS + FORECAST_COLUMNS
STALE = QColor(128, 128, 128)
Rows = NDArray[np.intp]
Role = Qt.ItemDataRole


class SourceModel(QAbstractTableModel):  # type: ignore[misc]
    """Rows are sources, in the order chosen by the headings.

    Parameters
    ----------
    scene : Scene
        The live scene.
    forecast : ListForecast
        What its last columns show.
    """

    refused = Signal(QModelIndex, str)

    def __init__(self, scene: Scene, forecast: ListForecast) -> None:
        super().__init__()
        self.scene, self.forecast = scene, forecast
        self.values: dict[str, Any] = {}
        self.source_id = np.empty(0, dtype=np.int64)
        self.order: Rows = np.empty(0, dtype=np.intp)
        self._sorted_by: tuple[int, bool] | None = None
        self._seen: object = None
        self.refresh()

    def refresh(self, event: Any = None) -> None:
        """Show the scene's sources as they are now."""
        scene = self.scene
        state = (scene.editor.version, scene.observation, scene.units.flux, scene.units.length)
        if state == self._seen:
            return
        self._seen = state
        ids = scene.editor.source_id
        same_rows = np.array_equal(ids, self.source_id)
        if not same_rows:
            self.beginResetModel()
        self.source_id = ids
        self.values = shown_values(scene.editor.sources, scene.observation, scene.units)
        self.values |= self.forecast.values(ids)
        if not same_rows:
            self._arrange()
            self.endResetModel()
        elif ids.size:
            if scene.editor.held is None:
                self._rearrange()
            corner = self.index(ids.size - 1, len(ALL_COLUMNS) - 1)
            self.dataChanged.emit(self.index(0, 0), corner)
        self.headerDataChanged.emit(Qt.Orientation.Horizontal, 0, len(ALL_COLUMNS) - 1)

    def show_forecast(self) -> None:
        """Show the forecast as it is now, or as what is to be replaced."""
        if not self.source_id.size:
            return
        self.values |= self.forecast.values(self.source_id)
        if self._sorted_by is not None and self._sorted_by[0] >= len(COLUMNS):
            self._rearrange()
        first, corner = len(COLUMNS), (self.source_id.size - 1, len(ALL_COLUMNS) - 1)
        self.dataChanged.emit(self.index(0, first), self.index(*corner))

    def rows_of(self, ids: Iterable[int]) -> Rows:
        """Rows of the list, sorted, with these ids."""
        return np.flatnonzero(np.isin(self.source_id[self.order], list(ids)))

    def ids_of(self, rows: Iterable[int]) -> list[int]:
        """Ids of rows of the list."""
        chosen: list[int] = self.source_id[self.order[list(rows)]].tolist()
        return chosen

    def sort(self, column: int, order: Qt.SortOrder = Qt.SortOrder.AscendingOrder) -> None:
        """Sort by a column; by -1, as in the source table."""
        descending = order == Qt.SortOrder.DescendingOrder
        self._sorted_by = (column, descending) if column >= 0 else None
        self._rearrange()

    def _rearrange(self) -> None:
        before = self.order
        self.layoutAboutToBeChanged.emit()
        self._arrange()
        place = np.empty(before.size, dtype=np.intp)
        place[self.order] = np.arange(before.size)
        old = self.persistentIndexList()
        new = [self.index(int(place[before[i.row()]]), i.column()) for i in old]
        self.changePersistentIndexList(old, new)
        self.layoutChanged.emit()

    def _arrange(self) -> None:
        self.order = np.arange(self.source_id.size)
        if self._sorted_by is None:
            return
        column, descending = self._sorted_by
        values = self.values[ALL_COLUMNS[column].name]
        # NaN, that is no value, comes last in either order
        if values.dtype.kind == "f":
            values = -values if descending else values
            self.order = np.argsort(values, kind="stable")
        else:
            order = np.argsort(values, kind="stable")
            self.order = order[::-1] if descending else order

    # ---------------------------------------------------------------- what Qt asks

    def rowCount(self, parent: QModelIndex | None = None) -> int:
        """Return the number of sources."""
        return 0 if parent is not None and parent.isValid() else int(self.order.size)

    def columnCount(self, parent: QModelIndex | None = None) -> int:
        """Return the number of columns."""
        return 0 if parent is not None and parent.isValid() else len(ALL_COLUMNS)

    def data(self, index: QModelIndex, role: int = Role.DisplayRole) -> Any:
        """Return what a cell shows."""
        column = ALL_COLUMNS[index.column()]
        value = self.values[column.name][self.order[index.row()]]
        stale = index.column() >= len(COLUMNS) and self.forecast.pending
        if role == Role.DisplayRole:
            if not stale:
                return text(column, value)
            return "…" if np.isnan(value) else f"{text(column, value)} …"
        if role == Role.EditRole:
            return exact_text(column, value)
        if role == Role.ForegroundRole and stale:
            return STALE
        if role == Role.TextAlignmentRole and column.name not in TEXTS:
            return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        if role == Role.DecorationRole and column.name == "kind":
            return QColor(kind_color(str(value)))
        return None

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Role.DisplayRole
    ) -> Any:
        """Return a heading, or the number of a row as errors name it."""
        if orientation == Qt.Orientation.Horizontal:
            if role == Role.DisplayRole:
                return heading(ALL_COLUMNS[section], self.scene.units)
            if role == Role.ToolTipRole:
                return ALL_COLUMNS[section].tooltip
        elif role == Role.DisplayRole and section < self.order.size:
            return int(self.order[section])
        return None

    def flags(self, index: QModelIndex) -> Qt.ItemFlag:
        """Return whether a cell can be selected and edited."""
        column = ALL_COLUMNS[index.column()]
        kind = str(self.values["kind"][self.order[index.row()]])
        return EDITABLE if column.editable and column.applies(kind) else SELECTABLE

    def setData(self, index: QModelIndex, typed: Any, role: int = Role.EditRole) -> bool:
        """Take over what was typed into a cell; ``refused`` tells why it was not."""
        if role != Role.EditRole or typed == self.data(index, Role.EditRole):
            return False
        scene, column = self.scene, ALL_COLUMNS[index.column()]
        (source_id,) = self.ids_of([index.row()])
        table = scene.sources
        row = scene.editor.row_of(source_id)
        if row is None:
            return False
        try:
            table = changed(table, row, column.name, typed, scene.observation, scene.units)
        except ValueError as error:
            self.refused.emit(QModelIndex(index), str(error))
            return False
        scene.change(table)
        return True

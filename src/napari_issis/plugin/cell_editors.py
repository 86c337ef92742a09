"""What a cell of the list of sources is edited with."""

from __future__ import annotations

from qtpy.QtCore import QAbstractItemModel, QModelIndex, Qt
from qtpy.QtWidgets import QComboBox, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from ..sources import KINDS
from .source_model import ALL_COLUMNS


class CellEditors(QStyledItemDelegate):  # type: ignore[misc]
    """Edits kinds with a list of choices, the rest as text."""

    def createEditor(
        self, parent: QWidget, option: QStyleOptionViewItem, index: QModelIndex
    ) -> QWidget:
        """Make a list of the kinds, or a field."""
        if ALL_COLUMNS[index.column()].name != "kind":
            return super().createEditor(parent, option, index)
        box = QComboBox(parent)
        box.addItems(KINDS)
        return box

    def setEditorData(self, editor: QWidget, index: QModelIndex) -> None:
        """Show what the cell holds."""
        if isinstance(editor, QComboBox):
            editor.setCurrentText(index.data(Qt.ItemDataRole.EditRole))
        else:
            super().setEditorData(editor, index)

    def setModelData(self, editor: QWidget, model: QAbstractItemModel, index: QModelIndex) -> None:
        """Take over what was chosen or typed."""
        if isinstance(editor, QComboBox):
            model.setData(index, editor.currentText())
        else:
            super().setModelData(editor, model, index)

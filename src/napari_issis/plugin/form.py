"""Rows of labelled magicgui widgets that fit a narrow dock."""

from __future__ import annotations

from typing import Any, Protocol

from qtpy.QtCore import QEvent, QObject, Qt
from qtpy.QtGui import QResizeEvent
from qtpy.QtWidgets import (
    QComboBox,
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QWidget,
)


class Field(Protocol):
    """What a row holds: a magicgui widget, or what looks like one."""

    @property
    def native(self) -> Any:
        """The Qt widget."""

    @property
    def tooltip(self) -> str | None:
        """What it is for."""


class WrappedText(QLabel):  # type: ignore[misc]
    """Text that wraps and is given the height that it needs.

    After a change of texts Qt's form layout divides the height among such rows as it was before.
    """

    def __init__(self) -> None:
        super().__init__()
        self.setWordWrap(True)
        self.setMinimumWidth(10)

    def setText(self, text: str | None) -> None:
        """Show a text."""
        super().setText(text)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Follow the width."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        self.setMinimumHeight(max(self.heightForWidth(self.width()), 0))


class Form(QGroupBox):  # type: ignore[misc]
    """A titled group of rows, each a label with one widget or two."""

    def __init__(self, title: str) -> None:
        super().__init__(title)
        self._rows = QFormLayout(self)
        self._rows.setContentsMargins(6, 2, 6, 4)
        self._rows.setHorizontalSpacing(8)
        self._rows.setVerticalSpacing(3)
        self._rows.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        self._rows.setLabelAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)

    def add(self, label: str, *widgets: Field) -> QWidget:
        """Add a row; return the field, which `show_row` shows or hides.

        An ampersand in the label marks the key that, with Alt, goes to the first widget.
        """
        for widget in widgets:
            _narrow(widget.native)
            widget.native.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
            widget.native.installEventFilter(self)
        if len(widgets) == 1:
            field = widgets[0].native
        else:
            field = QWidget()
            line = QHBoxLayout(field)
            line.setContentsMargins(0, 0, 0, 0)
            line.setSpacing(4)
            for widget in widgets:
                line.addWidget(widget.native, 1)
        if label:
            name = QLabel(label)
            name.setBuddy(widgets[0].native)
            name.setToolTip(widgets[0].tooltip or "")
            self._rows.addRow(name, field)
        else:
            self._rows.addRow(field)
        return field

    def add_native(self, label: QWidget, field: QWidget) -> None:
        """Add a row of Qt widgets."""
        self._rows.addRow(label, field)

    def add_text(self, tooltip: str) -> QLabel:
        """Add a row of text that wraps; return the label to write on."""
        text = WrappedText()
        text.setToolTip(tooltip)
        text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._rows.addRow(text)
        return text

    def relabel(self, field: QWidget, text: str) -> None:
        """Write another label on a row."""
        label = self._rows.labelForField(field)
        if label is not None:
            label.setText(text)

    def show_row(self, field: QWidget, visible: bool) -> None:
        """Show or hide a row with its label."""
        field.setVisible(visible)
        label = self._rows.labelForField(field)
        if label is not None:
            label.setVisible(visible)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Let the wheel scroll the panel, not change a field that it happens to pass over."""
        if event.type() == QEvent.Type.Wheel and not watched.hasFocus():
            event.ignore()
            return True
        return bool(super().eventFilter(watched, event))


def _narrow(native: QWidget) -> None:
    policy = native.sizePolicy()
    native.setSizePolicy(QSizePolicy.Policy.Ignored, policy.verticalPolicy())
    native.setMinimumWidth(40)
    if isinstance(native, QComboBox):
        native.setMinimumContentsLength(4)

"""A number of things, typed or chosen from a short list."""

from __future__ import annotations

from qtpy.QtWidgets import QComboBox

INVALID_STYLE = "QComboBox, QComboBox QLineEdit { color: #b00020; background: #ffe3e3; }"

# More are a slip of the pen, and would stop the program for minutes.
MOST = 1_000_000


class CountField:
    """A field for a whole number, 1 to a million; red, with the reason as tooltip, if it is none.

    Parameters
    ----------
    name : str
        What is counted, for messages.
    value : int
        The number shown at first.
    offered : sequence of int
        Numbers to choose from.
    tooltip : str
        What the field is for.
    """

    def __init__(self, name: str, value: int, offered: tuple[int, ...], tooltip: str) -> None:
        self._name, self.tooltip = name, tooltip
        self.native = QComboBox()
        self.native.setEditable(True)
        self.native.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)
        self.native.setCompleter(None)
        self.native.addItems([str(number) for number in offered])
        self.native.setToolTip(tooltip)
        self.native.editTextChanged.connect(self._mark)
        self.number = value

    @property
    def number(self) -> int:
        """The number; a ``ValueError`` that names the field if there is no valid one."""
        text = self.native.currentText().strip()
        if text.isascii() and text.isdecimal() and 1 <= int(text) <= MOST:
            return int(text)
        raise ValueError(
            f"{self._name} is {text!r}; it must be a whole number such as 250, at most {MOST}."
        )

    @number.setter
    def number(self, number: int) -> None:
        self.native.setEditText(str(number))

    def _mark(self, _text: str) -> None:
        try:
            _ = self.number
        except ValueError as error:
            style, help_ = INVALID_STYLE, str(error)
        else:
            style, help_ = "", self.tooltip
        self.native.setStyleSheet(style)
        self.native.setToolTip(help_)

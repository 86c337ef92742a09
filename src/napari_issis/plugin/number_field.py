"""Numbers that are typed as text: nothing that is typed is dropped or read as another number."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import isfinite
from typing import Any

from magicgui.widgets import LineEdit

INVALID_STYLE = "QLineEdit { color: #b00020; background: #ffe3e3; border: 1px solid #e0314b; }"
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)


class NumberField(LineEdit):
    """A text field for a number; red, with the reason as tooltip, while it holds no valid one.

    Parameters
    ----------
    name : str
        What the number is, for messages.
    value : float
        The number shown at first.
    tooltip : str
        What the field is for.
    check : callable, optional
        Raises a ``ValueError`` if a number is not allowed.
    """

    def __init__(
        self,
        name: str,
        value: float,
        tooltip: str,
        check: Callable[[float], object] | None = None,
    ) -> None:
        super().__init__(value=exact_text(value), tooltip=tooltip)
        self._name, self._help, self._check = name, tooltip, check
        self.changed.connect(self._mark)

    @property
    def number(self) -> float:
        """The number; a ``ValueError`` that names the field if there is no valid one."""
        number = self.read()
        if self._check is not None:
            self._check(number)
        return number

    @number.setter
    def number(self, number: float) -> None:
        self.value = exact_text(number)

    def read(self) -> float:
        """Read the number without checking whether it is allowed."""
        return read_number(self._name, self.value)

    def _mark(self, event: Any = None) -> None:
        try:
            _ = self.number
        except ValueError as error:
            self.native.setStyleSheet(INVALID_STYLE)
            self.native.setToolTip(str(error))
        else:
            self.native.setStyleSheet("")
            self.native.setToolTip(self._help)


class SeedField(NumberField):
    """A text field for the seed of a random generator: a whole number, 0 or more."""

    @property
    def number(self) -> int:
        """The seed; a ``ValueError`` that names the field if there is no valid one."""
        text = self.value.strip()
        if text.isascii() and text.isdecimal():
            return int(text)
        number = self.read()
        if number < 0 or not number.is_integer():
            raise ValueError(f"{self._name} is {text}; it must be a whole number, 0 or more.")
        return int(number)

    @number.setter
    def number(self, number: float) -> None:
        self.value = str(int(number))


def read_number(name: str, text: str) -> float:
    """Read a number that was typed, such as ``1000``, ``0.5`` or ``1e-14``.

    Raises
    ------
    ValueError
        If it is none, or not finite; the message names the field. A comma is refused: it may
        be meant as decimal or as thousands separator.
    """
    if _NUMBER.fullmatch(text.strip()) and isfinite(number := float(text)):
        return number
    raise ValueError(
        f"{name} is {text!r}; it must be a number such as 1000, 0.5 or 1e-14, without commas."
    )


def exact_text(number: float) -> str:
    """Shortest text that reads as exactly this number."""
    short = f"{number:.12g}"
    return short if float(short) == number else repr(number)

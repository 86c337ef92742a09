"""Numbers with a unit that can be changed: what was typed is kept, so nothing is rounded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .number_field import NumberField, number_text, read_number
from .units import FluxScale, LengthScale

Scale = FluxScale | LengthScale


class QuantityField(NumberField):
    """A field for a flux or a length, shown and typed on a scale that can be changed.

    ``number`` is in erg s-1 cm-2 A-1 or in pixels on any scale.

    Parameters
    ----------
    name : str
        What the number is, for messages.
    value : float
        The number shown at first, in erg s-1 cm-2 A-1 or pixels.
    tooltip : str
        What the field is for.
    base : FluxScale or LengthScale
        The scale of ``value`` and ``number``, on which the field reads at first.
    check : callable, optional
        Raises a ``ValueError`` if a number is not allowed.
    """

    def __init__(
        self,
        name: str,
        value: float,
        tooltip: str,
        base: Scale,
        check: Callable[[float], object] | None = None,
    ) -> None:
        super().__init__(name, value, tooltip, check)
        self._scale = self._base = base
        # What was typed last, and on which scale.
        self._typed: tuple[Scale, str] = base, self.value
        self._converting = False

    @property
    def number(self) -> float:
        """The number; a ``ValueError`` that names the field if there is no valid one."""
        return super().number

    @number.setter
    def number(self, number: float) -> None:
        text = number_text(number)
        self._typed = self._base, text
        self._write(text if self._scale == self._base else self._shown(number))

    def read(self) -> float:
        """Read the number without checking whether it is allowed."""
        number = self._read_typed()
        if self._scale != self._typed[0]:
            self._scale.show_one(number)
        return number

    def show_in(self, scale: Scale) -> None:
        """Convert to another scale; going back gives what was typed.

        A magnitude that was typed stays when the channel changes; a flux that was typed keeps
        its value, and its magnitude changes.
        """
        before, (typed_on, typed) = self._scale, self._typed
        if scale == before:
            return
        self._scale = scale
        try:
            number = self._read_typed()
        except ValueError:
            # What has to be corrected stays, now as a text on the new scale.
            self._typed = scale, self.value
            self._mark()
            return
        if typed_on == before and scale.unit == before.unit:
            self._typed = scale, typed
            self._mark()
        else:
            self._write(typed if scale == typed_on else self._shown(number))

    def _read_typed(self) -> float:
        scale, text = self._typed
        return scale.read(read_number(self._name, text))

    def _shown(self, number: float) -> str:
        try:
            return number_text(self._scale.show_one(number))
        except ValueError:
            return "∞"

    def _write(self, text: str) -> None:
        self._converting = True
        try:
            self.value = text
        finally:
            self._converting = False
        self._mark()

    def _mark(self, event: Any = None) -> None:
        # With an event the text has changed, by typing unless a conversion is being written.
        if event is not None and not self._converting:
            self._typed = self._scale, self.value
        super()._mark()

"""Lower and upper limit of a quantity, typed as numbers."""

from __future__ import annotations

from collections.abc import Callable

from .number_field import NumberField
from .quantity_field import QuantityField, Scale


class Limits:
    """Two fields for the limits of a quantity.

    Parameters
    ----------
    label : str
        The quantity, for messages.
    low, high : float
        The limits shown at first.
    tooltip : str
        What the quantity is.
    check : callable
        Raises a ``ValueError`` if a number is not allowed.
    """

    def __init__(
        self,
        label: str,
        low: float,
        high: float,
        tooltip: str,
        check: Callable[[float], object],
    ) -> None:
        self.low, self.high = (
            NumberField(f"{label}, {end} limit", number, f"{end.title()} limit. {tooltip}", check)
            for end, number in (("lower", low), ("upper", high))
        )

    @property
    def numbers(self) -> tuple[float, float]:
        """The limits."""
        return self.low.number, self.high.number


class QuantityLimits:
    """Two fields for the limits of a flux or a length, on a scale that can be changed.

    Magnitudes grow downwards: the field of the lower flux then has the larger number. They are
    taken in either order.

    Parameters
    ----------
    label : str
        The quantity, for messages.
    low, high : float
        The limits shown at first, in erg s-1 cm-2 A-1 or pixels.
    tooltip : str
        What the quantity is.
    base : FluxScale or LengthScale
        The scale of ``low`` and ``high``.
    check : callable
        Raises a ``ValueError`` if a number is not allowed.
    ends : (str, str)
        What the two limits are called.
    """

    def __init__(
        self,
        label: str,
        low: float,
        high: float,
        tooltip: str,
        base: Scale,
        check: Callable[[float], object],
        ends: tuple[str, str] = ("lower", "upper"),
    ) -> None:
        self._scale = base
        self.low, self.high = (
            QuantityField(
                f"{label}, {end} limit", number, f"{end.title()} limit. {tooltip}", base, check
            )
            for end, number in zip(ends, (low, high), strict=True)
        )

    @property
    def numbers(self) -> tuple[float, float]:
        """The limits in erg s-1 cm-2 A-1 or pixels."""
        low, high = self.low.number, self.high.number
        return (high, low) if self._swapped(low, high) else (low, high)

    def show_in(self, scale: Scale) -> None:
        """Convert both to another scale."""
        if scale == self._scale:
            return
        try:
            low, high = self.low.number, self.high.number
        except ValueError:
            # What has to be corrected stays where it is.
            pass
        else:
            if scale.unit != self._scale.unit and self._swapped(low, high):
                self.low.number, self.high.number = high, low
        self._scale = scale
        self.low.show_in(scale)
        self.high.show_in(scale)

    def _swapped(self, low: float, high: float) -> bool:
        return self._scale.unit == "AB mag" and low > high

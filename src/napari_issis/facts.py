"""Numbers with their unit, and where they come from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from itertools import pairwise
from math import isfinite
from typing import Any

Value = float | tuple[float, ...]

STATUSES = ("paper", "published", "measured", "derived", "assumed", "illustrative")


@dataclass(frozen=True)
class Fact:
    """A number, or some numbers, and where they come from.

    Attributes
    ----------
    value : float or tuple of float
        What the program uses.
    unit : str
        The unit, empty for none.
    status : str
        One of `STATUSES`: of the paper of the simulator, published elsewhere, measured, derived
        from other numbers, assumed, or made up to show what such a thing does.
    source : str
        Where it stands, how it was derived, or why it was assumed.
    """

    value: Value
    unit: str
    status: str
    source: str


# What is known of a number that a script has put in the place of another one.
UNKNOWN = ("assumed", "set in a script")


@dataclass(frozen=True)
class Number:
    """What an attribute of an instrument may hold.

    Attributes
    ----------
    unit : str
        The unit, empty for none.
    low, high : float
        Least and largest value.
    above : bool
        Whether the value must exceed ``low``.
    count : int or None
        How many numbers: 1, 2 or, with None, a list of at least 1.
    rising : bool
        Whether several numbers must rise.
    whole : bool
        Whether they are whole numbers.
    """

    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    above: bool = False
    count: int | None = 1
    rising: bool = False
    whole: bool = False

    def checked(self, value: Any) -> Value:
        """Return a value as floats (or ints), or raise a ValueError that says what is allowed."""
        if self.count == 1:
            return self._one(value)
        if not isinstance(value, list | tuple):
            raise ValueError(f"value is {_short(value)}; it must be {self._wanted()}.")
        if len(value) != self.count if self.count else not value:
            raise ValueError(f"value has {len(value)} numbers; it must be {self._wanted()}.")
        values = tuple(self._one(one) for one in value)
        if self.rising:
            for before, after in pairwise(values):
                if not before < after:
                    raise ValueError(
                        f"value has {after:g} behind {before:g}; the numbers must rise"
                        + (", the lower end first." if self.count == 2 else ".")
                    )
        return values

    def _one(self, value: Any) -> float:
        try:
            number = None if isinstance(value, bool | str) else float(value)
        except (TypeError, ValueError, OverflowError):
            number = None
        good = number is not None and isfinite(number) and self.low <= number <= self.high
        if number is None or not good or (self.above and number == self.low):
            raise ValueError(f"value is {_short(value)}; it must be {self._wanted()}.")
        if not self.whole:
            return number
        if number != int(number):
            raise ValueError(f"value is {_short(value)}; it must be {self._wanted()}.")
        return int(number)

    def _wanted(self) -> str:
        what = "whole number" if self.whole else "number"
        many = {1: f"a {what}", 2: f"two {what}s"}.get(self.count or 0, f"a list of {what}s")
        low = f"above {self.low:g}" if self.above else f"{self.low:g} or more"
        unit = f" ({self.unit})" if self.unit else ""
        return f"{many}{unit}, {low} and at most {self.high:g}"


def _short(value: Any) -> str:
    try:
        text = repr(value)
    except ValueError:  # an integer of too many digits
        return "too long a number"
    return text if len(text) <= 60 else f"{text[:57]}..."


def number(unit: str = "", *, default: Any = MISSING, **limits: Any) -> Any:
    """Make a dataclass field that holds a number of an instrument; ``limits`` as of `Number`."""
    return field(default=default, metadata={"number": Number(unit, **limits)})


def numbers(thing: Any) -> Iterator[tuple[Field[Any], Number]]:
    """Fields of a dataclass (or an instance of it) that hold numbers, and what they may be."""
    for one in fields(thing):
        if "number" in one.metadata:
            yield one, one.metadata["number"]


def check_numbers(thing: Any) -> None:
    """Check the numbers of a frozen dataclass; the ValueError names the attribute."""
    for one, allowed in numbers(thing):
        value = getattr(thing, one.name)
        # what need not be known
        if one.default is not MISSING and value == one.default:
            continue
        try:
            object.__setattr__(thing, one.name, allowed.checked(value))
        except ValueError as error:
            raise ValueError(f"{one.name}: {error}") from None


def facts_of(thing: Any) -> Mapping[str, Fact]:
    """All numbers that a dataclass with an attribute ``facts`` holds, by the attribute's name.

    What is said of a number holds for that number alone: another one, put in its place by
    `dataclasses.replace`, is assumed.
    """
    found = {}
    for one, allowed in numbers(thing):
        value = getattr(thing, one.name)
        known = thing.facts.get(one.name)
        if known is not None and known.value == value:
            found[one.name] = known
        elif one.default is MISSING or value != one.default:
            found[one.name] = Fact(value, allowed.unit, *UNKNOWN)
    return found

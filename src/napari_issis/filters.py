"""Filters with a response: transmission as a function of wavelength."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Filter:
    """A filter given by a curve; immutable, equal and hashable by its content.

    Parameters
    ----------
    name : str
        The filter's name, printable ASCII text.
    wavelength : array_like, shape (n,)
        In angstrom, strictly increasing or strictly decreasing, n at least 2.
    transmission : array_like, shape (n,)
        From 0 to 1. Between the samples it is linear in wavelength; outside them nothing
        passes.

    Raises
    ------
    ValueError
        If the curve is none; the message names the value.
    """

    name: str
    wavelength: Array = field(repr=False)
    transmission: Array = field(repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        name = str(self.name).strip()
        if not name or not name.isascii() or not name.isprintable():
            raise ValueError(f"a filter's name is {self.name!r}; give printable ASCII text.")
        set_(self, "name", name)
        wavelength = _samples(name, "wavelength", self.wavelength)
        transmission = _samples(name, "transmission", self.transmission)
        if wavelength.size != transmission.size or wavelength.size < 2:
            raise ValueError(
                f"filter {name} has {wavelength.size} wavelengths and {transmission.size} "
                "transmissions; give as many of both, at least 2."
            )
        if wavelength[0] > wavelength[-1]:
            wavelength, transmission = wavelength[::-1].copy(), transmission[::-1].copy()
        steps = np.diff(wavelength)
        if not np.all(steps > 0):
            at = wavelength[int(np.argmin(steps)) + 1]
            raise ValueError(
                f"filter {name}: the wavelengths do not run in one direction at {at:g} A; "
                "sort the rows and remove doubles."
            )
        if wavelength[0] <= 0:
            raise ValueError(
                f"filter {name} has the wavelength {wavelength[0]:g} A; it must be > 0."
            )
        for value in transmission[(transmission < 0) | (transmission > 1)][:1]:
            raise ValueError(
                f"filter {name} has the transmission {value:g}; it must lie between 0 and 1 "
                "(per cent need the unit %)."
            )
        if not transmission.any():
            raise ValueError(f"filter {name} passes nothing: its transmission is 0 throughout.")
        for array, attribute in ((wavelength, "wavelength"), (transmission, "transmission")):
            array.setflags(write=False)
            set_(self, attribute, array)

    def __call__(self, wavelength: ArrayLike) -> Array:
        """Transmission at wavelengths in angstrom, any shape."""
        value: Array = np.interp(
            np.asarray(wavelength, dtype=np.float64),
            self.wavelength,
            self.transmission,
            left=0.0,
            right=0.0,
        )
        return value

    def __str__(self) -> str:
        return self.name

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Filter)
            and self.name == other.name
            and np.array_equal(self.wavelength, other.wavelength)
            and np.array_equal(self.transmission, other.transmission)
        )

    def __hash__(self) -> int:
        return hash((self.name, self.wavelength.tobytes(), self.transmission.tobytes()))

    @classmethod
    def read(cls, path: str | os.PathLike[str], name: str | None = None) -> Filter:
        """Read a filter curve; see `napari_issis.filter_file.read_filter`."""
        from .filter_file import read_filter

        return read_filter(path, name)


def _samples(name: str, what: str, values: Any) -> Array:
    if isinstance(values, u.Quantity):
        target = u.AA if what == "wavelength" else u.dimensionless_unscaled
        try:
            values = values.to_value(target)
        except u.UnitConversionError:
            raise ValueError(
                f"filter {name}: {what} is in {values.unit}, not in {target}."
            ) from None
    try:
        array = np.array(values, dtype=np.float64, copy=True)
    except (TypeError, ValueError):
        raise ValueError(f"filter {name}: {what} holds something that is no number.") from None
    if array.ndim != 1:
        raise ValueError(f"filter {name}: {what} has {array.ndim} dimensions; give a list.")
    for i in np.flatnonzero(~np.isfinite(array))[:1]:
        raise ValueError(f"filter {name}: {what} is {array[i]} in row {i}; it must be finite.")
    return array

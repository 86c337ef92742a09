"""Filters with a response: transmission as a function of wavelength."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import Table
from numpy.typing import ArrayLike, NDArray

from .fits_table import open_fits, read_table

Array = NDArray[np.float64]

COLUMNS = {
    "wavelength": ("wavelength", "wave", "lambda", "lam", "wl"),
    "transmission": ("transmission", "transmittance", "throughput", "trans"),
}
FITS_SUFFIXES = (".fits", ".fit", ".fts")


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
        """Read a filter curve.

        Parameters
        ----------
        path : path-like
            An ECSV, CSV or FITS table with the columns ``wavelength`` and ``transmission``
            (or ``wave``, ``lambda``, ``lam``, ``wl``; ``transmittance``, ``throughput``,
            ``trans``; in any case). The wavelength has a unit: the column's own, or one in its
            name, as ``wavelength_nm`` or ``wavelength (nm)``. The transmission has none, or %.
        name : str, optional
            The filter's name, by default that of the file without its ending.

        Raises
        ------
        ValueError
            If the file holds no such table or the curve is none; the message names the file.
        OSError
            If the file cannot be opened.
        """
        path = Path(path)
        table = _read_table(path)
        try:
            wavelength = _column(table, "wavelength")
            transmission = _column(table, "transmission")
            return cls(path.stem if name is None else name, wavelength, transmission)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error


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


def _read_table(path: Path) -> Table:
    suffix = path.suffix.lower()
    if suffix in FITS_SUFFIXES:
        with open_fits(path) as hdus:
            tables = [hdu for hdu in hdus if isinstance(hdu, fits.BinTableHDU)]
            if not tables:
                raise ValueError("the file holds no table.")
            return read_table(tables[0])
    if suffix not in (".ecsv", ".csv"):
        raise ValueError(f"{path} is no ECSV, CSV or FITS file; its name must say which.")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path} is no text file in UTF-8.") from None
    try:
        return Table.read(StringIO(text), format="ascii" + suffix)
    except Exception as error:
        # What astropy raises on a broken table is not restricted to a few types.
        raise ValueError(f"{path} is no {suffix[1:].upper()} table: {error}") from error


def _column(table: Table, what: str) -> Any:
    """Values of a column recognised by its name, as a quantity if it has a unit."""
    for title in table.colnames:
        match = re.fullmatch(
            r"\s*([a-z]+)\s*(?:[_ ]\s*|(?=[(\[]))?[(\[]?(.*?)[)\]]?\s*", title.lower()
        )
        if match is None or match[1] not in COLUMNS[what]:
            continue
        column = table[title]
        if np.ma.is_masked(column):
            raise ValueError(f"column {title} has an empty cell; fill or remove its row.")
        unit = getattr(column, "unit", None)
        if unit is None and match[2]:
            unit = {"a": u.AA, "aa": u.AA, "angstroms": u.AA, "microns": u.um}.get(match[2])
            unit = unit or u.Unit(match[2], parse_strict="silent")
        values = np.asarray(getattr(column, "value", column))
        if unit is None and what == "wavelength":
            raise ValueError(
                f"column {title} has no unit; give it one, or name it wavelength_A or "
                "wavelength_nm."
            )
        return values if unit is None else _with_unit(title, values, unit)
    raise ValueError(
        f"there is no column {what} (or {', '.join(COLUMNS[what][1:])}); "
        f"the table has {', '.join(table.colnames)}."
    )


def _with_unit(title: str, values: Any, unit: u.UnitBase) -> u.Quantity:
    if isinstance(unit, u.UnrecognizedUnit):
        raise ValueError(f"column {title} has the unknown unit {unit}; use Angstrom or nm.")
    if values.dtype.kind not in "fiu":
        raise ValueError(f"column {title} does not hold numbers.")
    return values * unit

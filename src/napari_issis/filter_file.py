"""Filter curves in files: ECSV, CSV and FITS tables."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .filters import Filter
from .fits_table import open_fits, read_table

FITS_SUFFIXES = (".fits", ".fit", ".fts")
COLUMNS = {
    "wavelength": ("wavelength", "wave", "lambda", "lam", "wl"),
    "flux": ("flux", "flam", "flambda"),
    "transmission": ("transmission", "transmittance", "throughput", "trans"),
}
PER_WAVELENGTH = u.erg / u.s / u.cm**2 / u.AA
# Spellings in the name of a column that astropy does not know or takes for something else.
UNITS = {"a": u.AA, "aa": u.AA, "angstroms": u.AA, "microns": u.um}


def read_filter(path: str | os.PathLike[str], name: str | None = None) -> Filter:
    """Read a filter curve.

    Parameters
    ----------
    path : path-like
        An ECSV, CSV or FITS table (of a FITS file the first one) with the columns
        ``wavelength`` and ``transmission`` (or ``wave``, ``lambda``, ``lam``, ``wl``;
        ``transmittance``, ``throughput``, ``trans``; in any case). The wavelength has a unit:
        the column's own, or one in its name, as ``wavelength_nm`` or ``wavelength (nm)``. The
        transmission has none, or %.
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
        wavelength, transmission = _column(table, "wavelength"), _column(table, "transmission")
        return Filter(path.stem if name is None else name, wavelength, transmission)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def read_curve(path: Path, what: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read wavelengths in angstrom and fluxes per wavelength from a table.

    Parameters
    ----------
    path : Path
        As of `read_filter`.
    what : {"flux"}
        The second column. In a unit per frequency it is converted to one per wavelength.

    Raises
    ------
    ValueError
        If the file holds no such table; the message names the file.
    OSError
        If the file cannot be opened.
    """
    table = _read_table(path)
    try:
        at, values = _column(table, "wavelength"), _column(table, what)
        if not at.unit.is_equivalent(u.AA):
            raise ValueError(f"the wavelengths are in {at.unit}, not in Angstrom.")
        wavelength = at.to(u.AA)
        if hasattr(values, "unit"):
            if not values.unit.is_equivalent(PER_WAVELENGTH, u.spectral_density(1 * u.AA)):
                raise ValueError(f"the flux is in {values.unit}, which is no flux density.")
            values = values.to_value(PER_WAVELENGTH, u.spectral_density(wavelength))
        return np.array(wavelength.value, dtype=np.float64), np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}") from error


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
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError:
        raise ValueError(f"{path} is no text file in UTF-8.") from None
    if not text.strip():
        raise ValueError(f"{path} is empty.")
    try:
        return QTable.read(text.splitlines(), format="ascii" + suffix)
    except Exception as error:
        # What astropy raises on a broken table is not restricted to a few types.
        reason = str(error).strip().split("\n")[0]
        raise ValueError(f"{path} is no {suffix[1:].upper()} table: {reason}") from error


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
            unit = UNITS.get(match[2]) or u.Unit(match[2], parse_strict="silent")
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

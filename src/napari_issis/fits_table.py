"""Tables with units in FITS, and FITS files that are whole."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import MaskedColumn, QTable, Table


@contextmanager
def open_fits(path: str | os.PathLike[str]) -> Iterator[fits.HDUList]:
    """Open a FITS file after checking that it is whole.

    Parameters
    ----------
    path : path-like
        The file.

    Yields
    ------
    astropy.io.fits.HDUList

    Raises
    ------
    OSError
        If the file cannot be opened.
    ValueError
        If it is empty, no FITS file, truncated or damaged (its ``DATASUM`` cards disagree),
        or if the body of the ``with`` statement finds fault with it; the message names it.
    """
    try:
        with Path(path).open("rb") as file:
            start = file.read(9)
            size = os.fstat(file.fileno()).st_size
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror or error}.") from error
    if not start:
        raise ValueError(f"{path} is empty.")
    if start != b"SIMPLE  =":
        raise ValueError(f"{path} is not a FITS file: it does not start with SIMPLE.")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            _check_whole(path, size)
            with fits.open(path, memmap=False) as hdus:
                yield hdus
    except ValueError as error:
        raise ValueError(f"{path}: {_one_line(error)}") from error
    except Exception as error:
        # What astropy raises on a broken file is not restricted to a few types.
        raise ValueError(f"{path} is damaged: {_one_line(error)}") from error


def _check_whole(path: str | os.PathLike[str], size: int) -> None:
    with fits.open(path, memmap=False, disable_image_compression=True) as hdus:
        for hdu in hdus:
            place = hdu.fileinfo()
            end = place["datLoc"] + place["datSpan"]
            if end > size:
                raise ValueError(f"the file is truncated: {end} bytes are due, it has {size}.")
            if hdu.verify_datasum() == 0:
                raise ValueError(
                    f"the data of {hdu.name or 'an extension'} do not match their DATASUM; "
                    "the file is damaged or was changed."
                )


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def table_hdu(table: Table, name: str) -> fits.BinTableHDU:
    """Make a FITS table with the units kept, AB magnitudes included.

    Parameters
    ----------
    table : astropy.table.Table
        Columns of numbers or ASCII text. Masked numbers become NaN, masked text is empty.
    name : str
        Name of the extension.

    Raises
    ------
    ValueError
        If a column cannot be stored; the message names it.
    """
    plain = Table()
    for column in table.colnames:
        plain[column] = _storable(column, table[column])
    try:
        hdu = fits.table_to_hdu(plain)
    except UnicodeEncodeError as error:
        raise ValueError(
            f"the table holds the text {str(error.object)!r}; FITS tables take ASCII text only."
        ) from error
    for column in table.colnames:
        unit = getattr(table[column], "unit", None)
        if unit is not None:
            hdu.columns[column].unit = _unit_text(column, unit)
    hdu.name = name
    return hdu


def _storable(name: str, column: Any) -> Any:
    """Plain values of a column; object arrays of text become text."""
    values = getattr(column, "value", column)
    dtype = np.asarray(values).dtype
    if dtype.kind == "O" and all(isinstance(v, str) for v in values):
        values, dtype = np.asarray(values, dtype=str), np.dtype(str)
    if dtype.kind not in "fiubUS":
        raise ValueError(
            f"column {name} is neither numbers nor text ({type(column).__name__}); "
            "remove it to save the table as FITS."
        )
    mask = getattr(column, "mask", None)
    if mask is None:
        return np.asarray(values)
    if dtype.kind in "fUS":
        return np.where(mask, np.nan if dtype.kind == "f" else "", np.asarray(values))
    return MaskedColumn(np.asarray(values), mask=mask)


def _unit_text(column: str, unit: u.UnitBase) -> str:
    for write in (lambda: unit.to_string("fits"), unit.to_string):
        try:
            text = str(write())
            if parse_unit(text) == unit:
                return text
        except (ValueError, AttributeError):
            continue
    raise ValueError(f"column {column}: FITS cannot hold its unit {unit}.")


def parse_unit(text: str) -> u.UnitBase:
    """Parse a unit as FITS writes it, or else as astropy does; unknown ones are kept as text."""
    try:
        return u.Unit(text, format="fits")
    except ValueError:
        return u.Unit(text, parse_strict="silent")


def read_table(hdu: fits.BinTableHDU) -> QTable:
    """Read a FITS table; columns with units become quantities, in the machine's byte order.

    Parameters
    ----------
    hdu : astropy.io.fits.BinTableHDU
        The extension.
    """
    units = {column.name: column.unit for column in hdu.columns}
    plain = Table.read(hdu, mask_invalid=False)
    table = QTable()
    for name in plain.colnames:
        column = plain[name]
        masked = isinstance(column, MaskedColumn)
        values = np.ma.asarray(column) if masked else np.asarray(column)
        values = values.astype(values.dtype.newbyteorder("="))
        unit = parse_unit(units[name]) if units.get(name) else None
        if unit is not None and not masked and values.dtype.kind == "f":
            table[name] = values * unit
        else:
            table[name] = values
            if unit is not None:
                table[name].unit = unit
    return table

"""Tables with units in FITS, and FITS files that are whole."""

from __future__ import annotations

import os
import re
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any, BinaryIO

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import MaskedColumn, QTable, Table

from .fits_claims import check_claims
from .reading import one_line, open_file

# A packed file is unpacked in memory, up to so many bytes.
MOST_UNPACKED = 256 * 2**20
PIECE = 2**20
GZIP = b"\x1f\x8b"
ESCAPED = "ESCAPED"
VARIABLE = re.compile(r"\d*[PQ]")


@contextmanager
def open_fits(path: str | os.PathLike[str]) -> Iterator[fits.HDUList]:
    """Open a FITS file, gzip-packed or not, after checking that it is whole.

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
        claims more than it can hold (see `napari_issis.fits_claims`), or if the body of the
        ``with`` statement finds fault with it; the message names it.
    """
    with open_file(path) as opened:
        file = opened
        start = file.read(9)
        if start.startswith(GZIP):
            file = _unpacked(file, path)
            start = file.read(9)
        if start != b"SIMPLE  =":
            raise ValueError(f"{path} is not a FITS file: it does not start with SIMPLE.")
        size = file.seek(0, os.SEEK_END)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                check_claims(file, size)
                file.seek(0)
                # Not closed: that would be to close the file, which has its own with.
                yield fits.open(file, memmap=False)
        except MemoryError:
            raise
        except ValueError as error:
            raise ValueError(f"{path}: {one_line(error)}") from error
        except Exception as error:
            # What astropy raises on a broken file is not restricted to a few types.
            fault = f"{type(error).__name__}: {one_line(error)}"
            raise ValueError(f"{path} is damaged ({fault}).") from error


def _unpacked(file: BinaryIO, path: str | os.PathLike[str]) -> BinaryIO:
    # Piece by piece: a single call of `decompress` holds what it unpacks twice.
    file.seek(0)
    inflate = zlib.decompressobj(wbits=31)
    content = BytesIO()
    try:
        while not inflate.eof and (packed := inflate.unconsumed_tail or file.read(PIECE)):
            content.write(inflate.decompress(packed, PIECE))
            if content.tell() > MOST_UNPACKED:
                raise ValueError(
                    f"{path} holds more than {MOST_UNPACKED} bytes; unpack it first with gunzip."
                )
    except zlib.error as error:
        raise ValueError(
            f"{path} is not a FITS file: its gzip data are damaged ({one_line(error)})."
        ) from error
    if not inflate.eof:
        raise ValueError(f"{path} is truncated: its gzip data have no end.")
    content.seek(0)
    return content


def table_hdu(table: Table, name: str) -> fits.BinTableHDU:
    """Make a FITS table with the units kept, AB magnitudes included.

    Parameters
    ----------
    table : astropy.table.Table
        Columns of numbers or text. Masked numbers become NaN, masked text is empty. Where
        anything is not printable ASCII, all names and text are escaped.
    name : str
        Name of the extension.

    Raises
    ------
    ValueError
        If a column cannot be stored; the message names it.
    """
    plain = Table({column: _storable(column, table[column]) for column in table.colnames})
    escaped = _needs_escape(plain)
    if escaped:
        plain = Table({_escape(name): _escape_values(plain[name]) for name in plain.colnames})
    hdu = fits.table_to_hdu(plain)
    for stored, column in zip(plain.colnames, table.colnames, strict=True):
        unit = getattr(table[column], "unit", None)
        if unit is not None:
            hdu.columns[stored].unit = _unit_text(column, unit)
    if escaped:
        hdu.header[ESCAPED] = (True, "names and text as Python's unicode_escape")
    hdu.name = name
    return hdu


def _needs_escape(table: Table) -> bool:
    """Whether a name or text is not what FITS takes: printable ASCII."""
    if not all(name.isascii() and name.isprintable() for name in table.colnames):
        return True
    texts = (table[name] for name in table.colnames if table[name].dtype.kind == "U")
    return any(not (text.isascii() and text.isprintable()) for column in texts for text in column)


def _escape(text: str) -> str:
    return text.encode("unicode_escape").decode("ascii")


def _escape_values(column: Any) -> Any:
    if column.dtype.kind != "U":
        return column
    return np.array([_escape(str(text)) for text in column], dtype=str)


def _unescape(text: Any) -> str:
    return str(text).encode("ascii").decode("unicode_escape")


def _storable(name: str, column: Any) -> Any:
    """Plain values of a column; object arrays of text become text."""
    values = getattr(column, "value", column)
    dtype = np.asarray(values).dtype
    if dtype.kind == "O" and all(isinstance(v, str) for v in values):
        values, dtype = np.asarray(values, dtype=str), np.dtype(str)
    if dtype.kind not in "fiubcUS":
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

    Columns of arrays whose length varies from row to row are left out.

    Parameters
    ----------
    hdu : astropy.io.fits.BinTableHDU
        The extension.
    """
    for name in [column.name for column in hdu.columns if VARIABLE.match(str(column.format))]:
        hdu.columns.del_col(name)
    units = {column.name: column.unit for column in hdu.columns}
    plain = Table.read(hdu, mask_invalid=False)
    escaped = hdu.header.get(ESCAPED) is True
    table = QTable()
    for name in plain.colnames:
        column = plain[name]
        masked = isinstance(column, MaskedColumn)
        values = np.ma.asarray(column) if masked else np.asarray(column)
        values = values.astype(values.dtype.newbyteorder("="))
        unit = parse_unit(units[name]) if units.get(name) else None
        if escaped:
            name = _unescape(name)
            if values.dtype.kind in "US":
                values = np.array([_unescape(text) for text in values.astype(str)], dtype=str)
        if unit is not None and not masked and values.dtype.kind == "f":
            table[name] = values * unit
        else:
            table[name] = values
            if unit is not None:
                table[name].unit = unit
    return table

"""Source tables in files: ECSV, FITS and CSV."""

from __future__ import annotations

import os
from io import StringIO
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import QTable, Table

from .fits_io import SUFFIXES as FITS_SUFFIXES
from .fits_table import open_fits, read_table, table_hdu
from .safe_write import replacing
from .sources import FLUX_UNIT, check_sources

SUFFIXES = (".ecsv", ".csv", *FITS_SUFFIXES)
# Units of a column that comes without one.
DEFAULT_UNITS = {
    "x": u.pix,
    "y": u.pix,
    "flux": FLUX_UNIT,
    "r_half": u.pix,
    "ellipticity": u.dimensionless_unscaled,
    "pa": u.deg,
    "n": u.dimensionless_unscaled,
}


def read_sources(path: str | os.PathLike[str]) -> QTable:
    """Read a source table.

    Parameters
    ----------
    path : path-like
        An ECSV (``.ecsv``), FITS (``.fits``, ``.fit``, ``.fts``) or CSV (``.csv``) file with
        the columns ``kind x y flux r_half ellipticity pa`` (and ``n`` for Sersic profiles).
        Columns without a unit are in pixels, degrees and erg s-1 cm-2 A-1. Of a FITS file the
        extension ``SOURCES`` is taken, which every saved exposure has, else the first table.

    Returns
    -------
    astropy.table.QTable
        The checked table; empty cells are NaN.

    Raises
    ------
    ValueError
        If the file is empty or broken, its name has an unknown ending, or a column or value
        is missing or out of range; the message names the file, row (from 0), column and value.
    OSError
        If the file cannot be opened.
    """
    suffix = _suffix(path)
    if suffix in FITS_SUFFIXES:
        with open_fits(path) as hdus:
            return _checked(read_table(_table_extension(hdus)))
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not a text file in UTF-8.") from error
    if not text.strip():
        raise ValueError(f"{path} is empty.")
    try:
        table = QTable.read(text.splitlines(), format=f"ascii.{suffix[1:]}")
    except Exception as error:
        # What astropy raises on a broken table is not restricted to a few types.
        reason = str(error).strip().split("\n")[0]
        raise ValueError(
            f"{path} is not a readable {suffix[1:].upper()} table: {reason}"
        ) from error
    try:
        return _checked(table)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def write_sources(table: Table, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a source table to an ECSV, FITS or CSV file, told apart by the name's ending.

    Parameters
    ----------
    table : astropy.table.Table
        A source table.
    path : path-like
        The file: ``.ecsv``, ``.fits`` (``.fit``, ``.fts``) or ``.csv``.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the table is no valid source table, the ending is unknown, or the format cannot
        hold it: CSV has no units, so only the default ones go into it.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.
    """
    suffix = _suffix(path)
    check_sources(table)
    if suffix in FITS_SUFFIXES:
        hdus = fits.HDUList([fits.PrimaryHDU(), table_hdu(table, "SOURCES")])
        with replacing(path, SUFFIXES, overwrite=overwrite) as file:
            hdus.writeto(file, output_verify="exception", checksum=True)
        return
    text = StringIO()
    if suffix == ".csv":
        _without_units(table).write(text, format="ascii.csv")
    else:
        QTable(table).write(text, format="ascii.ecsv")
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        file.write(text.getvalue().encode())


def _suffix(path: str | os.PathLike[str]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path} is no source table; its name must end in {', '.join(SUFFIXES)}.")
    return suffix


def _table_extension(hdus: fits.HDUList) -> fits.BinTableHDU:
    tables = [hdu for hdu in hdus if isinstance(hdu, fits.BinTableHDU | fits.TableHDU)]
    if not tables:
        raise ValueError("the file holds no table.")
    return next((hdu for hdu in tables if hdu.name == "SOURCES"), tables[0])


def _checked(table: QTable) -> QTable:
    """Check a table just read; give its columns floats, default units and NaN for no value."""
    check_sources(table)
    for name, unit in DEFAULT_UNITS.items():
        if name not in table.colnames:
            continue
        column = table[name]
        given = getattr(column, "unit", None)
        values = np.array(getattr(column, "value", column), dtype=np.float64)
        mask = getattr(column, "mask", None)
        if mask is not None:
            values[np.asarray(mask)] = np.nan
        given = given or (u.dimensionless_unscaled if name in ("x", "y") else unit)
        table[name] = values if given == u.dimensionless_unscaled else values * given
    table["kind"] = [str(kind).strip() for kind in table["kind"]]
    return table


def _without_units(table: Table) -> Table:
    plain = Table()
    for name in table.colnames:
        unit = getattr(table[name], "unit", None)
        if unit is not None and unit != DEFAULT_UNITS.get(name):
            raise ValueError(
                f"column {name} is in {unit}, which a CSV file cannot say; write ECSV or FITS."
            )
        plain[name] = getattr(table[name], "value", table[name])
    return plain

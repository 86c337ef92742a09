"""Lists of fluxes in files, for populations that are drawn from them."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from astropy.io import fits
from astropy.table import QTable

from .fits_io import SUFFIXES as FITS_SUFFIXES
from .fits_table import open_fits, read_table
from .sources import FLUX_UNIT

SUFFIXES = (".ecsv", ".csv", *FITS_SUFFIXES)


def read_fluxes(path: str | os.PathLike[str]) -> Any:
    """Read the column ``flux`` of a table, which need not be a source table.

    Parameters
    ----------
    path : path-like
        An ECSV (``.ecsv``), CSV (``.csv``) or FITS (``.fits``, ``.fit``, ``.fts``) file; of
        FITS the first extension that has the column.

    Returns
    -------
    Quantity or Magnitude, shape (n,)
        In the column's unit, which may be AB magnitudes; without one in erg s-1 cm-2 A-1.
        Empty cells are NaN.

    Raises
    ------
    ValueError
        If the file is broken, its name has an unknown ending, or it has no column of numbers
        of that name; the message names the file.
    OSError
        If the file cannot be opened.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path} is no table; its name must end in {', '.join(SUFFIXES)}.")
    table = _fits_table(path) if suffix in FITS_SUFFIXES else _text_table(path, suffix[1:])
    if "flux" not in table.colnames:
        names = ", ".join(table.colnames) or "none"
        raise ValueError(f"{path} has no column flux; its columns are: {names}.")
    column = table["flux"]
    try:
        values = np.array(getattr(column, "value", column), dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{path}: the column flux does not hold numbers.") from None
    values[np.asarray(getattr(column, "mask", False)) & np.ones(values.shape, bool)] = np.nan
    return values * (getattr(column, "unit", None) or FLUX_UNIT)


def _fits_table(path: str | os.PathLike[str]) -> QTable:
    with open_fits(path) as hdus:
        tables = [hdu for hdu in hdus if isinstance(hdu, fits.BinTableHDU | fits.TableHDU)]
        if not tables:
            raise ValueError("the file holds no table.")
        return read_table(next((hdu for hdu in tables if "flux" in hdu.columns.names), tables[0]))


def _text_table(path: str | os.PathLike[str], form: str) -> QTable:
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise type(error)(f"cannot read {path}: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not a text file in UTF-8.") from error
    try:
        return QTable.read(text.splitlines(), format=f"ascii.{form}")
    except Exception as error:
        # What astropy raises on a broken table is not restricted to a few types.
        reason = str(error).strip().split("\n")[0]
        raise ValueError(f"{path} is not a readable {form.upper()} table: {reason}") from error

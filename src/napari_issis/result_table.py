"""Tables of results as ECSV or CSV files."""

from __future__ import annotations

import os
from io import StringIO

from astropy.table import QTable, Table

from .safe_write import replacing

SUFFIXES = (".ecsv", ".csv")


def write_table(table: Table, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a table of results, such as that of `napari_issis.aperture_photometry`.

    Parameters
    ----------
    table : astropy.table.Table
        The table.
    path : path-like
        The file: ``.ecsv`` keeps units and options, ``.csv`` the numbers alone.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the name has another ending.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.
    """
    text = StringIO()
    if str(path).lower().endswith(".csv"):
        plain = Table({name: getattr(table[name], "value", table[name]) for name in table.colnames})
        plain.write(text, format="ascii.csv")
    else:
        QTable(table).write(text, format="ascii.ecsv")
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        file.write(text.getvalue().encode("utf-8"))

"""Tables in text files, ECSV and CSV, of which nothing is believed before it was looked at.

An ECSV file begins with YAML, which can name Python objects and refer to itself: only the tags
that astropy writes for columns are let through, and no references within references.
"""

from __future__ import annotations

import os
import re
from itertools import takewhile

import numpy as np
import yaml
from astropy.table import QTable

from .reading import open_file

# Beyond these, a text file is better a FITS one.
MOST_BYTES = 256 * 2**20
# Text columns are as wide as their longest cell: characters times rows.
MOST_CHARACTERS = 2**28
MOST_COLUMNS = 2000
# YAML is read slowly: this takes about a second.
MOST_HEADER = 100_000
DEEPEST = 20
DECIMAL = re.compile(r"[+-]?\d+(,\d*)?([eE][+-]?\d+)?")
TAGS = (
    *(
        f"tag:yaml.org,2002:{name}"
        for name in ["omap", "map", "seq", "str", "int", "float", "bool", "null"]
    ),
    *("!astropy.table.SerializedColumn", "!astropy.units.Unit", "!astropy.units.Quantity"),
    *("!astropy.coordinates.Angle", "!astropy.coordinates.Longitude"),
    *("!astropy.coordinates.Latitude", "!numpy.bool", "!numpy.float64", "!numpy.int64"),
)


def read_text_table(path: str | os.PathLike[str], kind: str) -> QTable:
    """Read a table from a text file in UTF-8.

    Parameters
    ----------
    path : path-like
        The file.
    kind : {"ecsv", "csv"}
        Its format.

    Raises
    ------
    ValueError
        If the file is empty, no text, too large, or no such table.
    OSError
        If the file cannot be opened.
    """
    lines = _lines(read_text(path))
    rows = len(lines)
    longest = max(len(line) for line in lines)
    if longest * rows > MOST_CHARACTERS and longest > 10_000:
        raise ValueError(f"its longest line has {longest} characters, too many for {rows} rows.")
    if kind == "ecsv":
        _check_yaml(lines)
    start = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    separator = _separator(start) if kind == "csv" else ","
    columns = max(len(start.split()), 1 + start.count(separator))
    if columns > MOST_COLUMNS:
        raise ValueError(f"it has {columns} columns; {MOST_COLUMNS} at most.")
    if separator == ",":
        return QTable.read(lines, format=f"ascii.{kind}")
    table = QTable.read(lines, format="ascii.csv", delimiter=separator)
    for name in table.colnames:
        _read_decimal_commas(table, name)
    return table


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a text file in UTF-8.

    Raises
    ------
    ValueError
        If the file is empty, too large or no text.
    OSError
        If the file cannot be opened.
    """
    with open_file(path) as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"{path} has more than {MOST_BYTES} bytes; make it a FITS table.")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is not a text file in UTF-8.") from error
    if "\0" in text:
        raise ValueError(f"{path} is not a text file in UTF-8.")
    if not text.strip():
        raise ValueError(f"{path} is empty.")
    return text


def _separator(header: str) -> str:
    """Tell what separates columns: semicolons or tabs where the header has no comma."""
    return next((one for one in ",;\t" if one in header), ",")


def _read_decimal_commas(table: QTable, name: str) -> None:
    """Make numbers of a column such as 20,5; spreadsheets in many languages write so."""
    cells = [str(cell).strip() for cell in table[name]]
    numbers = [cell.replace(",", ".") for cell in cells if DECIMAL.fullmatch(cell)]
    if len(numbers) == len(cells) and any("," in cell for cell in cells):
        table[name] = np.array(numbers, dtype=np.float64)


def _lines(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").rstrip("\n").split("\n")


def _check_yaml(lines: list[str]) -> None:
    comments = takewhile(lambda line: line.lstrip().startswith("#"), lines)
    header = "\n".join(line.lstrip()[1:].removeprefix(" ") for line in comments)
    if len(header) > MOST_HEADER:
        raise ValueError(f"its header has more than {MOST_HEADER} characters.")
    depth = anchored = 0
    for event in yaml.parse(header.partition("\n")[2], Loader=yaml.SafeLoader):
        tag = getattr(event, "tag", None)
        if tag is not None and tag not in TAGS:
            raise ValueError(f"its header names the tag {tag[:80]}, which is no table's.")
        if isinstance(event, yaml.AliasEvent) and anchored:
            # Such references may stand for exponentially many.
            raise ValueError("its header has references within references.")
        if isinstance(event, yaml.SequenceStartEvent | yaml.MappingStartEvent):
            depth += 1
            if event.anchor and not anchored:
                anchored = depth
        elif isinstance(event, yaml.SequenceEndEvent | yaml.MappingEndEvent):
            if depth == anchored:
                anchored = 0
            depth -= 1
        if depth > DEEPEST:
            raise ValueError(f"its header is nested more than {DEEPEST} deep.")

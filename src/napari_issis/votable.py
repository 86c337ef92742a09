"""Tables in VOTable files; nothing is fetched from elsewhere and no entity is expanded."""

from __future__ import annotations

import os
import warnings
from io import BytesIO
from math import prod
from typing import Any
from xml.parsers import expat

import astropy.units as u
import numpy as np
from astropy.io.votable import from_table, parse
from astropy.table import QTable, Table

from .reading import open_file
from .text_tables import MOST_BYTES, MOST_CHARACTERS, MOST_COLUMNS

SUFFIXES = (".vot", ".votable", ".xml")
DEEPEST = 50


def read_votable(path: str | os.PathLike[str]) -> QTable:
    """Read the first table of a VOTable file.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    astropy.table.QTable
        Columns have the fields' names, or identifiers where two names are the same.

    Raises
    ------
    ValueError
        If the file is empty, too large, no VOTable, or names entities or other files.
    OSError
        If the file cannot be opened.
    """
    with open_file(path) as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"it has more than {MOST_BYTES} bytes; make it a FITS table.")
    _Claims(content).check()
    votable = parse(BytesIO(content), verify="ignore", unit_format=None)
    table = next(votable.iter_tables(), None)
    if table is None:
        raise ValueError("it holds no table.")
    return QTable(table.to_table(use_names_over_ids=True))


def votable_bytes(table: Table) -> bytes:
    """Write a table as a VOTable of version 1.4.

    Parameters
    ----------
    table : astropy.table.Table
        Columns of numbers or text. VOTables have no unit for AB magnitudes: they become
        magnitudes, which `read_votable`'s callers take for AB ones.

    Raises
    ------
    ValueError
        If a VOTable cannot hold a column or its unit; the message names it.
    """
    plain = Table()
    for name in table.colnames:
        column = table[name]
        unit = getattr(column, "unit", None)
        if unit == u.ABmag:
            unit = u.mag
        elif hasattr(unit, "physical_unit"):
            raise ValueError(f"column {name} is in {unit}, which VOTables have not; write ECSV.")
        values = getattr(column, "value", column)
        dtype = getattr(values, "dtype", np.dtype(object))
        text = dtype.kind == "O" and all(isinstance(value, str) for value in values)
        if dtype.kind not in "biufcUS" and not text:
            raise ValueError(
                f"column {name} is neither numbers nor text; remove it to save the table."
            )
        plain[name] = np.asarray(values, dtype=str) if text else values
        plain[name].unit = unit
    file = BytesIO()
    with warnings.catch_warnings():
        # VOUnit calls erg and angstrom outdated, and knows both.
        warnings.simplefilter("ignore")
        from_table(plain).to_xml(file)
    return file.getvalue()


class _Claims:
    """What a VOTable claims, read element by element without keeping any."""

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.depth = self.rows = self.claimed = self.fields = self.longest = self.letters = 0
        self.width = 0
        self.root = ""

    def check(self) -> None:
        if self.content[:2] in (b"\xfe\xff", b"\xff\xfe") or b"\0" in self.content[:200]:
            raise ValueError("it is not in UTF-8.")
        parser = expat.ParserCreate()
        parser.StartElementHandler = self.start
        parser.EndElementHandler = self.end
        parser.CharacterDataHandler = self.text
        parser.EntityDeclHandler = self.entity
        parser.buffer_text = True
        try:
            parser.Parse(self.content, True)
        except expat.ExpatError as error:
            raise ValueError(str(error)) from error
        if self.claimed > max(self.rows, len(self.content)):
            raise ValueError(f"it claims {self.claimed} rows, which it does not hold.")
        rows = max(self.rows, self.claimed)
        if max(self.longest, self.width) * rows > MOST_CHARACTERS:
            raise ValueError(f"its cells are too long for a table of {rows} rows.")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        name = name.rpartition(":")[2]
        self.letters = 0
        self.depth += 1
        if not self.root:
            self.root = name
            if name != "VOTABLE":
                raise ValueError(f"its root element is {name[:40]}, not VOTABLE.")
        if self.depth > DEEPEST:
            raise ValueError(f"its elements are nested more than {DEEPEST} deep.")
        if name == "TR":
            self.rows += 1
        elif name == "TABLE":
            self.claimed += _whole(attributes.get("nrows", "0"), "nrows")
        elif name == "FIELD":
            self.field(attributes.get("arraysize", "1"))
        elif name in ("FITS", "PARQUET"):
            raise ValueError(f"its table is in {name}, not in XML; save it as another format.")
        elif name == "STREAM" and (
            "href" in attributes or attributes.get("encoding", "base64") != "base64"
        ):
            raise ValueError("its data lie elsewhere or are packed; save it with the data inside.")

    def field(self, arraysize: str) -> None:
        self.fields += 1
        if self.fields > MOST_COLUMNS:
            raise ValueError(f"it has more than {MOST_COLUMNS} columns.")
        sizes = arraysize.replace("*", "").strip("x, ").split("x")
        self.width += prod(_whole(size, "arraysize") for size in sizes if size)

    def end(self, name: str) -> None:
        self.depth -= 1

    def text(self, text: str) -> None:
        self.letters += len(text)
        self.longest = max(self.longest, self.letters)

    def entity(self, *declaration: Any) -> None:
        raise ValueError("it declares entities, which no table needs.")


def _whole(text: str, name: str) -> int:
    if not text.strip().isdecimal() or len(text) > 12:
        raise ValueError(f"its {name} is {text[:40]!r}; it must be a whole number.")
    return int(text)

"""The columns of the source list: what is shown, and how it is read when it is typed."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from astropy import units as u
from astropy.table import QTable
from numpy.typing import NDArray

from ..observation import Observation
from ..source_counts import expected_counts, signal_to_noise
from ..source_rates import flux_pivot, flux_pivots, rates_per_flux
from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    FLUX_UNIT,
    IMAGE,
    KINDS,
    check_sources,
    spectrum_texts,
)
from .number_field import number_text, read_number
from .table import TEXTS as MISSING
from .table import master_table, put
from .units import FLUX_LABELS, LENGTH_LABELS, Units

Array = NDArray[np.float64]
DEFAULT_INDEX = 2.0
TEXTS = ("kind", "spectrum", "image")


@dataclass(frozen=True)
class Column:
    """A column of the list.

    Parameters
    ----------
    name : str
        Name in the source table, or of a derived value.
    label : str
        Heading, less the unit.
    form : str
        Format of its numbers.
    kinds : {"all", "extended", "sersic", "image"}
        Sources that have it.
    tooltip : str
        What it is.
    editable : bool
        Whether it is a parameter of the source.
    """

    name: str
    label: str
    form: str
    kinds: str
    tooltip: str
    editable: bool = True

    def applies(self, kind: str) -> bool:
        """Whether sources of a kind have this value."""
        if self.kinds == IMAGE:
            return kind == IMAGE
        return (
            self.kinds == "all"
            or kind == "sersic"
            or (self.kinds == "extended" and kind != "point")
        )


COLUMNS = (
    Column("kind", "kind", "", "all", "Profile"),
    Column("x", "x", ".2f", "all", "Column of the centre, pixels (first pixel: 0)"),
    Column("y", "y", ".2f", "all", "Row of the centre, pixels (first pixel: 0)"),
    Column("flux", "F", ".4g", "all", "Flux averaged over the channel"),
    Column("r_half", "R½", ".4g", "extended", "Semi-major axis of the half-light ellipse"),
    Column("ellipticity", "ε", ".3f", "extended", "Ellipticity 1 − b/a"),
    Column("pa", "PA", ".1f", "extended", "Position angle, from up counter-clockwise"),
    Column("n", "n", ".3g", "sersic", "Sérsic index"),
    Column("counts", "counts", ".4g", "all", "Counts in the exposure, all its light", False),
    Column("snr", "S/N", ".3g", "all", "Signal-to-noise ratio, alone on the sky", False),
    Column(
        "spectrum",
        "spectrum",
        "",
        "all",
        "flat, powerlaw(-1.5), blackbody(30000 K), line(1550 A, 10 A) or table(star.ecsv); with "
        "z=, ebv= and at= (angstrom), where F is given",
    ),
    Column("image", "image", "", IMAGE, "Image that the source is: file and digest", False),
)


def heading(column: Column, units: Units) -> str:
    """Label of a column with its unit."""
    unit = {
        "x": "px",
        "y": "px",
        "flux": units.flux_label,
        "r_half": units.length_label,
        "pa": "°",
    }.get(column.name)
    return column.label if unit is None else f"{column.label} ({unit})"


def shown_values(table: QTable, observation: Observation, units: Units) -> dict[str, Any]:
    """Values of all columns in the units shown, each of shape (n,); NaN where there is none."""
    pivot = flux_pivots(table, observation)
    texts = spectrum_texts(table)
    arrays = check_sources(table, pivot=pivot, pixel_scale=observation.pixel_scale)
    extended = arrays.kind != "point"
    return {
        "kind": arrays.kind,
        "x": arrays.x,
        "y": arrays.y,
        "flux": units.show_flux(arrays.flux, pivot),
        "r_half": np.where(
            extended, units.show_length(arrays.r_half, observation.pixel_scale), np.nan
        ),
        "ellipticity": np.where(extended, arrays.ellipticity, np.nan),
        "pa": np.where(extended, arrays.pa, np.nan),
        "n": np.where(arrays.kind == "sersic", arrays.index, np.nan),
        "counts": expected_counts(table, observation),
        "snr": signal_to_noise(table, observation),
        "spectrum": np.full(len(table), "flat") if texts is None else texts,
        "image": arrays.image,
    }


def text(column: Column, value: Any) -> str:
    """Return a value as the list shows it."""
    if column.name in TEXTS:
        return str(value)
    return "–" if np.isnan(value) else f"{value:{column.form}}"


def exact_text(column: Column, value: Any) -> str:
    """Return a value with all its digits, as it is edited and copied; empty if there is none."""
    if column.name in TEXTS:
        return str(value)
    return "" if np.isnan(value) else number_text(float(value))


def changed(
    table: QTable, row: int, name: str, typed: str, observation: Observation, units: Units
) -> QTable:
    """Return the table with one value changed to what was typed.

    Raises
    ------
    ValueError
        If it is no number, or not allowed; the message names column and value.
    """
    one = table[[row]]
    if name == "kind":
        if typed in KINDS:
            one = of_kind(one, typed)
        else:
            one["kind"] = np.array([typed])
    elif name == "spectrum":
        if typed.strip() or "spectrum" in table.colnames:
            put(one, name, 0, typed.strip() or "flat")
    else:
        _set(one, name, read_number(name, typed), observation, units)
    try:
        check_sources(one)
        rates_per_flux(one, observation)
    except (ImportError, ValueError) as error:
        raise ValueError(str(error).removeprefix("row 0, ")) from None
    table = table.copy()
    for column in one.colnames:
        put(table, column, row, one[column][0])
    return table


def _set(one: QTable, name: str, number: float, observation: Observation, units: Units) -> None:
    if name == "flux":
        texts = spectrum_texts(one)
        pivot = flux_pivot("" if texts is None else str(texts[0]), observation)
        unit = one["flux"].unit
        flux = units.read_flux(number, pivot)
        if flux == 0 and unit != FLUX_UNIT:
            raise ValueError(f"flux is 0, which cannot be given in {unit}; give one above 0.")
        value = u.Quantity([flux], FLUX_UNIT)
        # the conversion costs several ms, also to the same unit
        one["flux"] = (
            value if unit == FLUX_UNIT else value.to(unit, u.spectral_density(pivot * u.AA))
        )
    elif name == "r_half":
        one["r_half"] = [units.read_length(number, observation.pixel_scale)] * u.pix
    elif name == "pa":
        one["pa"] = [number] * u.deg
    else:
        one[name] = [number]


def of_kind(rows: QTable, kind: str) -> QTable:
    """Return rows of a master table as sources of a kind, with defaults for what they lack."""
    rows = rows.copy()
    rows["kind"] = np.full(len(rows), kind, dtype="U13")
    r_half, ellipticity = rows["r_half"].to_value(u.pix), np.asarray(rows["ellipticity"])
    pa = rows["pa"].to_value(u.deg)
    sized = np.isfinite(r_half) & (r_half > 0)
    shaped = (ellipticity >= 0) & (ellipticity < 1)
    rows["r_half"] = np.where(sized, r_half, DEFAULT_R_HALF) * u.pix
    rows["ellipticity"] = np.where(shaped, ellipticity, DEFAULT_ELLIPTICITY)
    rows["pa"] = np.where(np.isfinite(pa), pa, DEFAULT_PA) * u.deg
    if kind == "sersic":
        index = np.asarray(rows["n"]) if "n" in rows.colnames else np.full(len(rows), np.nan)
        rows["n"] = np.where(np.isfinite(index), index, DEFAULT_INDEX)
    return rows


# ---------------------------------------------------------------- text of spreadsheets

_NAMES = {"type": "kind", "f": "flux", "flux": "flux", "r1/2": "r_half", "e": "ellipticity"}
_NAMES |= {column.name: column.name for column in COLUMNS if column.editable}
_NAMES |= {column.label.lower(): column.name for column in COLUMNS}
_UNITS = {label.lower(): ("flux", name) for name, label in FLUX_LABELS.items()}
_UNITS |= {label.lower(): ("length", name) for name, label in LENGTH_LABELS.items()}
_UNITS |= {"arcsec": ("length", "arcsec"), "pix": ("length", "px")}


def to_text(
    values: Mapping[str, Any], rows: Any, units: Units, columns: Sequence[Column] = COLUMNS
) -> str:
    """Rows of the list as tab-separated text under their headings."""
    lines = ["\t".join(heading(column, units) for column in columns)]
    lines += [
        "\t".join(exact_text(column, values[column.name][row]) for column in columns)
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def from_text(pasted: str, observation: Observation, units: Units) -> QTable:
    """Read sources from text, as a spreadsheet or `to_text` gives it.

    Parameters
    ----------
    pasted : str
        Cells separated by tabs, semicolons or commas. The first line may hold the names of
        the columns, with units in parentheses; else they are those of the list, in its order.
    observation : Observation
        Gives the wavelength at which magnitudes are fluxes.
    units : Units
        Units of columns that name none.

    Returns
    -------
    astropy.table.QTable
        A master table. Sources without a kind are points; other missing columns have the
        defaults of `napari_issis.source`.

    Raises
    ------
    ValueError
        If there is no source, or a value is wrong; the message names line and column.
    """
    lines = [line for line in pasted.splitlines() if line.strip()]
    if not lines:
        raise ValueError("there is no text to paste; copy rows of a list of sources first.")
    mark = next((mark for mark in "\t;," if mark in lines[0]), "\t")
    cells = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    names = [column.name for column in COLUMNS]
    units = Units(units.flux, units.length)
    has_head = any(_split(cell)[0] in ("x", "flux") for cell in cells[0])
    if has_head:
        names = []
        for cell in cells.pop(0):
            name, unit = _split(cell)
            names.append(name)
            if unit in _UNITS:
                setattr(units, *_UNITS[unit])
    rows = []
    first = 2 if has_head else 1
    for number, line in enumerate(cells, start=first):
        row = {name: cell for name, cell in zip(names, line, strict=False) if cell not in ("", "–")}
        try:
            rows.append(_row(row, observation, units))
        except ValueError as error:
            raise ValueError(f"line {number} of the text: {error}") from None
    if not rows:
        raise ValueError("the text holds no source; it has headings only.")
    named = {name: None for row in rows for name in row}
    columns = {name: np.array([row.get(name, MISSING.get(name)) for row in rows]) for name in named}
    columns["flux"] = columns["flux"] * FLUX_UNIT
    columns["r_half"] = columns["r_half"] * u.pix
    columns["pa"] = columns["pa"] * u.deg
    try:
        return master_table(QTable(columns))
    except ValueError as error:
        raise ValueError(
            re.sub(r"^row (\d+)", lambda m: f"line {int(m[1]) + first} of the text", str(error))
        ) from None


def _split(cell: str) -> tuple[str, str]:
    """Name of a column and its unit from a heading."""
    name, _, unit = cell.lower().partition("(")
    return _NAMES.get(name.strip(), name.strip()), unit.rstrip(") ").strip()


def _row(row: dict[str, str], observation: Observation, units: Units) -> dict[str, Any]:
    for name in ("x", "y"):
        if name not in row:
            raise ValueError(f"{name} is missing.")

    def number(name: str, default: float) -> float:
        return read_number(name, row[name]) if name in row else default

    texts = {name: row[name] for name in MISSING if name in row}
    try:
        pivot = flux_pivot(row.get("spectrum", ""), observation)
    except ValueError as error:
        raise ValueError(f"spectrum: {error}") from None
    flux = units.read_flux(number("flux", 0.0), pivot) if "flux" in row else DEFAULT_FLUX
    r_half = number("r_half", np.nan)
    return {
        "kind": row.get("kind", "point"),
        "x": number("x", 0.0),
        "y": number("y", 0.0),
        "flux": flux,
        "r_half": DEFAULT_R_HALF
        if np.isnan(r_half)
        else units.read_length(r_half, observation.pixel_scale),
        "ellipticity": number("ellipticity", DEFAULT_ELLIPTICITY),
        "pa": number("pa", DEFAULT_PA),
        "n": number("n", np.nan),
        **texts,
    }

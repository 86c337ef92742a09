"""The master source table of a scene: float64, in pixels and degrees, rows can be joined."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy import units as u
from astropy.table import QTable, Table, vstack
from numpy.typing import NDArray

from ..instruments import PIXEL_SCALE
from ..sources import FLUX_UNIT, IMAGE, check_sources, image_texts, spectrum_texts

# Columns of text that a table may lack, and what a source then has.
TEXTS = {"spectrum": "flat", IMAGE: ""}
STRUCTURE_UNITS = {"r_half": u.pix, "ellipticity": None, "pa": u.deg}


def master_table(table: Table, pixel_scale: float = PIXEL_SCALE) -> QTable:
    """Return a checked copy of a source table that can be edited cell by cell.

    Positions, radii and angles become float64 in pixels and degrees; the flux keeps its unit
    (AB magnitudes included). Columns of the structure that a table of points lacks are
    filled with NaN. Further columns are kept.

    Parameters
    ----------
    table : astropy.table.Table
        A source table.
    pixel_scale : float
        Arcsec per pixel, for radii given as angles.

    Raises
    ------
    ValueError
        If the table is not a source table; the message names row, column and value.
    """
    try:
        arrays = check_sources(table, pixel_scale=pixel_scale)
    except ImportError as error:
        # of a library for spectra: in the GUI an error like any other of the table
        raise ValueError(str(error)) from error
    master = QTable(table, copy=True)
    extended = arrays.kind != "point"
    width = int(np.char.str_len(arrays.kind).max(initial=13))
    master["kind"] = arrays.kind.astype(f"U{width}")
    master["x"], master["y"] = arrays.x, arrays.y
    flux = table["flux"]
    unit = getattr(flux, "unit", None) or FLUX_UNIT
    master["flux"] = np.array(getattr(flux, "value", flux), dtype=np.float64) * unit
    for name, unit in STRUCTURE_UNITS.items():
        values = np.where(extended, getattr(arrays, name), _plain(table, name, unit))
        master[name] = values if unit is None else values * unit
    if "n" in table.colnames:
        sersic = arrays.kind == "sersic"
        master["n"] = np.where(sersic, arrays.index, _plain(table, "n", None))
    texts = spectrum_texts(table)
    if texts is not None:
        master["spectrum"] = np.array([text or "flat" for text in texts], dtype=np.str_)
    texts = image_texts(table)
    if texts is not None:
        master["image"] = texts
    return master


def put(table: QTable, name: str, rows: Any, values: Any) -> None:
    """Put values into rows of a column, which is made if the table lacks it.

    Other sources then have no number there, the flat spectrum, no image. Text of any length
    fits.
    """
    if name in TEXTS:
        texts = table[name] if name in table.colnames else np.full(len(table), TEXTS[name])
        column = np.asarray(texts).astype(object)
        column[rows] = values
        table[name] = np.array([str(text) for text in column], dtype=np.str_)
        return
    if name not in table.colnames:
        table[name] = np.full(len(table), np.nan)
    table[name][rows] = values


def join(first: QTable, second: QTable, *, pivot: float | NDArray[np.float64]) -> QTable:
    """Append the rows of one master table to another.

    The flux of the second is converted to the unit of the first at the wavelength ``pivot``
    (angstrom, one number or one for each row) where they differ.

    Raises
    ------
    ValueError
        If a flux of zero would have to become a magnitude.
    """
    if len(first) == 0:
        return second.copy()
    if len(second) == 0:
        return first.copy()
    first, second = first.copy(), second.copy()
    unit = first["flux"].unit
    if second["flux"].unit != unit:
        with np.errstate(divide="ignore"):
            flux = second["flux"].to(unit, u.spectral_density(pivot * u.AA))
        if not np.all(np.isfinite(flux.value)):
            raise ValueError(
                f"the sources of this scene are in {unit}, in which a flux of 0 has no value; "
                "give a flux above 0."
            )
        second["flux"] = flux
    for one, other in ((first, second), (second, first)):
        if "n" in other.colnames and "n" not in one.colnames:
            one["n"] = np.full(len(one), np.nan)
        for name, text in TEXTS.items():
            if name in other.colnames and name not in one.colnames:
                one[name] = np.full(len(one), text)
    return vstack([first, second], metadata_conflicts="silent")


def _plain(table: Table, name: str, unit: u.UnitBase | None) -> np.ndarray:
    """Values of a column that need not be valid (NaN where they are no plain numbers)."""
    nothing = np.full(len(table), np.nan)
    if name not in table.colnames:
        return nothing
    column = table[name]
    mask = np.asarray(getattr(column, "mask", False))
    try:
        if unit is not None and getattr(column, "unit", None) is not None:
            column = u.Quantity(column).to(unit)
        values = np.array(getattr(column, "value", column), dtype=np.float64)
    except (TypeError, ValueError, u.UnitConversionError):
        return nothing
    return np.where(mask, np.nan, values)

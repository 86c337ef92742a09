"""From the table of any catalogue to a source table, with an account of what was understood."""

from __future__ import annotations

import re
from typing import Any

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.table import QTable, Table
from astropy.time import Time
from numpy.typing import NDArray

from .catalogue_columns import KINDS_ELSEWHERE, Meaning, meanings
from .frame_coordinates import sky_to_frame
from .observation import Observation
from .sources import COLUMNS, FLUX_UNIT, IMAGE, KINDS, check_sources

Array = NDArray[np.float64]

OWN = (*COLUMNS, "n", "spectrum", "image")
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
MOST_COLUMNS = 2000
# Catalogues write 99 for a magnitude that was not measured.
FAINTEST = 40.0
_SEXAGESIMAL = re.compile(
    r"\s*([+-]?)(\d{1,3})(?:[:hd°]\s*|\s+)(\d{1,2})(?:[:m'′]\s*|\s+)(\d{1,2}(?:\.\d*)?)[s\"″]?\s*"
)


def to_sources(table: Table, observation: Observation | None) -> tuple[QTable, tuple[str, ...]]:
    """Make a source table of a catalogue.

    Parameters
    ----------
    table : astropy.table.Table
        The catalogue; see `napari_issis.catalogue_columns` for the names that are understood.
    observation : Observation, optional
        The frame into which positions on the sky are put, and the channel whose magnitudes
        are taken where a catalogue has several.

    Returns
    -------
    sources : astropy.table.QTable
        The checked source table, in the order of the catalogue's columns; those that were not
        understood are kept as they are.
    notes : tuple of str
        What was taken for what, a line each.

    Raises
    ------
    ValueError
        If something is missing or out of range; the message names the row, column and value.
    """
    if len(table.colnames) > MOST_COLUMNS:
        raise ValueError(f"the table has {len(table.colnames)} columns; {MOST_COLUMNS} at most.")
    reading = _Reading(_plain_columns(table), observation)
    reading.position()
    reading.flux()
    reading.shape()
    reading.kind()
    reading.texts("spectrum")
    if IMAGE in reading.new["kind"]:
        reading.texts("image")
    return reading.result()


class _Reading:
    """One catalogue on its way to a source table."""

    def __init__(self, plain: tuple[QTable, list[str]], observation: Observation | None) -> None:
        self.table, self.notes = plain
        self.observation = observation
        self.found = meanings(self.table)
        self.new: dict[str, Any] = {}
        # Columns of the catalogue and the quantities that stand in their place.
        self.place: dict[str, list[str]] = {}
        # Of each source, where its position is one on the sky.
        self.north: Array | None = None

    def put(self, name: str, values: Any, *columns: str) -> None:
        self.new[name] = values
        used = [column for column in columns if column not in self.place]
        self.place.update({column: [] for column in used})
        if columns:
            self.place[columns[0]].append(name)

    def note(self, before: str, after: str, how: str = "") -> None:
        if before != after or how:
            self.notes.append(f"{before} -> {after}{f' ({how})' if how else ''}")

    def position(self) -> None:
        found, observation = self.found, self.observation
        pointing = None if observation is None else observation.pointing
        sky = {"ra", "dec"} <= found.keys()
        if not {"x", "y"} <= found.keys() and sky and pointing is not None:
            assert observation is not None
            ra, dec = found["ra"], found["dec"]
            x, y, self.north = sky_to_frame(
                self.degrees(ra, right_ascension=True), self.degrees(dec), observation
            )
            self.put("x", x, ra.column, dec.column)
            self.put("y", y, ra.column)
            self.note(
                f"{ra.column}, {dec.column}",
                "x, y",
                f"ICRS, by the frame's centre {pointing.to_string(precision=5)} "
                f"and roll {observation.roll:g}",
            )
            ny, nx = observation.shape
            inside = (np.abs(x - (nx - 1) / 2) <= nx / 2) & (np.abs(y - (ny - 1) / 2) <= ny / 2)
            self.notes.append(f"{inside.sum()} of {x.size} sources lie in the frame")
            return
        for suffix, first in (("", 0), (" from 1", 1)):
            if {f"x{suffix}", f"y{suffix}"} <= found.keys():
                names = []
                for axis in "xy":
                    meaning = found[axis + suffix]
                    values = self.numbers(meaning, required=True) - first
                    if meaning.unit not in (None, u.pix, u.dimensionless_unscaled):
                        values = values * meaning.unit
                    elif meaning.unit == u.pix:
                        values = values * u.pix
                    self.put(axis, values, meaning.column)
                    names.append(meaning.column)
                how = "pixels counted from 1, less 1" if first else ""
                self.note(", ".join(names), "x, y", how)
                return
        if sky:
            raise ValueError(
                f"the positions are {found['ra'].column}, {found['dec'].column} and the frame has "
                "no position on the sky; give the observation a pointing."
            )
        missing = ", ".join(axis for axis in "xy" if axis not in found)
        raise ValueError(
            f"the source table has no column {missing}; it needs x and y, or ra and dec."
        )

    def flux(self) -> None:
        found = self.found
        channel = "NUV" if self.observation is None else self.observation.channel
        where = f"at the channel's pivot wavelength, {self.pivot:.0f} A"
        for quantity in ("flux", "flux per frequency"):
            if quantity in found and (quantity == "flux" or found[quantity].unit):
                meaning = found[quantity]
                values = self.numbers(meaning, required=True)
                unit, how = meaning.unit or FLUX_UNIT, ""
                if not meaning.unit and meaning.column != "flux":
                    how = "erg s-1 cm-2 A-1"
                if unit == u.mag:
                    unit, how = u.ABmag, f"taken as AB magnitudes, {where}"
                elif isinstance(unit, u.UnitBase) and u.A in unit.bases:
                    unit, how = unit * u.A / u.AA, "A read as angstrom"
                elif not unit.is_equivalent(FLUX_UNIT):
                    how = f"from {unit} {where}"
                self.put("flux", values * unit, meaning.column)
                self.note(meaning.column, "flux", how)
                return
        for quantity in ("mag", f"mag of the {channel}"):
            if quantity in found:
                meaning = found[quantity]
                values = self.numbers(meaning, required=True)
                system = meaning.unit if hasattr(meaning.unit, "physical_unit") else None
                self.put("flux", values * (system or u.ABmag), meaning.column)
                how = f"{system or 'taken as AB magnitudes'}, {where}"
                self.note(meaning.column, "flux", how)
                faint = int((values > FAINTEST).sum())
                if faint:
                    self.notes.append(
                        f"{faint} of them above {FAINTEST:g}: does this stand for no measurement?"
                    )
                return
        raise ValueError("the source table has no column flux; it needs flux or mag.")

    def shape(self) -> None:
        found = self.found
        if "r_half" in found:
            meaning = found["r_half"]
            tractor = meaning.column.lower() == "shape_r"
            unit = meaning.unit or (u.arcsec if tractor else u.pix)
            self.put("r_half", self.numbers(meaning) * unit, meaning.column)
            how = "" if meaning.unit or meaning.column == "r_half" else f"in {unit}"
            self.note(meaning.column, "r_half", how)
        if "ellipticity" in found:
            meaning = found["ellipticity"]
            self.put("ellipticity", self.numbers(meaning), meaning.column)
            self.note(meaning.column, "ellipticity")
        elif "axis ratio" in found:
            meaning = found["axis ratio"]
            ratio = self.numbers(meaning)
            for row in np.flatnonzero((ratio <= 0) | (ratio > 1)):
                raise ValueError(
                    f"row {row}, {meaning.column}: {ratio[row]:g} is not allowed; "
                    "an axis ratio must be above 0 and at most 1."
                )
            self.put("ellipticity", 1 - ratio, meaning.column)
            self.note(meaning.column, "ellipticity", "1 - axis ratio")
        self.angle()
        if "n" in found:
            meaning = found["n"]
            self.put("n", self.numbers(meaning), meaning.column)
            self.note(meaning.column, "n", "" if meaning.column == "n" else "Sersic index")

    def angle(self) -> None:
        for quantity in ("pa", "pa on the sky", "angle from +x"):
            if quantity not in self.found:
                continue
            meaning = self.found[quantity]
            values, unit, how = self.numbers(meaning), meaning.unit or u.deg, ""
            if self.north is not None:
                values = (values * unit).to_value(u.deg) + self.north
                unit, how = u.deg, "from north through east, turned into the frame"
            elif quantity == "pa on the sky":
                continue
            elif quantity == "angle from +x":
                values = values - (90 * u.deg).to_value(unit)
                how = "from +x, less 90 degrees"
            self.put("pa", values * unit, meaning.column)
            self.note(meaning.column, "pa", how)
            return

    def kind(self) -> None:
        size = np.nan_to_num(u.Quantity(self.new["r_half"]).value) if "r_half" in self.new else None
        meaning = self.found.get("kind")
        if meaning is not None:
            given = [str(word).strip() for word in self.table[meaning.column].astype(str)]
            known = [_kind(word) for word in given]
            if meaning.column == "kind" or all(kind in KINDS for kind in known):
                self.put("kind", np.array(known, dtype=str), meaning.column)
                self.note(meaning.column, "kind")
                renamed = {f"{a} -> {b}" for a, b in zip(given, known, strict=True) if a != b}
                if renamed:
                    self.notes.append(f"in kind: {', '.join(sorted(renamed))}")
        if "kind" not in self.new:
            kinds = np.full(len(self.table), "point", dtype="U13")
            if size is not None:
                kinds[size > 0] = "exponential"
                if "n" in self.new:
                    kinds[(size > 0) & np.isfinite(self.new["n"])] = "sersic"
            self.put("kind", kinds)
            names, numbers = np.unique(kinds, return_counts=True)
            counted = [f"{n} {name}" for name, n in zip(names, numbers, strict=True)]
            self.notes.append(f"no kind: {', '.join(counted) or 'no sources'}")
        extended = self.new["kind"] != "point"
        if extended.any() and "r_half" in self.new:
            self.round_where_missing(extended)

    def texts(self, name: str) -> None:
        """Take texts in a column of just this name; numbers in it mean something else."""
        if name not in self.table.colnames:
            return
        values, mask = _unmasked(self.table[name])
        if values.dtype.kind in "US" or mask.all():
            self.put(name, np.where(mask, "", values.astype(str)), name)

    def round_where_missing(self, extended: NDArray[np.bool_]) -> None:
        """Take galaxies for round where the catalogue says nothing of their shape."""
        if "ellipticity" not in self.new:
            self.put("ellipticity", np.zeros(len(self.table)))
            self.notes.append("no ellipticity: round")
        if "pa" not in self.new:
            flat = extended & (self.new["ellipticity"] > 0)
            for row in np.flatnonzero(flat):
                raise ValueError(
                    f"the source table has no column pa, which row {row} with the ellipticity "
                    f"{self.new['ellipticity'][row]:g} needs."
                )
            self.put("pa", np.zeros(len(self.table)) * u.deg)

    def result(self) -> tuple[QTable, tuple[str, ...]]:
        table = QTable(meta=self.table.meta)
        added = [name for name in self.new if not any(name in at for at in self.place.values())]
        if "kind" in added:
            table["kind"] = self.new["kind"]
        kept = []
        for column in self.table.colnames:
            for name in self.place.get(column, ()):
                table[name] = self.new[name]
            if column not in self.place:
                name = f"{column}_catalogue" if column in OWN else column
                while name in self.new or name in table.colnames:
                    name += "_"
                table[name] = self.table[column]
                kept.append(column if name == column else f"{column} (as {name})")
        for name in added:
            if name != "kind":
                table[name] = self.new[name]
        if kept:
            columns = "column" if len(kept) == 1 else "columns"
            named = ", ".join(kept[:20]) + (", ..." if len(kept) > 20 else "")
            self.notes.append(f"{len(kept)} further {columns} kept: {named}")
        scale = (self.observation or Observation()).pixel_scale
        check_sources(table, pivot=self.pivot, pixel_scale=scale)
        return table, tuple(self.notes)

    @property
    def pivot(self) -> float:
        observation = self.observation or Observation()
        return observation.pivot

    def numbers(self, meaning: Meaning, *, required: bool = False) -> Array:
        """Values of a column as plain floats, NaN where there is none."""
        values, mask = _unmasked(self.table[meaning.column])
        if values.dtype.kind in "US":
            values = np.char.strip(values.astype(str))
            mask = mask | (values == "")
            values = np.where(mask, "nan", values)
        for missing in np.flatnonzero(mask) if required else ():
            raise ValueError(f"row {missing}, {meaning.column}: the value is missing.")
        try:
            numbers = np.array(values, dtype=np.float64)
        except (TypeError, ValueError):
            for row, value in enumerate(values):
                try:
                    float(value)
                except (TypeError, ValueError):
                    raise ValueError(
                        f"row {row}, {meaning.column}: {str(value)[:40]!r} is not a number."
                    ) from None
            raise ValueError(f"column {meaning.column} is not of numbers.") from None
        numbers[mask] = np.nan
        return numbers

    def degrees(self, meaning: Meaning, *, right_ascension: bool = False) -> Array:
        """Angles in degrees; sexagesimal text of a right ascension is in hours."""
        values, mask = _unmasked(self.table[meaning.column])
        if values.dtype.kind in "US" and any(_SEXAGESIMAL.fullmatch(str(v)) for v in values[:1]):
            for row in np.flatnonzero(mask):
                raise ValueError(f"row {row}, {meaning.column}: the value is missing.")
            in_degrees = not right_ascension or meaning.unit == u.deg
            return np.array(
                [
                    _sexagesimal(str(value), row, meaning.column, in_degrees=in_degrees)
                    for row, value in enumerate(values)
                ]
            )
        numbers = self.numbers(meaning, required=True)
        unit = meaning.unit
        if unit is None or unit == u.dimensionless_unscaled:
            return numbers
        if unit == u.hour and right_ascension:
            unit = u.hourangle
        try:
            degrees: Array = (numbers * unit).to_value(u.deg)
        except u.UnitConversionError:
            raise ValueError(
                f"column {meaning.column} has the unit {unit}; it must be an angle."
            ) from None
        return degrees


def _kind(word: str) -> str:
    plain = word.lower().replace(" ", "").replace("_", "").replace("-", "")
    plain = KINDS_ELSEWHERE.get(plain, plain)
    return plain if plain in KINDS else word


def _unmasked(column: Any) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Plain values of a column, and which of them are missing."""
    values = getattr(column, "value", column)
    mask = getattr(values, "mask", None)
    values = np.asarray(getattr(values, "unmasked", values))
    if mask is None:
        return values, np.zeros(values.shape, dtype=bool)
    return values, np.array(mask, dtype=bool)


def _sexagesimal(text: str, row: int, column: str, *, in_degrees: bool) -> float:
    match = _SEXAGESIMAL.fullmatch(text)
    if match is None or float(match[3]) >= 60 or float(match[4]) > 60:
        raise ValueError(f"row {row}, {column}: {text[:40]!r} is no angle such as 12 34 56.7.")
    whole = int(match[2]) + float(match[3]) / 60 + float(match[4]) / 3600
    scale = 1 if in_degrees or "d" in text or "°" in text else 15
    return (-whole if match[1] == "-" else whole) * scale


def _plain_columns(table: Table) -> tuple[QTable, list[str]]:
    """Columns of numbers and text; positions on the sky in two columns; objects left out."""
    plain, left_out = QTable(meta=table.meta), []
    for name in table.colnames:
        column = table[name]
        if isinstance(column, SkyCoord):
            sky = column.icrs
            for axis, angle in (("ra", sky.ra), ("dec", sky.dec)):
                free = axis if axis not in table.colnames else f"{name}_{axis}"
                plain[free] = u.Quantity(angle).to(u.deg)
            continue
        if isinstance(column, Time):
            column = np.asarray(column.isot, dtype=str)
        if getattr(column, "dtype", None) is None or not hasattr(column, "__array__"):
            left_out.append(name)
            continue
        if column.dtype.kind == "O":
            values, mask = _unmasked(column)
            if not all(isinstance(v, str) for v in values[~mask]):
                left_out.append(name)
                continue
            column = np.ma.MaskedArray(np.where(mask, "", values).astype(str), mask)
            if not mask.any():
                column = column.data
        if column.dtype.kind not in "biufcUS":
            left_out.append(name)
            continue
        plain[name] = column
    if left_out:
        return plain, [f"left out, as they are neither numbers nor text: {', '.join(left_out)}"]
    return plain, []

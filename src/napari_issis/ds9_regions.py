"""Region files of SAOImage DS9: points, circles and ellipses."""

from __future__ import annotations

import os
import re

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.table import QTable
from numpy.typing import NDArray

from .catalogue_sources import to_sources
from .observation import Observation
from .sources import DEFAULT_FLUX, FLUX_UNIT
from .text_tables import read_text

Array = NDArray[np.float64]

SUFFIXES = (".reg",)
FRAMES = {
    "icrs": "icrs",
    "fk5": "fk5",
    "j2000": "fk5",
    "fk4": "fk4",
    "b1950": "fk4",
    "galactic": "galactic",
    "ecliptic": "barycentricmeanecliptic",
}
PIXELS = ("image", "physical")
LONGEST_LABEL = 200
_SHAPE = re.compile(r"([+-]?)\s*([a-z]+)\s*\(([^()#]*)\)?(.*)", re.IGNORECASE)
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_SEXAGESIMAL = re.compile(r"([+-]?)(\d{1,3})[:hd](\d{1,2})[:m](\d{1,2}(?:\.\d*)?)s?")
_LABEL = re.compile(r"\btext\s*=\s*(?:\{([^}]*)\}|\"([^\"]*)\"|'([^']*)')")
# Degrees in one of a DS9 length's units; p and i are pixels.
_LENGTHS = {'"': 1 / 3600, "'": 1 / 60, "d": 1.0, "r": 180 / np.pi}


def read_regions(
    path: str | os.PathLike[str], observation: Observation | None
) -> tuple[QTable, tuple[str, ...]]:
    """Read the points, circles and ellipses of a DS9 region file as sources.

    Points become point sources. Circles and ellipses become exponential ones, with the outline
    as the ellipse that holds half of the light. Regions have no flux: all get the same,
    1e-14 erg s-1 cm-2 A-1.

    Parameters
    ----------
    path : path-like
        The file.
    observation : Observation, optional
        The frame; it needs a pointing where regions are given by their position on the sky.

    Returns
    -------
    sources : astropy.table.QTable
        A source table with the regions' texts as ``name``.
    notes : tuple of str
        What was understood, a line each.

    Raises
    ------
    ValueError
        If the file holds no such region, or one is broken; the message names the line (from 1).
    OSError
        If the file cannot be opened.
    """
    pixels: list[list[float]] = []
    sky: dict[str, list[list[float]]] = {}
    names: dict[str, list[str]] = {"": []}
    others: dict[str, int] = {}
    system = "physical"
    for number, line in enumerate(read_text(path).splitlines(), 1):
        for part in _parts(line):
            word = part.lower()
            if word in PIXELS or word in FRAMES:
                system = word
                continue
            match = _SHAPE.fullmatch(part)
            if match is None:
                if re.fullmatch(r"wcs[a-z]?|linear|amplifier|detector|tile \d+", word):
                    raise ValueError(
                        f"line {number}: regions in the coordinates {word[:40]!r} cannot be read; "
                        "save them from DS9 in image or fk5 coordinates."
                    )
                raise ValueError(f"line {number}: {part[:40]!r} is no region of DS9.")
            sign, shape, inside, after = match.groups()
            shape = shape.lower()
            if sign == "-" or shape not in ("point", "circle", "ellipse"):
                what = f"excluded {shape}" if sign == "-" else shape
                others[what] = others.get(what, 0) + 1
                continue
            frame = FRAMES.get(system, "")
            values = _values(shape, inside, number, frame)
            (sky.setdefault(frame, []) if frame else pixels).append(values)
            label = _LABEL.search(after)
            texts = [text for text in label.groups() if text is not None] if label else [""]
            names.setdefault(frame, []).append(texts[0][:LONGEST_LABEL])
    if not pixels and not sky:
        raise ValueError(f"{path} holds no point, circle or ellipse.")
    notes = []
    tables = []
    if pixels and sky:
        raise ValueError(
            f"{path} mixes regions in pixels and on the sky; save them from DS9 in one system."
        )
    if pixels:
        x, y, a, b, angle = np.array(pixels).T
        tables.append(QTable({"x": x - 1, "y": y - 1, **_ellipse(a, b, angle), "name": names[""]}))
        notes.append("pixels of DS9, counted from 1, less 1")
    for frame, rows in sky.items():
        longitude, latitude, a, b, angle = np.array(rows).T
        _check_latitude(latitude)
        # The angle is one in the region's own system; north may lie elsewhere in ICRS.
        centre = SkyCoord(longitude, latitude, unit="deg", frame=frame)
        north = centre.directional_offset_by(0 * u.deg, 1e-3 * u.deg).icrs
        icrs = centre.icrs
        turned = icrs.position_angle(north).to_value(u.deg)
        ellipse = _ellipse(a * 3600, b * 3600, angle, unit=u.arcsec)
        ellipse["pa"] = ellipse["pa"] + turned * u.deg
        position = {"ra": icrs.ra.deg, "dec": icrs.dec.deg}
        tables.append(QTable({**position, **ellipse, "name": names[frame]}))
    table = tables[0]
    if len(tables) > 1:
        raise ValueError(f"{path} mixes {', '.join(sky)}; save it from DS9 in one system.")
    table["kind"] = np.where(table["r_half"].value > 0, "exponential", "point")
    table["flux"] = np.full(len(table), DEFAULT_FLUX) * FLUX_UNIT
    sources, understood = to_sources(table, observation)
    kinds = table["kind"]
    notes.append(
        f"{np.sum(kinds == 'point')} points; {np.sum(kinds != 'point')} circles and ellipses "
        "as the half-light ellipses of exponential galaxies"
    )
    notes.append(f"no fluxes: {DEFAULT_FLUX:g} erg s-1 cm-2 A-1 each")
    if others:
        left = ", ".join(f"{count} {shape[:20]}" for shape, count in list(others.items())[:10])
        notes.append(f"left out: {left}")
    return sources, (*notes, *(note for note in understood if "further" not in note))


def _parts(line: str) -> list[str]:
    """Commands of a line; a semicolon parts them unless a text holds it."""
    line = line.strip()
    if not line or line.startswith("#") or line.lower().startswith("global"):
        return []
    body, mark, comment = line.partition("#")
    parts = [part.strip() for part in body.split(";") if part.strip()]
    if mark and parts:
        parts[-1] += f" #{comment}"
    return parts


def _values(shape: str, inside: str, number: int, frame: str) -> list[float]:
    """Centre, two semi-axes and angle of a shape, in pixels or degrees."""
    words = re.split(r"[\s,]+", inside.strip())
    due = {"point": 2, "circle": 3, "ellipse": 5}[shape]
    if len(words) != due:
        raise ValueError(f"line {number}: {shape} has {len(words)} values; it must have {due}.")
    hours = frame in ("icrs", "fk5", "fk4")
    centre = [_coordinate(words[0], number, hours=hours), _coordinate(words[1], number)]
    if shape == "point":
        return [*centre, 0.0, 0.0, 0.0]
    lengths = words[2:4] if shape == "ellipse" else words[2:]
    axes = [_length(word, number, on_sky=bool(frame)) for word in lengths]
    angle = _coordinate(words[4], number) if shape == "ellipse" else 0.0
    if min(axes) <= 0:
        raise ValueError(f"line {number}: {inside[:40]!r} has an axis of no length.")
    return [*centre, axes[0], axes[-1], angle]


def _coordinate(word: str, number: int, *, hours: bool = False) -> float:
    match = _SEXAGESIMAL.fullmatch(word)
    if match:
        value = int(match[2]) + int(match[3]) / 60 + float(match[4]) / 3600
        scale = 15 if hours and "d" not in word else 1
        return (-value if match[1] == "-" else value) * scale
    if not re.fullmatch(_NUMBER + "d?", word):
        raise ValueError(f"line {number}: {word[:40]!r} is not a number.")
    return float(word.rstrip("d"))


def _length(word: str, number: int, *, on_sky: bool) -> float:
    match = re.fullmatch(rf"({_NUMBER})([\"'drpi]?)", word)
    if match is None:
        raise ValueError(f"line {number}: {word[:40]!r} is not a length.")
    unit = match[2]
    if on_sky == (unit in ("p", "i")) and unit:
        raise ValueError(
            f"line {number}: the length {word[:40]!r} and the position are in different units; "
            "save them from DS9 in one system."
        )
    return float(match[1]) * (_LENGTHS[unit or "d"] if on_sky else 1)


def _ellipse(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    angle: NDArray[np.float64],
    unit: u.UnitBase = u.pix,
) -> dict[str, u.Quantity]:
    """Half-light radius, ellipticity and position angle; DS9's angle is that of a, from +x."""
    longer, shorter = np.maximum(a, b), np.minimum(a, b)
    ellipticity = 1 - np.divide(shorter, longer, out=np.ones_like(a), where=longer > 0)
    pa = angle - np.where(b > a, 0.0, 90.0)
    return {"r_half": longer * unit, "ellipticity": ellipticity, "pa": pa * u.deg}


def _check_latitude(latitude: Array) -> None:
    for value in latitude[~(np.abs(latitude) <= 90)]:
        raise ValueError(f"{value:g} degrees is no declination or latitude.")

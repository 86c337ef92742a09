"""What the columns of a catalogue are called, and what each name means.

Names are compared without case and punctuation: ``R_1/2``, ``r12`` and ``R12`` are one name. A
unit may follow the name: ``r_e_arcsec``, ``RAdeg``, ``flux [mJy]``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import astropy.units as u
from astropy.table import Table

from .sources import COLUMNS

# Each quantity's names, the preferred ones first. Quantities of one group describe the same
# thing in another convention.
NAMES: dict[str, tuple[str, ...]] = {
    "kind": ("kind", "type", "profile", "morphology", "morphtype", "model"),
    "x": ("x", "x0", "xfit", "xcentroid", "xcenter", "xcentre", "xcen", "xpos"),
    "y": ("y", "y0", "yfit", "ycentroid", "ycenter", "ycentre", "ycen", "ypos"),
    # of programs that count pixels from 1, as FITS does
    "x from 1": ("xwinimage", "xpsfimage", "ximage"),
    "y from 1": ("ywinimage", "ypsfimage", "yimage"),
    "ra": (
        *("ra", "raj2000", "raicrs", "rightascension", "ramean"),
        *("alphaj2000", "alphawinj2000", "alphapsfj2000", "alphasky", "alpha"),
    ),
    "dec": (
        *("dec", "de", "dej2000", "decj2000", "deicrs", "decicrs", "declination", "decl"),
        *("decmean", "deltaj2000", "deltawinj2000", "deltapsfj2000", "deltasky", "delta"),
    ),
    "flux": ("flux", "fluxlambda", "flambda", "flam"),
    "flux per frequency": ("fluxnu", "fnu"),
    "mag": (
        *("mag", "abmag", "magab", "mab", "magnitude", "magtot", "magtotal"),
        *("magauto", "magpsf", "magbest"),
    ),
    "mag of the NUV": ("nuvmag", "magnuv", "nuv"),
    "mag of the FUV": ("fuvmag", "magfuv", "fuv"),
    "r_half": (
        *("rhalf", "re", "reff", "r12", "r50", "rh", "hlr", "halflightradius", "halflightrad"),
        *("effradius", "effectiveradius", "radeff", "shaper", "fluxradius"),
    ),
    "ellipticity": ("ellipticity", "e", "ell", "ellip", "eps", "epsilon"),
    "axis ratio": ("q", "axisratio", "axratio", "ba", "boa"),
    "pa": ("pa", "positionangle", "posangle", "posang"),
    "pa on the sky": ("pasky", "thetaj2000", "thetasky", "thetawinj2000"),
    "angle from +x": ("theta", "thetaimage", "thetawinimage", "orientation", "angle"),
    "n": ("n", "sersicn", "nsersic", "sersicindex", "nser", "sersic"),
}
# The names of shape parameters are short and mean other things where there is no size.
SHAPES = ("ellipticity", "axis ratio", "pa", "pa on the sky", "angle from +x", "n")
UNITS: dict[str, u.UnitBase] = {
    "arcsec": u.arcsec,
    "asec": u.arcsec,
    "arcmin": u.arcmin,
    "mas": u.mas,
    "deg": u.deg,
    "rad": u.rad,
    "hours": u.hourangle,
    "hour": u.hourangle,
    "pixels": u.pix,
    "pixel": u.pix,
    "pix": u.pix,
    "px": u.pix,
    "mjy": u.mJy,
    "ujy": u.uJy,
    "njy": u.nJy,
    "jy": u.Jy,
    "ab": u.ABmag,
}
KINDS_ELSEWHERE = {
    "star": "point",
    "psf": "point",
    "pointsource": "point",
    "gauss": "gaussian",
    "exp": "exponential",
    "expdisk": "exponential",
    "disk": "exponential",
    "rex": "exponential",
    "dev": "devaucouleurs",
    "devauc": "devaucouleurs",
    "ser": "sersic",
    "sérsic": "sersic",
}
_BRACKET = re.compile(r"^(.*?)\s*[\[(]\s*(.*?)\s*[\])]\s*$")


@dataclass(frozen=True)
class Meaning:
    """What a column was taken for.

    Attributes
    ----------
    column : str
        The column's name.
    unit : astropy.units.UnitBase or None
        Its unit, be it the column's own or part of its name.
    """

    column: str
    unit: u.UnitBase | None


def meanings(table: Table) -> dict[str, Meaning]:
    """Recognise the columns of a table by their names and units.

    Parameters
    ----------
    table : astropy.table.Table
        Any table.

    Returns
    -------
    dict
        `Meaning` of each quantity found, by the keys of `NAMES`. The source table's own names,
        spelt exactly, come before all others.
    """
    keys: dict[str, list[Meaning]] = {}
    for name in table.colnames:
        if table[name].ndim != 1:
            continue
        unit = getattr(table[name], "unit", None)
        key, in_name = _split(name)
        for spelling, spelt_unit in {_plain(name): None, key: in_name}.items():
            keys.setdefault(spelling, []).append(Meaning(name, unit or spelt_unit))
    found: dict[str, Meaning] = {}
    for quantity, names in NAMES.items():
        if quantity in table.colnames and quantity in (*COLUMNS, "n"):
            found[quantity] = Meaning(quantity, getattr(table[quantity], "unit", None))
            continue
        candidates = [meaning for name in names for meaning in keys.get(name, ())]
        if quantity in ("ra", "dec"):
            # Of sexagesimal text and a number, the number.
            candidates.sort(key=lambda meaning: table[meaning.column].dtype.kind in "OUS")
        if candidates:
            found[quantity] = candidates[0]
    if "r_half" not in found and not {"kind", "ellipticity"} <= set(table.colnames):
        for shape in SHAPES:
            found.pop(shape, None)
    return found


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _split(name: str) -> tuple[str, u.UnitBase | None]:
    """Part a name from the unit that follows it."""
    bracket = _BRACKET.match(name)
    if bracket and bracket[1] and bracket[2]:
        word = _plain(bracket[2])
        if word in UNITS:
            return _plain(bracket[1]), UNITS[word]
        try:
            return _plain(bracket[1]), u.Unit(bracket[2])
        except (ValueError, TypeError):
            return _plain(name), None
    plain = _plain(name)
    for word, unit in UNITS.items():
        if plain.endswith(word) and len(plain) > len(word):
            return plain[: -len(word)], unit
    return plain, None

"""Sky and filters of an observation, as FITS stores them."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import QTable

from .filters import Filter
from .fits_table import read_table, table_hdu
from .observation import Observation
from .sky import CIS, PaperSky, Sky, SkyModel

EXTENSIONS = ("FILTER1", "FILTER2")


def filter_hdus(observation: Observation) -> list[fits.BinTableHDU]:
    """Return one table for each filter that the user gave as a curve."""
    return [
        table_hdu(
            QTable({"WAVELENGTH": one.wavelength * u.AA, "TRANSMISSION": one.transmission}), name
        )
        for name, one in zip(EXTENSIONS, observation.filters, strict=True)
        if isinstance(one, Filter)
    ]


def stored_filters(row: dict[str, Any], hdus: fits.HDUList) -> tuple[str | Filter, str | Filter]:
    """Return the filters of the two wheels: a curve where the file holds one, else a name.

    Raises
    ------
    ValueError
        If an extension that should hold a curve does not.
    """
    names = [hdu.name for hdu in hdus]

    def stored(extension: str) -> str | Filter:
        name = str(row[extension])
        if extension not in names:
            return name
        hdu = hdus[extension]
        columns = hdu.columns.names if isinstance(hdu, fits.BinTableHDU) else []
        if not {"WAVELENGTH", "TRANSMISSION"} <= set(columns):
            raise ValueError(f"the extension {extension} holds no filter curve.")
        table = read_table(hdu)
        return Filter(name, table["WAVELENGTH"], np.asarray(table["TRANSMISSION"]))

    first, second = EXTENSIONS
    return stored(first), stored(second)


def sky_values(sky: SkyModel) -> dict[str, Any]:
    """Return the cells that hold a sky.

    Raises
    ------
    ValueError
        If it is neither `PaperSky` nor `Sky`.
    """
    if type(sky) is PaperSky:
        return {"SKY": "CIS"}
    if type(sky) is Sky:
        latitude = sky.galactic_latitude
        return {
            "SKY": "components",
            "EARTHSHINE": sky.earthshine,
            "ZODIACAL": sky.zodiacal,
            "GEOCORONA": sky.geocorona,
            "GAL_LATITUDE": np.nan if latitude is None else latitude,
        }
    raise ValueError(f"a sky of type {type(sky).__name__} cannot be stored; use a Sky or CIS.")


def stored_sky(row: dict[str, Any]) -> SkyModel:
    """Return the sky of a row; that of the paper for files that name none."""
    kind = str(row.get("SKY", "CIS"))
    if kind == "CIS":
        return CIS
    if kind == "components":
        latitude = float(row["GAL_LATITUDE"])
        return Sky(
            str(row["EARTHSHINE"]),
            str(row["ZODIACAL"]),
            str(row["GEOCORONA"]),
            None if np.isnan(latitude) else latitude,
        )
    raise ValueError(f"the sky is of the unknown kind {kind!r}.")


def sky_description(observation: Observation) -> str:
    """One line of ASCII text on an observation's sky."""
    if observation.background is not None:
        return "given as a number"
    sky = observation.sky
    if not isinstance(sky, Sky):
        return "constants of the CIS paper" if type(sky) is PaperSky else type(sky).__name__
    text = f"earthshine {sky.earthshine}, zodiacal {sky.zodiacal}, geocorona {sky.geocorona}"
    latitude = sky.galactic_latitude
    return text if latitude is None else f"{text}, diffuse light at b = {latitude:g} deg"

"""The scenes of the run-time benchmark."""

from __future__ import annotations

import sys
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable, vstack

from napari_issis import Observation, TelescopePSF, random_sources

DATA = Path(__file__).parents[1] / "tests" / "data"
UNITS = {"flux": u.erg / u.s / u.cm**2 / u.AA, "r_half": u.pix, "pa": u.deg}
EXTENDED = ("exponential", "devaucouleurs", "uniform", "gaussian")
REFERENCE_SCENES = (
    "stars500",
    "exponential100",
    "devaucouleurs100",
    "uniform100",
    "gaussian100",
)
FIELD = "field2048"
SCENES = (*REFERENCE_SCENES, FIELD)


def load_scene(name: str) -> tuple[QTable, Observation]:
    """Load sources and set-up of a scene, without its reference image."""
    if name == FIELD:
        return field(10_000, 250, 2048), Observation(psf=_telescope("stars500"), shape=(2048, 2048))
    with np.load(DATA / f"{name}_telescope.npz") as data:
        columns = ("kind", "x", "y", "flux", "r_half", "ellipticity", "pa")
        table = QTable({column: data[column] for column in columns})
    for column, unit in UNITS.items():
        table[column] = table[column] * unit
    return table, Observation(psf=_telescope(name), shape=(512, 512))


def reference_image(name: str) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Image of a scene by an independent program (tests/data/README.md)."""
    sys.path.append(str(DATA.parent))
    from test_reference_images import load

    image = load(f"{name}_telescope")[2]
    return np.asarray(image, dtype=np.float64)


def field(stars: int, galaxies_of_each_kind: int, side: int) -> QTable:
    """Stars and galaxies with the paper's ranges of flux, size and shape."""
    shape = (side, side)
    tables = [random_sources("point", stars, shape=shape, seed=1)]
    for seed, kind in enumerate(EXTENDED, start=2):
        tables.append(random_sources(kind, galaxies_of_each_kind, shape=shape, seed=seed))
    return vstack(tables)


def moved(table: QTable, pixels: float) -> QTable:
    """Copy of a table with all sources moved along x."""
    copy = table.copy()
    copy["x"] = copy["x"] + pixels
    return copy


def _telescope(name: str) -> TelescopePSF:
    with np.load(DATA / f"{name}_telescope.npz") as data:
        return TelescopePSF(
            float(data["diameter"]),
            float(data["obscuration"]),
            float(data["wavelength"]),
            float(data["blur_fwhm"]),
        )

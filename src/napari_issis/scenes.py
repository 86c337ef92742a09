"""Built-in scenes: the three examples of the paper and lensed quasars."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from astropy.coordinates import SkyCoord
from astropy.table import QTable, vstack

from .catalogue import PACKED_FITS, READABLE, read_catalogue
from .fits_io import SUFFIXES as FITS_SUFFIXES
from .fits_io import read_exposure
from .fits_table import open_fits
from .lensed_quasars import find_quasar, lensed_quasar
from .observation import Observation
from .populations import random_sources
from .sources import source


@dataclass(frozen=True)
class ExampleScene:
    """A scene that comes with the program.

    Attributes
    ----------
    name : str
        Short name, for the shell.
    title : str
        What it shows.
    sources : astropy.table.QTable
        The source table.
    observation : Observation
        How to observe it.
    note : str
        Where the values come from, and which are merely illustrative.
    """

    name: str
    title: str
    sources: QTable = field(repr=False)
    observation: Observation
    note: str


def blend() -> ExampleScene:
    """Two blended galaxies, example 1 of Shalyapin & Goicoechea (2014)."""
    galaxies = [
        source("exponential", 256, 256, flux=1e-14, r_half=20, ellipticity=0.7, pa=pa)
        for pa in (45, 135)
    ]
    return ExampleScene(
        "blend",
        "Two galaxies that are blended together",
        vstack(galaxies),
        Observation(),
        "Shalyapin & Goicoechea 2014, example 1: exponential profiles, all values from the paper.",
    )


def stars500() -> ExampleScene:
    """500 random stars, example 2 of Shalyapin & Goicoechea (2014)."""
    return ExampleScene(
        "stars500",
        "500 random stars",
        random_sources("point", 500, seed=500),
        Observation(),
        "Shalyapin & Goicoechea 2014, example 2: the paper's ranges, a sample of our own. "
        "Brighter than a photon-counting detector such as HST's SBC counts linearly.",
    )


def galaxies100() -> ExampleScene:
    """100 random galaxies, example 3 of Shalyapin & Goicoechea (2014)."""
    return ExampleScene(
        "galaxies100",
        "100 random galaxies",
        random_sources("exponential", 100, seed=100),
        Observation(),
        "Shalyapin & Goicoechea 2014, example 3: exponential profiles, the paper's ranges, "
        "a sample of our own.",
    )


def q2237() -> ExampleScene:
    """Make the lensed quasar Q2237+0305, the Einstein cross: images A, B, C, D, then the lens.

    The lens galaxy is at the frame's centre.
    """
    return _lensed("q2237", "Q2237+0305")


def he0435() -> ExampleScene:
    """Make the lensed quasar HE0435-1223: images A, B, C, D, then the lens at the centre."""
    return _lensed("he0435", "HE0435-1223")


def pg1115() -> ExampleScene:
    """Make the lensed quasar PG1115+080: images A1, A2, B, C, then the lens at the centre."""
    return _lensed("pg1115", "PG1115+080")


def h1413() -> ExampleScene:
    """Make the lensed quasar H1413+117: images A, B, C, D, then the lens at the centre."""
    return _lensed("h1413", "H1413+117")


def _lensed(name: str, quasar: str) -> ExampleScene:
    system = find_quasar(quasar)
    observation = Observation(
        shape=(256, 256), pointing=SkyCoord(system.ra, system.dec, unit="deg"), exposure=1000.0
    )
    return ExampleScene(
        name,
        f"Lensed quasar {quasar}: four images and the lens galaxy",
        lensed_quasar(quasar, observation),
        observation,
        f"Positions: {system.references[0]}. Illustrative: the quasar's fluxes (F814W magnitudes "
        "carried on to 2500 A by a power law lambda^-1.5, without extinction) and the lens "
        "galaxy's flux, size, shape and angle.",
    )


SCENES: Mapping[str, Callable[[], ExampleScene]] = MappingProxyType(
    {make.__name__: make for make in (blend, stars500, galaxies100, q2237, he0435, pg1115, h1413)}
)


def example_scene(name: str) -> ExampleScene:
    """Make a built-in scene.

    Parameters
    ----------
    name : str
        One of `SCENES`.

    Raises
    ------
    ValueError
        If there is no such scene; the message lists the known ones.
    """
    if name not in SCENES:
        raise ValueError(f"there is no scene {name!r}; known: {', '.join(SCENES)}.")
    return SCENES[name]()


def load_scene(name_or_path: str | os.PathLike[str], **changes: Any) -> tuple[QTable, Observation]:
    """Load a built-in scene or a file; see `load_scene_with_notes`."""
    return load_scene_with_notes(name_or_path, **changes)[:2]


def load_scene_with_notes(
    name_or_path: str | os.PathLike[str], **changes: Any
) -> tuple[QTable, Observation, tuple[str, ...]]:
    """Load a built-in scene or a file.

    Parameters
    ----------
    name_or_path : str or path-like
        The name of a built-in scene, a catalogue in any format of
        `napari_issis.catalogue.read_catalogue`, or a saved exposure.
    **changes
        What to change in the scene's observation, such as ``exposure=100``. Positions on the
        sky are put into the changed frame.

    Returns
    -------
    sources : astropy.table.QTable
    observation : Observation
        The saved exposure's, the built-in scene's, or the default one for a catalogue.
    notes : tuple of str
        What the columns of a catalogue were taken for.

    Raises
    ------
    ValueError
        If there is no such scene, or the file is broken.
    OSError
        If the file cannot be opened.
    """
    name = str(name_or_path)
    if name in SCENES:
        scene = example_scene(name)
        return scene.sources, scene.observation.replace(**changes), ()
    if not name.lower().endswith(READABLE) and not Path(name).exists():
        raise ValueError(
            f"there is no scene {name!r}; known: {', '.join(SCENES)}; "
            f"or give a source table ({', '.join(READABLE)})."
        )
    if name.lower().endswith((*FITS_SUFFIXES, *PACKED_FITS)):
        with open_fits(name) as hdus:
            is_exposure = "OBSERVATION" in hdus
        if is_exposure:
            exposure = read_exposure(name)
            return exposure.sources, exposure.observation.replace(**changes), ()
    observation = Observation(**changes)
    catalogue = read_catalogue(name, observation)
    return catalogue.sources, observation, catalogue.notes

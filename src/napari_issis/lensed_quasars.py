"""Known lensed quasars as sources: astrometry of the literature, fluxes of one's own."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable, vstack
from numpy.typing import NDArray

from .observation import Observation
from .sky_offsets import anchor, offsets_to_frame
from .sources import BRIGHTEST, FLUX_UNIT, source

Array = NDArray[np.float64]

DATA = "lensed_quasars.toml"
# erg s-1 cm-2 A-1 at 8140 A of F814W = 0 (Vega); recalled, good to some percent.
F814W_ZERO = 1.13e-9
# Spectrum of a quasar, F_lambda ~ lambda^-1.5, from 8140 to 2500 A.
TO_ULTRAVIOLET = (8140 / 2500) ** 1.5
GALAXY_VALUES = ("kind", "flux", "r_half", "ellipticity", "pa", "n")


@dataclass(frozen=True)
class LensedQuasar:
    """A lensed quasar of the library.

    Attributes
    ----------
    name : str
        Its usual name.
    aliases : tuple of str
        Other names that `find_quasar` knows.
    images : Mapping of str to (float, float)
        Offsets of the images, arcsec east and north of the one at (0, 0).
    lens : (float, float)
        That of the lens galaxy.
    ratios : tuple of float or None
        Fluxes of the images over that of the brightest one; None where none are known here.
    flux : float or None
        Illustrative flux of the brightest image, erg s-1 cm-2 A-1: its F814W magnitude carried
        on to 2500 A by a power law lambda^-1.5. Extinction and the absorption between the
        galaxies are left out, which in the FUV is a great deal.
    galaxy : Mapping
        Illustrative lens galaxy: kind, flux, r_half (arcsec), ellipticity, pa (degrees from
        north through east).
    ra, dec : float
        ICRS, degrees, good to about an arcsec; NaN where not known here.
    z_source, z_lens : float
        Redshifts; NaN where not known here.
    separation : float
        Arcsec, of the catalogue; NaN where not known here.
    references : tuple of str
        Where the values come from.
    uncertain : tuple of str
        Values that were recalled from memory, or that are in doubt.
    note : str
        What else to know.
    """

    name: str
    aliases: tuple[str, ...]
    images: Mapping[str, tuple[float, float]]
    lens: tuple[float, float]
    ratios: tuple[float, ...] | None
    flux: float | None
    galaxy: Mapping[str, Any]
    ra: float
    dec: float
    z_source: float
    z_lens: float
    separation: float
    references: tuple[str, ...]
    uncertain: tuple[str, ...]
    note: str


@lru_cache(maxsize=1)
def quasar_library() -> Mapping[str, LensedQuasar]:
    """Return all systems of the library by name, in its order."""
    text = resources.files(__package__).joinpath(DATA).read_text(encoding="utf-8")
    data = tomllib.loads(text)
    systems = (_system(entry, data) for entry in data["system"])
    return MappingProxyType({system.name: system for system in systems})


def _system(entry: Mapping[str, Any], data: Mapping[str, Any]) -> LensedQuasar:
    ratios, flux = entry.get("ratios"), None
    if "f814w" in entry:
        ratios = 10 ** (-0.4 * np.array(entry["f814w"]))
        flux = float(F814W_ZERO * TO_ULTRAVIOLET * max(ratios))
    number = {
        name: float(entry.get(name, np.nan))
        for name in ("ra", "dec", "z_source", "z_lens", "separation")
    }
    return LensedQuasar(
        name=entry["name"],
        aliases=tuple(entry.get("also", ())),
        images=MappingProxyType({k: (e, n) for k, (e, n) in entry["images"].items()}),
        lens=(entry["lens"][0], entry["lens"][1]),
        ratios=None if ratios is None else tuple(float(r) for r in ratios / np.max(ratios)),
        flux=flux,
        galaxy=MappingProxyType({**data["galaxy"], **entry.get("galaxy", {})}),
        references=tuple(data["references"][key] for key in entry["sources"]),
        uncertain=tuple(entry.get("uncertain", ())),
        note=entry.get("note", ""),
        **number,
    )


def find_quasar(name: str) -> LensedQuasar:
    """Find a system by its name; case and blanks do not count.

    Raises
    ------
    ValueError
        If there is none; the message lists those there are.
    """
    wanted = _plain(name)
    for system in quasar_library().values():
        if wanted in map(_plain, (system.name, *system.aliases)):
            return system
    known = ", ".join(quasar_library())
    raise ValueError(f"there is no lensed quasar {name!r} in the library; known: {known}.")


def _plain(name: str) -> str:
    return "".join(str(name).split()).casefold()


def lensed_quasars() -> QTable:
    """List the lensed quasars of the library.

    Returns
    -------
    astropy.table.QTable
        One row a system: ``name``, ``ra`` and ``dec`` (ICRS, good to about an arcsec),
        ``z_source``, ``z_lens``, ``separation``, ``images`` (their names), ``ratios`` (whether
        flux ratios are known), ``flux`` (illustrative, of the brightest image, see
        `LensedQuasar`), ``uncertain`` (what was recalled from memory or is in doubt),
        ``references`` and ``note``. What is not known here is NaN.
    """
    systems = quasar_library().values()
    angles = {"ra": u.deg, "dec": u.deg, "separation": u.arcsec}

    def column(name: str) -> Any:
        return np.array([getattr(system, name) for system in systems], dtype=np.float64)

    return QTable(
        {
            "name": [system.name for system in systems],
            "ra": column("ra") * angles["ra"],
            "dec": column("dec") * angles["dec"],
            "z_source": column("z_source"),
            "z_lens": column("z_lens"),
            "separation": column("separation") * angles["separation"],
            "images": [" ".join(system.images) for system in systems],
            "ratios": [system.ratios is not None for system in systems],
            "flux": column("flux") * FLUX_UNIT,
            "uncertain": ["; ".join(system.uncertain) for system in systems],
            "references": ["; ".join(system.references) for system in systems],
            "note": [system.note for system in systems],
        }
    )


def lensed_quasar(
    name: str,
    observation: Observation | None = None,
    *,
    flux: Any = None,
    ratios: Sequence[float] | Mapping[str, float] | None = None,
    lens_galaxy: bool | Mapping[str, Any] = True,
    centre: Any = None,
) -> QTable:
    """Make the images and the lens galaxy of a lensed quasar.

    Parameters
    ----------
    name : str
        A system of `lensed_quasars`, such as ``"HE0435-1223"``.
    observation : Observation, optional
        The frame: its roll turns the system, its channel's pivot wavelength is that of
        magnitudes. The default one otherwise.
    flux : float or Quantity or Magnitude, optional
        That of the brightest image: in erg s-1 cm-2 A-1, or an AB magnitude with its unit, such
        as ``19 * u.ABmag``. By default the library's illustrative one.
    ratios : sequence or mapping of float, optional
        Fluxes of the images relative to each other, in the library's order or by their names.
    lens_galaxy : bool or mapping
        Whether to add the lens galaxy, or what to change in it: ``kind``, ``flux``, ``r_half``
        (arcsec), ``ellipticity``, ``pa`` (degrees from north through east), ``n``.
        Its position is measured, all else illustrative.
    centre : (float, float) or SkyCoord, optional
        Where the lens galaxy stands: pixels (x, y), or a position on the sky if the observation
        has a pointing. The frame's centre by default.

    Returns
    -------
    astropy.table.QTable
        A source table: the images in the library's order as points, then the lens galaxy. North
        is up and east to the left at roll 0.

    Raises
    ------
    ValueError
        If there is no such system, a value is out of range, or the library knows no flux or
        flux ratios of the system and none are given.
    """
    observation = Observation() if observation is None else observation
    system = find_quasar(name)
    place = anchor(centre, observation)
    fluxes = _brightest(flux, system, observation) * _ratios(ratios, system)
    offsets = np.array(list(system.images.values())) - system.lens
    x, y = offsets_to_frame(offsets[:, 0], offsets[:, 1], place, observation.pixel_scale)
    rows = [source("point", *row) for row in zip(x, y, fluxes, strict=True)]
    if lens_galaxy is not False:
        rows.append(_galaxy(system, lens_galaxy, place, observation))
    return vstack(rows)


def _brightest(flux: Any, system: LensedQuasar, observation: Observation) -> float:
    if flux is None:
        if system.flux is None:
            raise ValueError(
                f"no flux of {system.name} is known here; give flux=, that of its brightest image."
            )
        return system.flux
    try:
        if hasattr(flux, "unit"):
            flux = flux.to(FLUX_UNIT, u.spectral_density(observation.pivot * u.AA)).value
        value = float(flux)
    except (TypeError, ValueError, u.UnitConversionError):
        raise ValueError(
            f"flux is {flux!r}; give one number in erg s-1 cm-2 A-1, or one magnitude with the "
            "unit mag(AB)."
        ) from None
    if not 0 <= value <= BRIGHTEST:
        raise ValueError(
            f"flux is {value:g}; it must be in [0, {BRIGHTEST:g}] erg s-1 cm-2 A-1; "
            "magnitudes need their unit, such as 19 * u.ABmag."
        )
    return value


def _ratios(ratios: Any, system: LensedQuasar) -> Array:
    names = list(system.images)
    if ratios is None:
        if system.ratios is None:
            raise ValueError(
                f"no flux ratios of {system.name} are known here; give ratios=, one number for "
                f"each of {', '.join(names)}."
            )
        return np.array(system.ratios)
    if isinstance(ratios, Mapping):
        if set(ratios) != set(names):
            raise ValueError(f"ratios are of {', '.join(map(str, ratios))}; give {names}.")
        ratios = [ratios[image] for image in names]
    try:
        values = np.array([float(ratio) for ratio in ratios])
    except (TypeError, ValueError):
        raise ValueError(f"ratios is {ratios!r}; give one number for each of {names}.") from None
    if values.shape != (len(names),):
        raise ValueError(f"ratios has {len(values)} numbers; give one for each of {names}.")
    for image, value in zip(names, values, strict=True):
        if not (np.isfinite(value) and value >= 0):
            raise ValueError(f"the ratio of image {image} is {value}; it must be 0 or more.")
    if not values.max() > 0:
        raise ValueError("ratios are all 0; the brightest image must have one above 0.")
    brightest: Array = values / values.max()
    return brightest


def _galaxy(
    system: LensedQuasar,
    changes: Any,
    place: tuple[float, float, float],
    observation: Observation,
) -> QTable:
    if not isinstance(changes, bool | Mapping):
        raise ValueError(f"lens_galaxy is {changes!r}; give True, False, or values to change.")
    values = dict(system.galaxy)
    if isinstance(changes, Mapping):
        for key in changes:
            if key not in GALAXY_VALUES:
                raise ValueError(f"lens_galaxy has {key!r}; known: {', '.join(GALAXY_VALUES)}.")
        values.update(changes)
    x, y, north = place
    radius, pa = u.Quantity(values.pop("r_half"), u.arcsec), u.Quantity(values.pop("pa"), u.deg)
    kind, flux = values.pop("kind"), values.pop("flux")
    if hasattr(flux, "unit"):
        flux = flux.to(FLUX_UNIT, u.spectral_density(observation.pivot * u.AA))
    return source(
        kind,
        x,
        y,
        flux=flux,
        r_half=radius.value / observation.pixel_scale,
        pa=(pa.value + north) % 180,
        **values,
    )

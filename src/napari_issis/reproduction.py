"""The Python commands that make a scene and its exposures again, count by count."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.table import Table
from numpy.typing import NDArray

from .detector import Detector
from .filters import Filter
from .instrument import Instrument
from .instruments import INSTRUMENTS, ISSIS, instrument_named
from .observation import Observation
from .psf import GaussianPSF, MoffatPSF, TelescopePSF
from .sky import SKIES, PaperSky, Sky
from .sources import COLUMNS, FLUX_UNIT, IMAGE, spectrum_texts
from .spectra import table_file, with_table_file
from .spectrum_curves import curve_stamp, read_spectrum_curve

# Units that a plain number of a source table has.
PLAIN = {"x": u.pix, "y": u.pix, "flux": FLUX_UNIT, "r_half": u.pix, "pa": u.deg}
# Samples of a curve, of a filter or a spectrum, that are written out.
LONGEST_CURVE = 64


def reproduction_code(
    sources: Table,
    observations: Sequence[Observation],
    *,
    seed: int = 0,
    goals: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Python that makes the exposures of a scene again.

    Parameters
    ----------
    sources : astropy.table.QTable
        A valid source table; its values are written with all their digits.
    observations : sequence of Observation
        The set-ups.
    seed : int
        Seed of the noise.
    goals : sequence of mapping
        Arguments of `exposure_for`.

    Returns
    -------
    str
        It defines ``sources``, ``observations`` and ``exposures``. A set-up that cannot be
        written in a few lines, such as a PSF that is an image, is read from the FITS file of
        its exposure, which has to be saved beside; and so are sources that are images, and
        those with spectra from files of many samples. Spectra of few are written to files.
    """
    body = [*_sources(sources, observations[0].channel), "observations = ["]
    body += [f"    {_observation(one)}" for one in observations]
    body += [
        "]",
        f"exposures = [ni.simulate(sources, one, seed={int(seed)}) for one in observations]",
        "for observation, exposure in zip(observations, exposures):",
        "    print(observation.channel, exposure.counts.sum())",
        "    print(ni.forecast(sources, observation))",
    ]
    body += [
        f"    print(ni.exposure_for(sources, observation, {_arguments(goal)}))" for goal in goals
    ]
    text = "\n".join(body)
    head = ["from math import inf, nan"] if "nan" in text or "inf" in text else []
    if "u." in text:
        head.append("import astropy.units as u")
    if "Path(" in text:
        head.append("from pathlib import Path")
    if "SkyCoord(" in text:
        head.append("from astropy.coordinates import SkyCoord")
    head += ["from astropy.table import QTable", "import napari_issis as ni"]
    return "\n".join([*head, "", text, ""])


def unwritten(observation: Observation) -> str | None:
    """Name what of an observation cannot be written as a line of Python; None if nothing is."""
    psf = observation.psf
    if psf is not None and type(psf) not in (GaussianPSF, MoffatPSF, TelescopePSF):
        return f"the PSF, {type(psf).__name__}"
    for one in observation.filters:
        if isinstance(one, Filter) and one.wavelength.size > LONGEST_CURVE:
            return f"the curve of the filter {one.name}"
    if _name_of(observation.instrument) is None:
        return f"the camera, {observation.instrument.name}"
    own = observation.sky == _plain(observation).sky
    if not own and observation.sky not in SKIES.values() and type(observation.sky) is not Sky:
        return f"the sky, {type(observation.sky).__name__}"
    return None


def unwritten_sources(table: Table) -> str | None:
    """Name what of sources cannot be written as lines of Python; None if nothing is."""
    if IMAGE in table["kind"]:
        return "Sources that are images"
    for path in spectrum_files(table):
        samples = _curve(path)[0].size
        if samples > LONGEST_CURVE:
            return f"The {samples} samples of the spectrum {path}"
    return None


def spectrum_files(table: Table) -> list[str]:
    """Files of the spectra of a source table, each once."""
    spectra = spectrum_texts(table)
    files = (table_file(str(text)) for text in (() if spectra is None else spectra))
    return list(dict.fromkeys(path for path in files if path is not None))


def _curve(path: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return read_spectrum_curve(path, curve_stamp(path))


def written_name(path: str) -> str:
    """Name of the file that the commands make of a spectrum's: another for other samples."""
    wavelength, flux = _curve(path)
    stem = re.sub(r"[^\w-]", "_", Path(path).stem)
    return f"{stem}-{zlib.crc32(flux.tobytes(), zlib.crc32(wavelength.tobytes())):08x}.csv"


def _file_lines(path: str) -> list[str]:
    rows = zip(*(column.tolist() for column in _curve(path)), strict=True)
    lines = [f'    "{wavelength!r},{flux!r}\\n"' for wavelength, flux in rows]
    return [f"Path({written_name(path)!r}).write_text(", '    "wavelength_A,flux\\n"', *lines, ")"]


def _name_of(camera: Instrument) -> str | None:
    return next((name for name in INSTRUMENTS if instrument_named(name) == camera), None)


def _plain(observation: Observation) -> Observation:
    """Return the observation of that camera and channel of which nothing else is said."""
    return Observation(channel=observation.channel, instrument=observation.instrument)


def _sources(table: Table, channel: str) -> list[str]:
    if unwritten_sources(table) is not None:
        return [f"sources = ni.Exposure.read({channel + '.fits'!r}).sources"]
    names = [name for name in (*COLUMNS, "n") if name in table.colnames]
    columns = [_values(table, name) for name in names]
    spectra = spectrum_texts(table)
    if spectra is not None:
        names.append("spectrum")
        columns.append([repr(_spectrum(str(text))) for text in spectra])
    rows = [f"        ({', '.join(row)})," for row in zip(*columns, strict=True)]
    heading = ", ".join(repr(name) for name in names)
    if not rows:
        return ['sources = ni.source("point", 0.0, 0.0)[:0]']
    lines = [line for path in spectrum_files(table) for line in _file_lines(path)]
    lines += ["sources = QTable(", "    rows=[", *rows, "    ],", f"    names=({heading}),", ")"]
    for name, plain in PLAIN.items():
        unit = getattr(table[name], "unit", None) if name in names else None
        if unit is not None and unit != plain:
            lines.append(f'sources["{name}"] = list(sources["{name}"]) * u.Unit({str(unit)!r})')
    return lines


def _spectrum(text: str) -> str:
    """Text of a spectrum, with the file that the commands write in the place of its own."""
    path = table_file(text)
    return text if path is None else with_table_file(text, written_name(path))


def _values(table: Table, name: str) -> list[str]:
    column = table[name]
    if name == "kind":
        return [repr(str(kind).strip()) for kind in column]
    mask = np.asarray(getattr(column, "mask", np.zeros(len(table), dtype=bool)))
    values = np.asarray(getattr(column, "value", column))
    return [repr(np.nan if gone else float(v)) for v, gone in zip(values, mask, strict=True)]


def _observation(observation: Observation) -> str:
    missing = unwritten(observation)
    if missing is not None:
        name = f"{observation.channel}.fits"
        return f"ni.Exposure.read({name!r}).observation,  # {missing}, is in that file"
    words, plain = [f"channel={observation.channel!r}"], _plain(observation)
    if observation.instrument != ISSIS:
        words.append(f"instrument={_name_of(observation.instrument)!r}")
    for field in fields(observation):
        value = getattr(observation, field.name)
        if field.name in ("channel", "instrument") or value is None:
            continue
        if value != getattr(plain, field.name):
            words.append(f"{field.name}={_value(value)}")
    return f"ni.Observation({', '.join(words)}),"


def _value(value: Any) -> str:
    if isinstance(value, SkyCoord):
        ra, dec = float(value.icrs.ra.deg), float(value.icrs.dec.deg)
        return f'SkyCoord({ra!r}, {dec!r}, unit="deg")'
    if isinstance(value, tuple):
        return f"({', '.join(_value(one) for one in value)})"
    if isinstance(value, Filter):
        curve = value.wavelength.tolist(), value.transmission.tolist()
        return f"ni.Filter({value.name!r}, {curve[0]!r}, {curve[1]!r})"
    if isinstance(value, Sky | PaperSky):
        known = [key for key, sky in SKIES.items() if sky == value]
        return f"ni.SKIES[{known[0]!r}]" if known else f"ni.{value!r}"
    if isinstance(value, GaussianPSF | MoffatPSF | TelescopePSF | Detector):
        return f"ni.{value!r}"
    if isinstance(value, u.Quantity):
        return f"{float(value.value)!r} * u.Unit({str(value.unit)!r})"
    if isinstance(value, np.ndarray | np.generic):
        return repr(value.tolist())
    return repr(value)


def _arguments(goal: Mapping[str, Any]) -> str:
    return ", ".join(f"{name}={_value(value)}" for name, value in goal.items())

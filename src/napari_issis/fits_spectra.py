"""Spectra that a source table takes from files, as FITS stores them beside it.

``SPECTRA`` names the files and counts their samples; ``SAMPLES`` holds these, one file's after
the other's. Elsewhere the scene is restored from them.
"""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.table import QTable, Table

from .fits_table import read_table, table_hdu
from .sources import spectrum_texts
from .spectra import table_file, with_table_file
from .spectrum_curves import curve_stamp, keep_curve, read_spectrum_curve

NAMES = ("SPECTRA", "SAMPLES")


def spectrum_hdus(sources: Table) -> list[fits.BinTableHDU]:
    """Return the two tables with the spectra that come from files; none if there is none.

    A file that cannot be read any more is left out.
    """
    found = {}
    for path in dict.fromkeys(table_file(text) for text in _distinct(sources)):
        if path is not None:
            try:
                found[path] = read_spectrum_curve(path, curve_stamp(path))
            except ValueError:
                continue
    if not found:
        return []
    wavelength, flux = (np.concatenate(parts) for parts in zip(*found.values(), strict=True))
    files = Table({"FILE": list(found), "COUNT": [at.size for at, _ in found.values()]})
    samples = QTable({"WAVELENGTH": wavelength * u.AA, "FLUX": flux})
    return [table_hdu(table, name) for table, name in zip((files, samples), NAMES, strict=True)]


def with_stored_spectra(sources: QTable, hdus: fits.HDUList) -> QTable:
    """Keep the spectra that a file holds, and return the source table that names them.

    The names are changed where a file of that name now holds something else.

    Raises
    ------
    ValueError
        If the extensions are broken.
    """
    present = [hdu.name for hdu in hdus]
    if not all(name in present for name in NAMES):
        return sources
    files, samples = (_columns(hdus[name], name) for name in NAMES)
    counts = np.asarray(files["COUNT"])
    if counts.dtype.kind not in "iu" or (counts < 0).any() or counts.sum() != len(samples):
        raise ValueError("the extension SPECTRA does not match SAMPLES.")
    wavelength = np.asarray(samples["WAVELENGTH"].to_value(u.AA), dtype=np.float64)
    flux = np.asarray(samples["FLUX"], dtype=np.float64)
    names, start = {}, 0
    for path, count in zip(files["FILE"], counts, strict=True):
        part = slice(start, start + int(count))
        names[str(path)] = keep_curve(str(path), wavelength[part], flux[part])
        start += int(count)
    changed = {path: name for path, name in names.items() if path != name}
    texts = spectrum_texts(sources)
    if changed and texts is not None:
        new = {text: _renamed(text, changed) for text in _distinct(sources)}
        sources["spectrum"] = np.array([new[str(text)] for text in texts])
    return sources


def _columns(hdu: Any, name: str) -> QTable:
    wanted = {"SPECTRA": {"FILE", "COUNT"}, "SAMPLES": {"WAVELENGTH", "FLUX"}}[name]
    if not isinstance(hdu, fits.BinTableHDU) or not wanted <= set(hdu.columns.names):
        raise ValueError(f"the extension {name} holds no spectra.")
    table = read_table(hdu)
    if name == "SAMPLES" and not (
        isinstance(table["WAVELENGTH"], u.Quantity) and table["WAVELENGTH"].unit == u.AA
    ):
        raise ValueError("the column WAVELENGTH of the extension SAMPLES is not in Angstrom.")
    return table


def _distinct(sources: Table) -> list[str]:
    texts = spectrum_texts(sources)
    return [] if texts is None else list(dict.fromkeys(texts.tolist()))


def _renamed(text: str, names: dict[str, str]) -> str:
    path = table_file(text)
    return with_table_file(text, names[path]) if path in names else text

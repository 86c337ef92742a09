"""The curves of spectra given by a file: from the disk, or kept from a FITS file with a scene."""

from __future__ import annotations

import os
import zlib
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Curve = tuple[Array, Array]

# By path, curves that came with scenes, for where the file itself is not.
_KEPT: dict[str, Curve] = {}
# First part of the stamp of a kept curve; a file's is its time of change, after 1970.
KEPT = -1


def curve_stamp(path: str) -> tuple[int, ...]:
    """Return what changes with the content behind a path: time and size of the file.

    Raises
    ------
    ValueError
        If there is no such file, and no curve is kept in its place.
    """
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:
        if path in _KEPT:
            return (KEPT, _checksum(_KEPT[path]))
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"cannot read {path}: {reason}.") from error
    return (found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=32)
def read_spectrum_curve(path: str, stamp: tuple[int, ...]) -> Curve:
    """Wavelengths at rest, angstrom, and flux densities per wavelength, at most 1.

    Raises
    ------
    ValueError
        If the file cannot be read or holds no spectrum; the message names it.
    """
    from .filter_file import read_curve

    if stamp[0] == KEPT:
        return _KEPT[path]
    try:
        return _checked(path, *read_curve(Path(path), "flux"))
    except OSError as error:
        raise ValueError(str(error)) from error


def keep_curve(path: str, wavelength: Array, flux: Array) -> str:
    """Keep a curve that came with a scene, for where its file is not.

    Parameters
    ----------
    path : str
        The file's name when the scene was saved.
    wavelength, flux : ndarray, shape (n,)
        As `read_spectrum_curve` returned them then.

    Returns
    -------
    str
        The name under which the curve is found: the path itself, or, where that leads to
        another curve, the path with a checksum.

    Raises
    ------
    ValueError
        If they are no spectrum; the message names the path.
    """
    curve = _checked(path, wavelength, flux)
    try:
        same = _checksum(read_spectrum_curve(path, curve_stamp(path))) == _checksum(curve)
    except ValueError:
        # nothing readable is there
        same = not os.path.exists(path)
    if not same:
        path = f"{path}#{_checksum(curve):08x}"
    _KEPT[path] = curve
    return path


def _checked(path: str, wavelength: Array, flux: Array) -> Curve:
    if wavelength.size < 2 or not np.all(np.isfinite(wavelength)):
        raise ValueError(f"{path} needs two wavelengths or more, all finite.")
    if wavelength[0] > wavelength[-1]:
        wavelength, flux = wavelength[::-1].copy(), flux[::-1].copy()
    if wavelength[0] <= 0 or not np.all(np.diff(wavelength) > 0):
        raise ValueError(
            f"{path}: the wavelengths must be above 0 and run in one direction; "
            "sort the rows and remove doubles."
        )
    for value in flux[~(np.isfinite(flux) & (flux >= 0))][:1]:
        raise ValueError(f"{path} has the flux {value:g}; it must be finite and 0 or more.")
    if not flux.any():
        raise ValueError(f"{path} holds no light: its flux is 0 throughout.")
    # no unit is kept: sums over tiny numbers would lose digits
    return wavelength, flux / flux.max()


def _checksum(curve: Curve) -> int:
    wavelength, flux = curve
    return zlib.crc32(flux.tobytes(), zlib.crc32(wavelength.tobytes()))

"""AB magnitudes of fluxes, and of surface brightnesses."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# AB magnitude of 1 erg s-1 cm-2 Hz-1 is -48.6 (Oke & Gunn 1983, ApJ 266, 713).
AB_ZERO = -48.6
# angstrom per second
LIGHT = 2.99792458e18


def ab_magnitude(flux: ArrayLike, pivot: float | Array) -> Array:
    """Return the AB magnitudes of fluxes.

    Parameters
    ----------
    flux : array_like
        In erg s-1 cm-2 A-1, 0 or more.
    pivot : float or ndarray
        Pivot wavelength of the channel, angstrom.

    Returns
    -------
    ndarray
        -2.5 log10(F_nu) - 48.6 with F_nu = F_lambda pivot^2 / c; infinite for a flux of 0.
    """
    with np.errstate(divide="ignore"):
        return -2.5 * np.log10(np.asarray(flux, dtype=np.float64) * (pivot**2 / LIGHT)) + AB_ZERO


def flux_of_ab_magnitude(magnitude: ArrayLike, pivot: float | Array) -> Array:
    """Return the fluxes of AB magnitudes: the inverse of `ab_magnitude`.

    Parameters
    ----------
    magnitude : array_like
        AB magnitudes.
    pivot : float or ndarray
        Pivot wavelength of the channel, angstrom.

    Returns
    -------
    ndarray
        In erg s-1 cm-2 A-1.
    """
    brightness = 10 ** (-0.4 * (np.asarray(magnitude, dtype=np.float64) - AB_ZERO))
    return np.asarray(brightness * (LIGHT / pivot**2))


def surface_brightness(
    rate: ArrayLike, *, cps_per_flux: float, pivot: float, pixel_scale: float
) -> Array:
    """Return surface brightnesses in AB magnitudes per square arcsec.

    Parameters
    ----------
    rate : array_like
        Count rate of a pixel in cps, without the sky (or that of the sky alone).
    cps_per_flux : float
        Count rate in cps of 1 erg s-1 cm-2 A-1, filters included.
    pivot : float
        Pivot wavelength of the channel, angstrom.
    pixel_scale : float
        Arcsec per pixel.

    Returns
    -------
    ndarray
        Infinite for a rate of 0, NaN for one below 0, as noise gives.
    """
    per_area = np.asarray(rate, dtype=np.float64) / (cps_per_flux * pixel_scale**2)
    return ab_magnitude(np.where(per_area >= 0, per_area, np.nan), pivot)

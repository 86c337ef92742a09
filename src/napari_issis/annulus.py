"""Transfer function of an annular aperture, at one wavelength and averaged over a band."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

# of the spline of a band-averaged OTF: distance from a kink within which knots crowd, and the
# least distance between two knots; both over the highest cut-off
CROWD = 5e-3
APART = 2.0**-23


def annular_otf(nu: ArrayLike, obscuration: float) -> Array:
    """OTF of an annular aperture at frequencies nu, in units of the cut-off.

    Parameters
    ----------
    nu : array_like
        Frequency over the cut-off frequency diameter / wavelength.
    obscuration : float
        Inner over outer radius.
    """
    separation = 2 * np.asarray(nu, dtype=float)
    common = _lens_area(1.0, 1.0, separation)
    if obscuration > 0:
        common = (
            common
            - 2 * _lens_area(1.0, obscuration, separation)
            + _lens_area(obscuration, obscuration, separation)
        )
    return common / (np.pi * (1 - obscuration**2))


def _lens_area(big: float, small: float, d: Array) -> Array:
    """Area common to circles of radii big >= small whose centres are d apart."""
    inside = np.pi * small**2
    crossing = (d > big - small) & (d < big + small)
    x = np.where(crossing, d, big)  # any separation at which the circles cross
    to_chord = (x**2 + big**2 - small**2) / (2 * x)
    half_chord = np.sqrt(np.maximum(big**2 - to_chord**2, 0.0))
    area = (
        big**2 * np.arctan2(half_chord, to_chord)
        + small**2 * np.arctan2(half_chord, x - to_chord)
        - x * half_chord
    )
    return np.where(crossing, area, np.where(d <= big - small, inside, 0.0))


@lru_cache(maxsize=16)
def band_averaged_otf(obscuration: float, ratio: float) -> CubicSpline:
    """Band-averaged annular OTF as a spline in frequency over the highest cut-off.

    ``ratio`` is the longest over the shortest wavelength. At each frequency the mean over
    wavelength is split where the integrand has kinks, and each piece is integrated by
    Gauss-Legendre after a substitution that removes the 3/2 powers at its ends.
    """
    kinks = np.array([1.0, obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2])
    kinks = kinks[kinks > 0]
    corners = np.concatenate([kinks, kinks / ratio])
    # knots crowd where the mean itself has its kinks, of the power 5/2
    crowd = corners[:, None] + CROWD * np.linspace(-1, 1, 121) * np.abs(np.linspace(-1, 1, 121))
    k = np.concatenate([np.linspace(0, 1, 6001), crowd.ravel()])
    # two knots at nearly one place would spoil the spline: its slope between them is rounding
    k = APART * np.unique(np.rint(k[(k >= 0) & (k <= 1)] / APART))
    x, w = np.polynomial.legendre.leggauss(20)
    s = 0.5 * (x + 1)
    smooth, slope = s**2 * (3 - 2 * s), 6 * s * (1 - s) * 0.5 * w
    with np.errstate(divide="ignore"):
        edges = np.clip(kinks[None, :] / k[:, None], 1.0, ratio)
    edges = np.sort(np.column_stack([np.ones_like(k), edges, np.full_like(k, ratio)]), axis=1)
    mean = np.zeros_like(k)
    for low, high in zip(edges.T[:-1], edges.T[1:], strict=True):
        wavelength = low[:, None] + (high - low)[:, None] * smooth
        weight = (high - low)[:, None] * slope * wavelength
        mean += np.sum(weight * annular_otf(k[:, None] * wavelength, obscuration), axis=1)
    return CubicSpline(k, mean / (0.5 * (ratio**2 - 1)))

"""The pixel scale that a FITS header states."""

from __future__ import annotations

import warnings
from typing import Any

import astropy.units as u
import numpy as np
from astropy.io import fits
from astropy.wcs import WCS

# cards in arcsec, as of the PSF programs STPSF (WebbPSF) and Tiny Tim
CARDS = ("PIXELSCL", "PIXSCALE")
# relative difference of the sides, and cosine of the angle between them, of square pixels
SQUARE = 1e-3


def stated_pixel_scale(header: fits.Header) -> float | None:
    """Return the side of a pixel in arcsec, None where the header does not state it.

    It is taken from ``PIXELSCL`` or ``PIXSCALE`` in arcsec, else from a WCS whose first two
    axes are angles.

    Raises
    ------
    ValueError
        If the pixels are not square, or a card is no positive number.
    """
    for card in CARDS:
        if card in header:
            return _positive(card, header[card])
    matrix = _matrix(header)
    if matrix is None:
        return None
    side_x, side_y = np.hypot(*matrix)
    if not (side_x > 0 and side_y > 0):
        return None
    skew = abs(float(matrix[:, 0] @ matrix[:, 1])) / (side_x * side_y)
    if abs(side_x - side_y) > SQUARE * side_x or skew > SQUARE:
        raise ValueError(
            f"its pixels are not square: {side_x:.6g} by {side_y:.6g} arcsec at an angle of "
            f"{np.degrees(np.arccos(skew)):.2f} degrees; resample it to square ones first."
        )
    return float(np.sqrt(side_x * side_y))


def _matrix(header: fits.Header) -> Any:
    """Return the steps on the sky in arcsec of one pixel along x and along y, as columns."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            wcs = WCS(header, naxis=2)
            units = [u.Unit(unit) for unit in wcs.wcs.cunit]
            if not (wcs.has_celestial or all(unit.is_equivalent(u.arcsec) for unit in units)):
                return None
            matrix = np.array(wcs.pixel_scale_matrix)
            factors = [float(unit.to(u.arcsec)) for unit in units]
        except Exception:
            # What wcslib and astropy raise on a broken header is not restricted to a few types.
            return None
    return matrix * np.array(factors)[:, None]


def _positive(card: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{card} is {value!r}; it must be a number of arcsec.") from None
    if not (np.isfinite(number) and number > 0):
        raise ValueError(f"{card} is {number}; it must be a positive number of arcsec.")
    return number

"""From right ascension and declination to the frame's pixels, and back."""

from __future__ import annotations

import numpy as np
from astropy.coordinates import SkyCoord
from astropy.wcs import WCS
from numpy.typing import ArrayLike, NDArray

from .fits_header import wcs_header
from .observation import Observation

Array = NDArray[np.float64]
# Degrees from the frame's centre; the gnomonic projection ends at 90.
FARTHEST_ON_SKY = 80.0


def frame_wcs(observation: Observation) -> WCS:
    """Celestial coordinates of a frame that has a pointing.

    Raises
    ------
    ValueError
        If the observation has no pointing.
    """
    if observation.pointing is None:
        raise ValueError("the frame has no position on the sky; give the observation a pointing.")
    return WCS(wcs_header(observation))


def sky_to_frame(
    ra: ArrayLike, dec: ArrayLike, observation: Observation
) -> tuple[Array, Array, Array]:
    """Find positions on the sky in the frame.

    Parameters
    ----------
    ra, dec : array_like, shape (n,)
        ICRS, degrees.
    observation : Observation
        The frame; it has a pointing.

    Returns
    -------
    x, y : ndarray, shape (n,)
        Pixels; the centre of the first one is (0, 0).
    north : ndarray, shape (n,)
        Direction of north at each position, degrees from +y counter-clockwise. A position
        angle on the sky plus this is one in the frame.

    Raises
    ------
    ValueError
        If a position is not finite or too far from the frame; the message names the row.
    """
    wcs = frame_wcs(observation)
    ra, dec = (np.asarray(angle, dtype=np.float64) for angle in (ra, dec))
    for row in np.flatnonzero(~(np.isfinite(ra) & (np.abs(ra) <= 720))):
        raise ValueError(f"row {row}, ra: {ra[row]:g} degrees is no right ascension.")
    for row in np.flatnonzero(~(np.abs(dec) <= 90)):
        raise ValueError(f"row {row}, dec: {dec[row]:g} degrees is no declination.")
    far = _separation(ra, dec, *wcs.wcs.crval)
    for row in np.flatnonzero(far > FARTHEST_ON_SKY):
        raise ValueError(
            f"row {row}, ra, dec: ({ra[row]:g}, {dec[row]:g}) lies {far[row]:.0f} degrees from "
            "the frame's centre; remove it, or mend the observation's pointing."
        )
    if not ra.size:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    x, y = wcs.wcs_world2pix(ra, dec, 0)
    # Towards the equator near the north pole, lest the step go over it.
    step = np.where(dec > 0, -1e-4, 1e-4)
    x_step, y_step = wcs.wcs_world2pix(ra, dec + step, 0)
    east, up = -(x_step - x) * np.sign(step), (y_step - y) * np.sign(step)
    return x, y, np.degrees(np.arctan2(east, up))


def frame_to_sky(x: ArrayLike, y: ArrayLike, observation: Observation) -> tuple[Array, Array]:
    """Right ascension and declination (ICRS, degrees) of pixels of the frame."""
    ra, dec = frame_wcs(observation).wcs_pix2world(np.asarray(x), np.asarray(y), 0)
    return ra, dec


def _separation(ra: Array, dec: Array, ra_0: float, dec_0: float) -> Array:
    """Angle between positions and one position, degrees (haversine formula)."""
    a, d, a_0, d_0 = (np.radians(angle) for angle in (ra, dec, ra_0, dec_0))
    half = np.sin((d - d_0) / 2) ** 2 + np.cos(d) * np.cos(d_0) * np.sin((a - a_0) / 2) ** 2
    separation: Array = np.degrees(2 * np.arcsin(np.sqrt(np.clip(half, 0, 1))))
    return separation


def read_position(text: str) -> SkyCoord:
    """Read a position on the sky that was typed.

    Parameters
    ----------
    text : str
        Right ascension and declination, such as ``22h40m30s +3d21m31s``, ``22:40:30 +3:21:31``
        or, in degrees, ``340.1 3.36``.

    Raises
    ------
    ValueError
        If it is no position; the message says what one looks like.
    """
    try:
        ra, dec = (float(word) for word in text.split())
    except ValueError:
        try:
            return SkyCoord(text, unit=("hourangle", "deg"))
        except (ValueError, TypeError):
            raise ValueError(
                f'pointing is {text!r}; give two angles such as "22h40m30s +3d21m31s" or, in '
                'degrees, "340.1 3.36".'
            ) from None
    if not -90 <= dec <= 90:
        raise ValueError(f"pointing is {text!r}; its declination must be from -90 to 90 degrees.")
    return SkyCoord(ra, dec, unit="deg")

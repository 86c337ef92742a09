"""From offsets on the sky, east and north in arcsec, to the frame's pixels."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy.coordinates import SkyCoord
from numpy.typing import ArrayLike, NDArray

from .frame_coordinates import sky_to_frame
from .observation import Observation

Array = NDArray[np.float64]


def anchor(centre: Any, observation: Observation) -> tuple[float, float, float]:
    """Find the place in the frame that offsets are counted from.

    Parameters
    ----------
    centre : (float, float) or SkyCoord, optional
        Pixels (x, y), a position on the sky (the observation then has a pointing), or None for
        the frame's centre.
    observation : Observation
        The frame.

    Returns
    -------
    x, y : float
        Pixels; the centre of the first one is (0, 0).
    north : float
        Direction of north there, degrees from +y counter-clockwise: minus the roll, and off
        the frame's centre also what the meridians turn by.

    Raises
    ------
    ValueError
        If the centre is neither, or on the sky and the frame has no place there.
    """
    ny, nx = observation.shape
    if isinstance(centre, SkyCoord):
        if not centre.isscalar:
            raise ValueError(f"centre is {centre!r}; give one position.")
        place = centre.icrs
        x, y, north = sky_to_frame([place.ra.deg], [place.dec.deg], observation)
        return float(x[0]), float(y[0]), float(north[0])
    try:
        xy = ((nx - 1) / 2, (ny - 1) / 2) if centre is None else tuple(map(float, centre))
        x_0, y_0 = xy
    except (TypeError, ValueError):
        raise ValueError(
            f"centre is {centre!r}; give (x, y) in pixels, or a SkyCoord where the observation "
            "has a pointing."
        ) from None
    if not (np.isfinite(x_0) and np.isfinite(y_0)):
        raise ValueError(f"centre is {centre!r}; it must be finite.")
    return x_0, y_0, -observation.roll


def offsets_to_frame(
    east: ArrayLike, north: ArrayLike, place: tuple[float, float, float], pixel_scale: float
) -> tuple[Array, Array]:
    """Turn offsets on the sky into pixels.

    Parameters
    ----------
    east, north : array_like, shape (n,)
        Arcsec from the anchor.
    place : (float, float, float)
        What `anchor` returned.
    pixel_scale : float
        Arcsec per pixel.

    Returns
    -------
    x, y : ndarray, shape (n,)
        Pixels. With north up, east is to the left, -x. The sky is taken flat: exact to
        1e-6 arcsec over 15.
    """
    x_0, y_0, angle = place
    sin, cos = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    east, north = (np.asarray(offset, dtype=np.float64) / pixel_scale for offset in (east, north))
    return x_0 - east * cos - north * sin, y_0 - east * sin + north * cos

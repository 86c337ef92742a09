"""Images of many point sources on small windows, by one Fourier series for all."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .derivatives import POINT
from .moving import highest_frequency, point_reach
from .optics import Optics

Array = NDArray[np.float64]

# of a point's peak: frequencies that add up to less are left out...
TAIL = 1e-8
# ...and what wraps around is fainter
WRAPPED = 1e-8
# frequencies along an axis beyond which a series is not worth it: PSFs of wide wings
MOST_FREQUENCIES = 1500


def point_images(optics: Optics, y: Array, x: Array, half: int) -> Array | None:
    """Images of points of 1 cps on windows around the pixels in which they lie.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    y, x : ndarray, shape (n,)
        Positions in pixels.
    half : int
        The windows reach so many pixels to either side of ``rint(y)`` and ``rint(x)``.

    Returns
    -------
    ndarray, shape (n, 2 half + 1, 2 half + 1), or None
        Correct to about 1e-7 of the peak; None where the PSF is an image or reaches too far.
    """
    if not optics.radial:
        return None
    series = _series(optics, half)
    if series is None:
        return None
    k, spectrum = series
    rows, columns = _cosines(y, k, half), _cosines(x, k, half)
    along = (rows.reshape(-1, k.size) @ spectrum).reshape(rows.shape)
    images: Array = np.matmul(along, columns.transpose(0, 2, 1))
    return images


@lru_cache(maxsize=16)
def _series(optics: Optics, half: int) -> tuple[Array, Array] | None:
    """Frequencies >= 0 in cycles per pixel, and the weights of their cosines."""
    period = int(point_reach(optics, WRAPPED / optics.point_area)) + half + 1
    limit = highest_frequency(optics, POINT, 1.0, TAIL / optics.point_area)
    if limit * period > MOST_FREQUENCIES:
        return None
    k = np.arange(int(limit * period) + 1) / period
    weight = np.where(k == 0, 1.0, 2.0) / period
    spectrum: Array = optics.transfer(k, k).real * weight[:, None] * weight
    return k, spectrum


def _cosines(position: Array, k: Array, half: int) -> Array:
    """Cosines of the pixels around each position, shape (n, 2 half + 1, len(k))."""
    omega = 2 * np.pi * k
    pixel = np.outer(np.arange(-half, half + 1.0), omega)
    shift = np.outer(position - np.rint(position), omega)[:, None]
    result: Array = np.cos(pixel) * np.cos(shift) + np.sin(pixel) * np.sin(shift)
    return result

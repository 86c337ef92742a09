"""Images of other telescopes and programs, and where they lie in our frame."""

from __future__ import annotations

import logging
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from astropy.io import fits
from astropy.wcs import WCS
from numpy.typing import NDArray

from .fits_table import open_fits
from .frame_coordinates import frame_wcs
from .observation import Observation
from .reading import one_line

Array = NDArray[np.float64]

# Pixels of our frame by which an image may lie wrong before one is told.
LARGEST_DEVIATION = 1.0
_SAMPLES = 15


class DistortionWarning(UserWarning):
    """An image cannot be laid under the frame by straight lines alone."""


@dataclass(frozen=True, eq=False)
class FitsImage:
    """An image of a FITS file.

    Attributes
    ----------
    data : ndarray, shape (ny, nx)
        The image, in the machine's byte order; row 0 is drawn at the bottom.
    header : astropy.io.fits.Header
        Its header.
    transform : ndarray, shape (3, 3), or None
        From its pixels to the frame's: ``transform @ [y, x, 1]`` is ``[y, x, 1]`` in the frame,
        both with (0, 0) at the centre of the first pixel. None where either of the two has no
        celestial coordinates.
    deviation : float
        Largest error of ``transform`` over the whole image, pixels of the frame.
    deviation_in_frame : float
        The same where the image lies in the frame; 0 where it does not.
    note : str
        A sentence on how the image lies, or why that is not known.
    """

    data: NDArray[Any]
    header: fits.Header
    transform: Array | None
    deviation: float
    deviation_in_frame: float
    note: str


def read_image(
    path: str | os.PathLike[str],
    observation: Observation | None = None,
    *,
    hdu: int | str | None = None,
) -> FitsImage:
    """Read an image from any FITS file, and find where it lies in the frame.

    Parameters
    ----------
    path : path-like
        The file, gzip-packed or not.
    observation : Observation, optional
        The frame; it has a pointing if the image is to be laid under it.
    hdu : int or str, optional
        Number or name of the header-data unit; by default the first one that holds an image of
        two dimensions. Further axes of length 1 are dropped.

    Returns
    -------
    FitsImage

    Raises
    ------
    ValueError
        If the file is empty, damaged, or holds no such image.
    OSError
        If it cannot be opened.

    Warns
    -----
    DistortionWarning
        If the image's projection and distortion cannot be followed by a linear transform to
        one pixel of the frame.
    """
    with open_fits(path) as hdus:
        chosen = _choose(hdus, hdu)
        header = chosen.header.copy()
        data = np.asarray(chosen.data)
        data = data.reshape(data.shape[-2:]).astype(data.dtype.newbyteorder("="))
    with warnings.catch_warnings(), _quiet():
        warnings.simplefilter("ignore")
        transform, deviation, in_frame, note = _placed(header, data.shape, observation)
    if max(deviation, in_frame) > LARGEST_DEVIATION:
        warnings.warn(f"{path}: {note}", DistortionWarning, stacklevel=2)
    return FitsImage(data, header, transform, deviation, in_frame, note)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep astropy's remarks on other people's headers off the screen."""
    logger = logging.getLogger("astropy")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(level)


def _choose(hdus: fits.HDUList, hdu: int | str | None) -> Any:
    if hdu is None:
        for candidate in hdus:
            if _is_image(candidate):
                return candidate
        raise ValueError("the file holds no image of two dimensions.")
    try:
        chosen = hdus[hdu]
    except (KeyError, IndexError, TypeError):
        names = ", ".join(f"{i} {one.name}".strip() for i, one in enumerate(hdus))
        raise ValueError(f"the file has no extension {hdu!r}; it has {names[:150]}.") from None
    if not _is_image(chosen):
        raise ValueError(f"extension {hdu!r} is no image of two dimensions; choose another.")
    return chosen


def _is_image(hdu: Any) -> bool:
    shape = hdu.shape if hdu.is_image else ()
    return len(shape) >= 2 and all(n == 1 for n in shape[:-2]) and min(shape[-2:]) > 0


def _placed(
    header: fits.Header, shape: tuple[int, ...], observation: Observation | None
) -> tuple[Array | None, float, float, str]:
    """Transform, its two deviations, and a sentence on them."""
    if observation is None or observation.pointing is None:
        return None, 0.0, 0.0, "the frame has no position on the sky"
    try:
        theirs = WCS(header, naxis=2)
    except Exception as error:
        # What wcslib and astropy raise on a broken header is not restricted to a few types.
        return None, 0.0, 0.0, f"the image's coordinates cannot be read ({one_line(error)})"
    if not theirs.has_celestial:
        return None, 0.0, 0.0, "the image has no coordinates on the sky"
    try:
        return _linearised(theirs, shape, observation)
    except Exception as error:
        return None, 0.0, 0.0, f"the image does not lie near the frame ({one_line(error, 100)})"


def _linearised(
    theirs: WCS, shape: tuple[int, ...], observation: Observation
) -> tuple[Array, float, float, str]:
    ours = frame_wcs(observation)

    def in_frame(y: Any, x: Any) -> Array:
        found = ours.world_to_pixel(theirs.pixel_to_world(x, y).icrs)
        return np.stack([np.asarray(found[1]), np.asarray(found[0])])

    x, y = theirs.world_to_pixel(observation.pointing)
    corner = np.array(shape) - 1
    centre = np.clip([float(y), float(x)], 0, corner)
    step = np.array([[0.5, 0.0], [-0.5, 0.0], [0.0, 0.5], [0.0, -0.5]]) + centre
    up, down, right, left = in_frame(step[:, 0], step[:, 1]).T
    linear = np.stack([up - down, right - left], axis=1)
    transform = np.eye(3)
    transform[:2, :2] = linear
    transform[:2, 2] = in_frame(*centre) - linear @ centre
    if not np.isfinite(transform).all() or abs(np.linalg.det(linear)) < 1e-12:
        raise ValueError("no pixel of it is seen from there")
    whole = _deviation(in_frame, transform, np.zeros(2) - 0.5, corner + 0.5)
    # Their pixels under our frame, by the transform itself.
    low, high = np.array([-0.5, -0.5]), np.array(observation.shape) - 0.5
    points = np.stack([grid.ravel() for grid in _grid(low, high)])
    back = np.linalg.solve(linear, points - transform[:2, 2:])
    seen = ((back >= -0.5) & (back <= corner[:, None] + 0.5)).all(axis=0)
    inside = 0.0
    if seen.any():
        inside = float(np.abs(in_frame(*back[:, seen]) - points[:, seen]).max())
    size = np.sqrt(abs(np.linalg.det(linear)))
    note = f"one pixel of the image is {size:.3g} pixels of the frame"
    if not seen.any():
        note += "; it lies outside the frame"
    if max(whole, inside) > LARGEST_DEVIATION:
        note += (
            f"; drawn without distortion it is off by up to {whole:.3g} pixels of the frame, "
            f"within the frame by up to {inside:.2g}"
        )
    return transform, whole, inside, note


def _deviation(in_frame: Any, transform: Array, low: Array, high: Array) -> float:
    y, x = (grid.ravel() for grid in _grid(low, high))
    straight = transform[:2] @ np.stack([y, x, np.ones_like(x)])
    difference = np.abs(in_frame(y, x) - straight)
    return float(np.where(np.isfinite(difference), difference, np.inf).max())


def _grid(low: Array, high: Array) -> tuple[Array, Array]:
    y, x = (np.linspace(low[axis], high[axis], _SAMPLES) for axis in (0, 1))
    return tuple(np.meshgrid(y, x, indexing="ij"))  # type: ignore[return-value]

"""Save an image layer as FITS: the whole exposure, or a plain image of anything else."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy.io import fits

from ..exposure import Exposure
from ..fits_io import write_exposure
from ..safe_write import replacing
from .marks import MARKER


def write_fits(path: str, data: Any, meta: dict[str, Any]) -> list[str]:
    """Write an image layer; called by napari, which has asked before overwriting.

    The image of a scene is written with its expected counts, sources and header, see
    `napari_issis.fits_io`; other layers as plain images.

    Parameters
    ----------
    path : str
        The file.
    data : array_like
        The layer's data.
    meta : dict
        The layer's attributes.

    Returns
    -------
    list of str
        The file written.

    Raises
    ------
    ValueError
        If FITS cannot hold the data.
    OSError
        If the file cannot be written.
    """
    mark = meta.get("metadata", {}).get(MARKER, {})
    exposure = mark.get("exposure") if isinstance(mark, dict) else None
    if isinstance(exposure, Exposure) and np.array_equal(exposure.counts, data):
        write_exposure(exposure, path, overwrite=True)
        return [path]
    image = np.asarray(data)
    if image.dtype == bool:
        image = image.astype(np.uint8)
    if image.dtype.kind not in "iuf" or image.dtype.itemsize > 8:
        raise ValueError(
            f"layer {meta.get('name', '')!r} holds {image.dtype} values, which FITS images "
            "cannot; convert it to integers or floats first."
        )
    if image.dtype == np.float16:
        image = image.astype(np.float32)
    with replacing(path, (".fits", ".fit", ".fts"), overwrite=True) as file:
        fits.PrimaryHDU(image).writeto(file)
    return [path]

"""Save an image layer as FITS: the whole exposure, or a plain image of anything else."""

from __future__ import annotations

from typing import Any

import numpy as np
from astropy.io import fits

from ..exposure import Exposure
from ..fits_io import SUFFIXES, write_exposure
from ..safe_write import replacing
from .marks import MARKER


def write_fits(path: str, data: Any, meta: dict[str, Any]) -> list[str]:
    """Write an image layer; called by napari, which has asked before overwriting.

    The image of a scene is written with its expected counts, sources and header, see
    `napari_issis.fits_io`; other layers as plain images.

    Parameters
    ----------
    path : str
        The file; ``.fits`` is appended to a name without a suffix of FITS files, and no
        existing file is overwritten then, as nobody has been asked about it.
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
    target = fits_path(path)
    overwrite = target == path
    mark = meta.get("metadata", {}).get(MARKER, {})
    exposure = mark.get("exposure") if isinstance(mark, dict) else None
    if isinstance(exposure, Exposure) and np.array_equal(exposure.counts, data):
        write_exposure(exposure, target, overwrite=overwrite)
        return [target]
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
    with replacing(target, SUFFIXES, overwrite=overwrite) as file:
        fits.PrimaryHDU(image).writeto(file)
    return [target]


def fits_path(path: str) -> str:
    """Return the path with ``.fits`` appended unless it ends as those of FITS files do."""
    return path if path.lower().endswith(SUFFIXES) else f"{path}.fits"

"""Save an image layer as FITS: the whole exposure, or a plain image of anything else."""

from __future__ import annotations

from typing import Any

import napari
import numpy as np
from astropy.io import fits
from napari.utils.transforms import Affine

from ..exposure import Exposure
from ..fits_header import layer_header
from ..fits_io import SUFFIXES, write_exposure
from ..safe_write import replacing
from .marks import MARKER
from .scene import scene_of


def write_fits(path: str, data: Any, meta: dict[str, Any]) -> list[str]:
    """Write an image layer; called by napari, which has asked before overwriting.

    The image of a scene is written with its expected counts, sources and header, see
    `napari_issis.fits_io`; other layers as plain images, with the coordinates of the frame
    where they lie in it. Of a layer with several resolutions the finest is written, and the
    colours of a picture become planes.

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
    image = np.asarray(data[0] if meta.get("multiscale") else data)
    if meta.get("rgb"):
        image = np.moveaxis(image, -1, 0)
    if image.dtype == bool:
        image = image.astype(np.uint8)
    if image.dtype.kind not in "iuf" or image.dtype.itemsize > 8:
        raise ValueError(
            f"layer {meta.get('name', '')!r} holds {image.dtype} values, which FITS images "
            "cannot; convert it to integers or floats first."
        )
    if image.dtype == np.float16:
        image = image.astype(np.float32)
    header = _header(meta)
    with replacing(target, SUFFIXES, overwrite=overwrite) as file:
        fits.PrimaryHDU(image, header).writeto(file, output_verify="exception", checksum=True)
    return [target]


def _header(meta: dict[str, Any]) -> fits.Header:
    """Coordinates of a layer that is drawn in the frame of the viewer's scene, and its unit."""
    header = fits.Header()
    theirs = meta.get("metadata", {}).get("header", {})
    unit = theirs.get("BUNIT") if isinstance(theirs, dict) else None
    if isinstance(unit, str) and unit.isascii() and unit.isprintable() and len(unit) < 60:
        header["BUNIT"] = unit
    viewer = napari.current_viewer()
    scene = None if viewer is None else scene_of(viewer)
    units = [str(unit) for unit in meta.get("units") or ()]
    if scene is None or units != ["arcsecond", "arcsecond"]:
        return header
    own = Affine(
        scale=meta["scale"],
        translate=meta["translate"],
        rotate=meta["rotate"],
        shear=meta["shear"],
    )
    to_frame = np.asarray(meta["affine"]) @ own.affine_matrix
    scale = scene.observation.pixel_scale
    to_frame = np.diag([1 / scale, 1 / scale, 1.0]) @ to_frame
    return header + layer_header(to_frame, scene.observation)


def fits_path(path: str) -> str:
    """Return the path with ``.fits`` appended unless it ends as those of FITS files do."""
    return path if path.lower().endswith(SUFFIXES) else f"{path}.fits"

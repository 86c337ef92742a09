"""Make a source of an image: a frame of another telescope, a lens model's arcs."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import ArrayLike

from .instruments import PIXEL_SCALE
from .kept_images import keep
from .psf import positive
from .source_image import ARRAY, SourceImage
from .sources import FLUX_UNIT, IMAGE, check_sources
from .spectra import Spectrum

# Negative light of an image over all its light, beyond which one is warned.
MOST_NEGATIVE = 0.01


class NegativeLightWarning(UserWarning):
    """An image has much negative light, of which no counts can be drawn."""


def image_source(
    image: str | os.PathLike[str] | ArrayLike,
    x: float,
    y: float,
    flux: Any,
    *,
    pixel_scale: float | None = None,
    pa: Any = 0.0,
    mirrored: bool = False,
    hdu: int | str | None = None,
    spectrum: str | Spectrum | None = None,
    frame_pixel_scale: float = PIXEL_SCALE,
) -> QTable:
    """Make a source table of one row whose light is distributed as in an image.

    Parameters
    ----------
    image : path-like or array_like, shape (ny, nx)
        A FITS file, or surface brightness in any unit, ``[y, x]``; the sky subtracted. Samples
        may be negative, their sum not.
    x, y : float
        Where the centre of the image comes to lie, pixels: the geometric centre of the array,
        ((nx - 1) / 2, (ny - 1) / 2). The centre of the frame's first pixel is (0, 0).
    flux : float or Quantity or Magnitude
        Flux of the whole image in erg s-1 cm-2 A-1, or AB magnitude (with its unit).
    pixel_scale : float, optional
        Spacing of the samples, arcsec. By default that of the file's header: ``PIXELSCL`` or
        ``PIXSCALE``, else its WCS.
    pa : float or Quantity
        Direction in the frame of the image's +y axis, degrees from the frame's +y
        counter-clockwise towards -x.
    mirrored : bool
        Whether to exchange left and right first, as an image needs whose east is to the right.
    hdu : int or str, optional
        Number or name of the file's extension; by default the first with an image.
    spectrum : str or Spectrum, optional
        One spectrum for the whole image, as for `napari_issis.source`.
    frame_pixel_scale : float
        Arcsec per pixel of the frame, by default that of ISSIS; `Observation.pixel_scale`.

    Returns
    -------
    astropy.table.QTable
        Columns ``kind x y flux r_half ellipticity pa image`` (and ``spectrum``). ``r_half`` is
        the radius of the circle about the image's centre that holds half of its light (see
        `SourceImage.r_half`), in pixels of the frame: it is the image's size in the table, and
        whoever changes it scales the image. The ellipticity is 0.

    Raises
    ------
    ValueError
        If the image or a value is not valid, or no pixel scale is given or found; the message
        names it.
    OSError
        If the file cannot be opened.

    Warns
    -----
    NegativeLightWarning
        If negative samples hold more than 1 % of the light.

    Notes
    -----
    How the image is interpolated: see `SourceImage`. The interpolated image is convolved with
    the PSF and the pixel like any other source.
    """
    if isinstance(image, str | os.PathLike):
        from .fits_image import read_image
        from .fits_pixel_scale import stated_pixel_scale

        read = read_image(image, hdu=hdu)
        samples: Any = read.data
        name = str(Path(image).resolve())
        if pixel_scale is None:
            try:
                pixel_scale = stated_pixel_scale(read.header)
            except ValueError as error:
                raise ValueError(f"{image}: {error}") from None
        if pixel_scale is None:
            raise ValueError(
                f"{image} does not say its pixel scale (PIXELSCL or a WCS in angles); "
                "give pixel_scale in arcsec."
            )
    else:
        samples, name = image, ARRAY
        if pixel_scale is None:
            raise ValueError("an array has no pixel scale; give pixel_scale in arcsec.")
        if hdu is not None:
            raise ValueError(f"hdu is {hdu!r}, but an array has no extensions.")
    scale = positive("pixel_scale", pixel_scale, "arcsec per pixel")
    frame = positive("frame_pixel_scale", frame_pixel_scale, "arcsec per pixel")
    light = SourceImage(np.fliplr(samples) if mirrored else samples, name)
    if light.negative_light > MOST_NEGATIVE:
        warnings.warn(
            f"negative samples of the image hold {100 * light.negative_light:.2g} % of its light; "
            "where the expected rate is below zero no counts are drawn, and the image gets "
            "brighter by as much. Set noise around the source to 0 to avoid that.",
            NegativeLightWarning,
            stacklevel=2,
        )
    columns: dict[str, Any] = {
        "kind": np.array([IMAGE], dtype="U13"),
        "x": [x],
        "y": [y],
        "flux": np.atleast_1d(flux if hasattr(flux, "unit") else flux * FLUX_UNIT),
        "r_half": [light.r_half * scale / frame] * u.pix,
        "ellipticity": [0.0],
        "pa": np.atleast_1d(pa if hasattr(pa, "unit") else pa * u.deg),
        "image": [keep(light)],
    }
    if spectrum is not None:
        columns["spectrum"] = [str(spectrum)]
    table = QTable(columns)
    check_sources(table)
    return table

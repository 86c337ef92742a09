"""Images that sources are, as FITS stores them."""

from __future__ import annotations

import re

import numpy as np
from astropy.io import fits
from astropy.table import Table

from .source_image import SourceImage, keep, kept_images

NAME = "LIGHT"
_NUMBERED = re.compile(rf"{NAME}\d+")


def image_hdus(sources: Table) -> list[fits.ImageHDU]:
    """Make an extension of each image that a source table names."""
    images = dict.fromkeys(kept_images(sources).values())
    return [
        fits.ImageHDU(
            image.array,
            fits.Header([("DIGEST", image.digest, "names the image in the column image")]),
            f"{NAME}{number}",
        )
        for number, image in enumerate(images, start=1)
    ]


def keep_images(hdus: fits.HDUList) -> None:
    """Keep the images of a file that `image_hdus` made, so that its table may name them.

    Raises
    ------
    ValueError
        If one is damaged.
    """
    for hdu in hdus:
        if hdu.is_image and _NUMBERED.fullmatch(hdu.name) and "DIGEST" in hdu.header:
            image = SourceImage(np.asarray(hdu.data))
            if image.digest != hdu.header["DIGEST"]:
                raise ValueError(f"the image {hdu.name} is damaged: it is not the one stored.")
            keep(image)

"""The images that source tables name.

A table names an image by a text, ``path#digest`` or ``array#digest``; the digest is of the
samples. The images themselves are kept here, for as long as the program runs, and in the FITS
file of an exposure.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .source_image import ARRAY, MOST_SAMPLES, SourceImage
from .sources import IMAGE, image_texts

_kept: dict[str, SourceImage] = {}


def keep(image: SourceImage) -> str:
    """Keep an image so that source tables can name it, and return its text."""
    _kept.setdefault(image.digest, image)
    return image.text


def kept_image(text: str) -> SourceImage:
    """Return the image that a text of a source table names.

    One that is not kept is looked for in the file that the text names.

    Raises
    ------
    ValueError
        If there is none; the message says what to do.
    """
    name, mark, digest = text.rpartition("#")
    if not mark or not name:
        raise ValueError(
            f"{text!r} names no image; make the source with napari_issis.image_source."
        )
    if digest not in _kept and name != ARRAY:
        found = _found(Path(name), digest)
        if found is not None:
            keep(found)
    if digest not in _kept:
        where = "" if name == ARRAY else f", and {name} holds no image with that digest"
        raise ValueError(
            f"the image {text!r} is not loaded{where}; load it with napari_issis.image_source, "
            "or open the FITS file of an exposure, which holds its images."
        )
    return _kept[digest]


def kept_images(table: Any) -> dict[str, SourceImage]:
    """Return the images that a source table names, by their texts, in the order of the rows."""
    texts = image_texts(table)
    if texts is None:
        return {}
    imaged = [str(kind).strip() == IMAGE for kind in table["kind"]]
    return {text: kept_image(text) for text in dict.fromkeys(texts[imaged].tolist())}


def check_in_files(table: Any) -> None:
    """Raise a ValueError if an image of a source table cannot be read again from a file."""
    texts = image_texts(table)
    for text, image in kept_images(table).items():
        name = text.rpartition("#")[0]
        if name == ARRAY or not _found(Path(name), image.digest):
            assert texts is not None
            row = int(np.argmax(texts == text))
            lies = "was an array" if name == ARRAY else f"is no longer in {name}"
            raise ValueError(
                f"row {row}, image: the image {lies}, and this format holds no images; "
                "write the table, or an exposure of it, as FITS."
            )


def _found(path: Path, digest: str) -> SourceImage | None:
    """Image of a file that has a digest, mirrored or not, if there is one."""
    from .fits_image import read_image
    from .fits_table import open_fits

    try:
        with open_fits(path) as hdus:
            numbers = [i for i, hdu in enumerate(hdus) if hdu.is_image and len(hdu.shape) >= 2]
        for number in numbers:
            samples = read_image(path, hdu=number).data
            # an image that cannot be a source is not the one
            if samples.size > MOST_SAMPLES or not np.isfinite(samples).all() or samples.sum() <= 0:
                continue
            for one in (samples, np.fliplr(samples)):
                light = SourceImage(one, str(path))
                if light.digest == digest:
                    return light
    except (OSError, ValueError):
        pass
    return None


def restored(array: NDArray[np.float64], text: str) -> SourceImage:
    """Return the image that another process sent, and keep it."""
    image = SourceImage(array, text.rpartition("#")[0])
    keep(image)
    return _kept[image.digest]

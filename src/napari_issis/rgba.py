"""Counts in the colours of a PNG file, and back without loss.

The RGBA data file of the crowded-field image simulator (Shalyapin & Goicoechea 2014, section 4):
counts are red + 256 green + 65536 blue, and the opacity is 255.
"""

from __future__ import annotations

import os
import struct
import zlib
from io import BytesIO

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from PIL.PngImagePlugin import PngImageFile, PngInfo

from .reading import one_line, open_file
from .safe_write import replacing

SUFFIXES = (".png",)
LARGEST = 256**3 - 1
SIGNATURE = b"\x89PNG\r\n\x1a\n"
MARK = "Counts"
RECIPE = "red + 256 green + 65536 blue"
LONGEST_SIDE = 16384
MOST_BYTES = 2**30
# Bytes that one byte can stand for in a deflate stream.
DENSEST = 1032


def write_rgba(path: str | os.PathLike[str], counts: ArrayLike, *, overwrite: bool = False) -> None:
    """Write counts to an RGBA PNG file of 8 bits a channel, row 0 at the bottom.

    Parameters
    ----------
    path : path-like
        The file; its name ends in ``.png``.
    counts : array_like of integers, shape (ny, nx)
        Counts, 0 to 16,777,215.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the name or an image like this is not as above; the message names the pixel.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.

    Notes
    -----
    The file has no colour profile, so that programs show and pass on the plain numbers, and a
    mark with a checksum of the counts, by which `read_rgba` knows them to be untouched.
    """
    values = np.asarray(counts)
    if values.ndim != 2 or values.size == 0 or max(values.shape) > LONGEST_SIDE:
        raise ValueError(
            f"RGBA data are an image of 1 to {LONGEST_SIDE} pixels a side; this one's shape is "
            f"{values.shape}."
        )
    if values.dtype.kind not in "iu":
        raise ValueError(
            f"RGBA data hold whole counts, not values of type {values.dtype}; write FITS instead."
        )
    for bad in (values.min(), values.max()):
        if not 0 <= bad <= LARGEST:
            y, x = np.unravel_index(np.argmax(values == bad), values.shape)
            raise ValueError(
                f"the counts {bad} at [y, x] = [{y}, {x}] do not fit into RGBA data, which hold "
                f"0 to {LARGEST}; write FITS instead."
            )
    colours = (np.flipud(values).astype(np.uint32) | np.uint32(255 << 24)).astype("<u4")
    picture = Image.fromarray(colours.view(np.uint8).reshape(*values.shape, 4), "RGBA")
    text = PngInfo()
    text.add_text("Software", "napari-issis")
    text.add_text(MARK, f"{RECIPE}; CRC-32 {_checksum(values)}")
    text.add_text("Orientation", "row 0 at the bottom")
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        picture.save(file, format="PNG", pnginfo=text)


def read_rgba(path: str | os.PathLike[str], *, unmarked: bool = False) -> NDArray[np.int64]:
    """Read counts from an RGBA PNG file.

    Parameters
    ----------
    path : path-like
        The file.
    unmarked : bool
        Whether to read a file that `write_rgba` has not written too, such as one of CIS. It
        must still have 8 bits a channel and be opaque everywhere; whether its colours are
        counts cannot be seen.

    Returns
    -------
    ndarray of int64, shape (ny, nx)
        Counts; row 0 is at the bottom of the picture.

    Raises
    ------
    ValueError
        If the file is empty, no PNG, broken, not of RGBA colours of 8 bits, not opaque,
        without the mark, or changed since it was written.
    OSError
        If the file cannot be opened.
    """
    with open_file(path) as file:
        content = file.read(MOST_BYTES + 1)
    if not content.startswith(SIGNATURE):
        raise ValueError(f"{path} is not a PNG file.")
    try:
        _check_chunks(content)
        # Not by Image.open, which refuses large frames; the claims have been checked.
        with PngImageFile(BytesIO(content)) as picture:
            picture.load()
            mode, mark = picture.mode, str(picture.info.get(MARK, ""))
            colours = np.array(picture)
    except ValueError as error:
        raise ValueError(f"{path}: {one_line(error)}") from error
    except MemoryError:
        raise
    except Exception as error:
        # What Pillow raises on a broken file is not restricted to a few types.
        raise ValueError(f"{path} is damaged: {one_line(error)}") from error
    if mode != "RGBA" or (colours[..., 3] != 255).any():
        raise ValueError(f"{path} is not opaque everywhere: its colours are no counts.")
    colours[..., 3] = 0
    counts = np.flipud(colours.view("<u4")[..., 0]).astype(np.int64)
    if mark:
        if mark != f"{RECIPE}; CRC-32 {_checksum(counts)}":
            raise ValueError(
                f"{path} was changed by another program: its colours are no longer the counts."
            )
    elif not unmarked:
        raise ValueError(
            f"{path} is a picture, not RGBA data of this program; if its colours are counts all "
            "the same, read it with unmarked=True."
        )
    return counts


def _checksum(counts: NDArray[np.integer]) -> str:
    return f"{zlib.crc32(counts.astype('<u4').tobytes()):08x}"


def _check_chunks(content: bytes) -> None:
    """Check that the file is whole and of RGBA colours, and claims no more than it holds."""
    at, data = len(SIGNATURE), 0
    kinds: list[bytes] = []
    while at < len(content):
        if at + 12 > len(content):
            raise ValueError("the file is truncated.")
        length, kind = struct.unpack_from(">I4s", content, at)
        end = at + 12 + length
        if end > len(content):
            raise ValueError("the file is truncated.")
        if zlib.crc32(content[at + 4 : end - 4]) != struct.unpack_from(">I", content, end - 4)[0]:
            raise ValueError("the file is damaged: a checksum does not match.")
        if not kinds:
            if kind != b"IHDR" or length != 13:
                raise ValueError("the file is damaged: it has no header.")
            width, height, depth, colour = struct.unpack_from(">IIBB", content, at + 8)
        if kind in (b"acTL", b"fdAT", b"tRNS", b"PLTE"):
            raise ValueError("it is an animation or has a palette: its colours are no counts.")
        kinds.append(kind)
        data += length if kind == b"IDAT" else 0
        at = end
    if not kinds or kinds[-1] != b"IEND":
        raise ValueError("the file is truncated.")
    if (depth, colour) != (8, 6):
        raise ValueError("it has other colours than RGBA with 8 bits each, so they are no counts.")
    if not (1 <= width <= LONGEST_SIDE and 1 <= height <= LONGEST_SIDE):
        raise ValueError(f"it claims {width} x {height} pixels; {LONGEST_SIDE} a side at most.")
    if height * (4 * width + 1) > DENSEST * data:
        raise ValueError(f"it claims {width} x {height} pixels, which it does not hold.")

"""What a FITS file claims to hold, compared with what it can hold, before anything is allocated.

A header of a few bytes may claim an image of terabytes, or a compressed one whose pieces grow a
thousandfold. Every claim is checked here against the bytes that are there.
"""

from __future__ import annotations

import re
import zlib
from math import ceil, prod
from typing import Any, BinaryIO

import numpy as np
from astropy.io import fits

BLOCK, CARD = 2880, 80
END = b"END".ljust(CARD)
# Cards in all headers together, and extensions: more than any archive's files have, and read in
# about a second.
MOST_CARDS = 36_000
MOST_EXTENSIONS = 500
# As the standard has it; of columns too.
MOST_AXES = 999
_COUNT = re.compile(rb"(Z?NAXIS|TFIELDS|WCSAXES[A-Z]?) *= *(\d+)", re.IGNORECASE)
# Python multiplies text by repeating it.
_TEXT = re.compile(rb"(BITPIX|[PG]COUNT|NAXIS\d*) *= *'", re.IGNORECASE)
# Bytes that one byte can stand for: in a deflate stream, and in a Rice-compressed one, where 32
# equal pixels of 4 bytes take 6 bits.
DENSEST_GZIP, DENSEST_RICE = 1032, 171
# What a compressed image may hold at most in memory, bytes: the largest frame as 32-bit integers.
MOST_DECOMPRESSED = 4 * 16384**2
# The others are rare, and their decoders trust what they read.
COMPRESSIONS = ("RICE_1", "RICE_ONE", "GZIP_1", "GZIP_2", "NOCOMPRESS")
TILES = ("COMPRESSED_DATA", "GZIP_COMPRESSED_DATA", "UNCOMPRESSED_DATA")


def check_claims(file: BinaryIO, size: int) -> None:
    """Check that a FITS file holds what its headers claim, undamaged.

    Parameters
    ----------
    file : binary file
        The file, seekable.
    size : int
        Its length in bytes.

    Raises
    ------
    ValueError
        If the file is truncated, its ``DATASUM`` cards disagree, or its headers claim what
        cannot be.
    """
    start, cards = 0, _count_cards(file, 0, 0)
    file.seek(0)
    hdus = fits.open(file, memmap=False, disable_image_compression=True)
    for number in range(MOST_EXTENSIONS + 1):
        try:
            hdu = hdus[number]
        except IndexError:
            return
        start = _check_hdu(hdu, hdu.name or f"extension {number}", size)
        if start >= size:
            return
        cards = _count_cards(file, start, cards)
    raise ValueError(f"the file has more than {MOST_EXTENSIONS} extensions.")


def _count_cards(file: BinaryIO, start: int, before: int) -> int:
    """Find the end of the header that starts here, and add its cards to those before it.

    Astropy loops over as many axes and columns as a header claims, and multiplies what stands
    for a size: it must not see such cards.
    """
    position = file.tell()
    file.seek(start)
    cards = before
    while cards <= MOST_CARDS:
        block = file.read(BLOCK)
        cards += BLOCK // CARD
        for at in range(0, len(block), CARD):
            card = block[at : at + CARD]
            if card == END:
                file.seek(position)
                return cards
            text = _TEXT.match(card)
            if text:
                raise ValueError(f"{text[1].decode()} is text in a header, not a whole number.")
            number = _COUNT.match(card)
            if number and int(number[2]) > MOST_AXES:
                name, value = number[1].decode(), number[2].decode()
                raise ValueError(f"{name} is {value} in a header; it is {MOST_AXES} at most.")
        if len(block) < BLOCK:
            raise ValueError("the file is truncated: a header has no END.")
    raise ValueError(f"the headers have more than {MOST_CARDS} cards.")


def _check_hdu(hdu: Any, name: str, size: int) -> int:
    """Check one header-data unit as it is stored, and return where the next one starts."""
    header = hdu.header
    if hdu.__class__.__name__ not in ("PrimaryHDU", "ImageHDU", "BinTableHDU", "TableHDU"):
        raise ValueError(f"{name} is of no kind that can be read ({type(hdu).__name__}).")
    if any(_whole(header, f"NAXIS{axis + 1}") < 0 for axis in range(_whole(header, "NAXIS"))):
        raise ValueError(f"{name} has an axis of negative length.")
    place = hdu.fileinfo()
    start: int = place["datLoc"]
    end: int = start + place["datSpan"]
    if end < start or _whole(header, "PCOUNT", 0) < 0 or _whole(header, "GCOUNT", 1) != 1:
        raise ValueError(f"the header of {name} claims an impossible size.")
    if end > size:
        raise ValueError(f"the file is truncated: {end} bytes are due, it has {size}.")
    if isinstance(hdu, fits.BinTableHDU | fits.TableHDU):
        _check_table(hdu, name)
    if hdu.verify_datasum() == 0:
        raise ValueError(
            f"the data of {name} do not match their DATASUM; the file is damaged or was changed."
        )
    if header.get("ZIMAGE") is True:
        _check_compressed(hdu, name)
    return end


def _check_table(hdu: Any, name: str) -> None:
    """Check that the columns fill the rows and the rows the data, neither more nor less."""
    width, rows = _whole(hdu.header, "NAXIS1"), _whole(hdu.header, "NAXIS2")
    if width == 0 and rows > 0:
        raise ValueError(f"table {name} claims {rows} rows of no width.")
    dtype = hdu.columns.dtype
    columns = dtype.itemsize
    if columns > width or (columns < width and isinstance(hdu, fits.BinTableHDU)):
        raise ValueError(f"the columns of table {name} take {columns} bytes, its rows {width}.")
    for column, offset in (field[:2] for field in (dtype.fields or {}).values()):
        if not 0 <= offset <= width - column.itemsize:
            raise ValueError(f"a column of table {name} lies outside its rows.")


def _check_compressed(hdu: Any, name: str) -> None:
    """Check that a compressed image can come out of the bytes that stand for it."""
    header = hdu.header
    kind = str(header.get("ZCMPTYPE", "")).strip()
    if kind not in COMPRESSIONS:
        raise ValueError(f"image {name} is compressed with {kind}; unpack it first with funpack.")
    sides = [_whole(header, f"ZNAXIS{i + 1}") for i in range(_whole(header, "ZNAXIS"))]
    tile = [_whole(header, f"ZTILE{i + 1}", sides[i] if i == 0 else 1) for i in range(len(sides))]
    if not sides or min(sides) < 1 or min(tile) < 1:
        raise ValueError(f"the compressed image {name} has a side or tile below 1.")
    itemsize = abs(_whole(header, "ZBITPIX")) // 8
    if itemsize not in (1, 2, 4, 8):
        raise ValueError(f"the compressed image {name} has {header['ZBITPIX']} bits per pixel.")
    claimed = itemsize * prod(sides)
    rice = kind.startswith("RICE") and TILES[1] not in hdu.columns.names
    densest = DENSEST_RICE if rice else DENSEST_GZIP
    held = densest * (_whole(header, "PCOUNT") + _whole(header, "NAXIS1") * len(hdu.data))
    if claimed > min(held, MOST_DECOMPRESSED):
        raise ValueError(f"the compressed image {name} claims {claimed} bytes, which cannot be.")
    tiles = prod(ceil(side / step) for side, step in zip(sides, tile, strict=True))
    if tiles != len(hdu.data):
        raise ValueError(f"the compressed image {name} has {len(hdu.data)} of {tiles} tiles.")
    for i in range(1, 20):
        parameter = str(header.get(f"ZNAME{i}", "")).strip()
        if parameter == "BLOCKSIZE" and _whole(header, f"ZVAL{i}") not in (16, 32):
            raise ValueError(f"the compressed image {name} has an impossible BLOCKSIZE.")
        if parameter == "BYTEPIX" and _whole(header, f"ZVAL{i}") not in (1, 2, 4, 8):
            raise ValueError(f"the compressed image {name} has an impossible BYTEPIX.")
    # A tile of floats may be stored as 64-bit ones whatever the image's type.
    largest = 8 * prod(min(step, side) for side, step in zip(sides, tile, strict=True))
    for column in TILES:
        if column in hdu.columns.names:
            gzipped = column.startswith("GZIP") or (column[0] == "C" and kind.startswith("GZIP"))
            _check_tiles(hdu, column, largest if gzipped else None, name)


def _check_tiles(hdu: Any, column: str, largest: int | None, name: str) -> None:
    for tile in hdu.data[column]:
        stream = np.asarray(tile).tobytes()
        if largest is None or not stream:
            continue
        grown = zlib.decompressobj(wbits=31).decompress(stream, largest + 1)
        if len(grown) > largest:
            raise ValueError(f"a tile of the compressed image {name} holds more than its pixels.")


def _whole(header: fits.Header, keyword: str, default: int | None = None) -> int:
    value = header.get(keyword, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{keyword} is {value!r} in a header; it must be a whole number.")
    return value

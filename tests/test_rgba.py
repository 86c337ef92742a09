"""RGBA data: what Pillow and numpy make of the file by the paper's recipe, and our own reader."""

import os
import struct
import warnings
import zlib

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from napari_issis.rgba import read_rgba, write_rgba

RNG = np.random.default_rng(1)
COUNTS = RNG.integers(0, 2**24, (7, 11))
COUNTS[0, 0], COUNTS[6, 10], COUNTS[0, 10], COUNTS[3, 3] = 0, 2**24 - 1, 1, 65536


@pytest.mark.parametrize("dtype", [np.int64, np.uint32, np.int32, ">i4"])
def test_the_recipe_of_the_paper_gives_the_counts(tmp_path, dtype):
    """Catches colours in another order, premultiplied by the opacity, or upside down."""
    write_rgba(tmp_path / "x.png", COUNTS.astype(dtype))
    with Image.open(tmp_path / "x.png") as picture:
        assert picture.mode == "RGBA"
        red, green, blue, opacity = (np.asarray(c).astype(int) for c in picture.split())
    assert (opacity == 255).all()
    # row 0 is at the bottom, as DS9 draws the first row of a FITS image
    np.testing.assert_array_equal((red + 256 * green + 65536 * blue)[::-1], COUNTS)
    np.testing.assert_array_equal(read_rgba(tmp_path / "x.png"), COUNTS)


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (300, 1), (257, 130)])
def test_round_trip(tmp_path, shape):
    counts = RNG.integers(0, 2**24, shape)
    write_rgba(tmp_path / "x.png", counts)
    back = read_rgba(tmp_path / "x.png")
    assert back.dtype == np.int64
    np.testing.assert_array_equal(back, counts)


def test_no_colour_management(tmp_path):
    """Catches chunks by which viewers would change the numbers."""
    write_rgba(tmp_path / "x.png", COUNTS)
    content = (tmp_path / "x.png").read_bytes()
    for chunk in (b"gAMA", b"sRGB", b"iCCP", b"cHRM", b"cICP", b"tRNS", b"sBIT"):
        assert chunk not in content


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        ([[0, 2**24]], r"16777216 at \[y, x\] = \[0, 1\] do not fit .* write FITS instead"),
        ([[0], [-1]], r"-1 at \[y, x\] = \[1, 0\]"),
        ([[2**63]], "9223372036854775808 at"),
        ([[1.0]], "not values of type float64; write FITS instead"),
        ([1, 2], r"this one's shape is \(2,\)"),
        (np.zeros((0, 3), int), r"shape is \(0, 3\)"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, counts, message):
    """Catches counts above 24 bits that wrap around, and rounded floats."""
    with pytest.raises(ValueError, match=message):
        write_rgba(tmp_path / "x.png", counts)
    assert os.listdir(tmp_path) == []


def refused(path, **options):
    with pytest.raises(ValueError, match=path.name) as error:
        read_rgba(path, **options)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300
    return str(error.value)


def test_a_file_without_the_mark_is_a_picture(tmp_path):
    """Catches a photograph read as counts. Files of CIS have no mark: they must be named such."""
    path = tmp_path / "x.png"
    Image.fromarray(np.full((2, 3, 4), 255, np.uint8), "RGBA").save(path)
    assert "is a picture, not RGBA data" in refused(path)
    assert read_rgba(path, unmarked=True).tolist() == [[2**24 - 1] * 3] * 2


@pytest.mark.parametrize("mode", ["RGB", "L", "P", "I;16", "LA", "1"])
def test_other_colours_are_refused_marked_or_not(tmp_path, mode):
    """Catches 16 bits cut to 8, and a palette's indices read as colours."""
    text = PngInfo()
    text.add_text("Counts", "red + 256 green + 65536 blue")
    Image.new(mode, (3, 2)).save(tmp_path / "x.png", pnginfo=text)
    assert "no counts" in refused(tmp_path / "x.png", unmarked=True)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, data, *, depth=8, colour=6, extra=b""):
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + extra
        + chunk(b"IDAT", zlib.compress(data))
        + chunk(b"IEND", b"")
    )


def test_sixteen_bits_are_refused(tmp_path):
    """Pillow would halve them without a word."""
    (tmp_path / "x.png").write_bytes(png(1, 1, bytes(9), depth=16))
    assert "8 bits each" in refused(tmp_path / "x.png", unmarked=True)


def test_transparent_pixels_are_refused(tmp_path):
    (tmp_path / "x.png").write_bytes(png(1, 1, bytes([0, 1, 2, 3, 254])))
    assert "not opaque everywhere" in refused(tmp_path / "x.png", unmarked=True)


def test_gamma_changes_no_number(tmp_path):
    gamma = chunk(b"gAMA", struct.pack(">I", 45455)) + chunk(b"sRGB", b"\0")
    (tmp_path / "x.png").write_bytes(png(1, 1, bytes([0, 1, 2, 3, 255]), extra=gamma))
    assert read_rgba(tmp_path / "x.png", unmarked=True).tolist() == [[1 + 512 + 3 * 65536]]


def test_a_file_that_another_program_changed(tmp_path):
    """Catches a picture that was brightened, cut or turned and still bears the mark."""
    path = tmp_path / "x.png"
    write_rgba(path, COUNTS)
    with Image.open(path) as picture:
        text = PngInfo()
        for key, value in picture.text.items():
            text.add_text(key, value)
        pixels = np.array(picture)
    pixels[2, 2, 1] ^= 1
    Image.fromarray(pixels).save(path, pnginfo=text)
    assert "was changed by another program" in refused(path)


@pytest.mark.parametrize(
    "size", [(16384, 16384), (2**31 - 1, 1), (1, 2**31 - 1), (100_000, 100_000)]
)
def test_giant_dimensions_are_refused_at_once(tmp_path, size):
    """Catches memory set aside for an image that the file cannot hold (a decompression bomb)."""
    (tmp_path / "x.png").write_bytes(png(*size, b"\0" * 100))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert "it claims" in refused(tmp_path / "x.png", unmarked=True)


def test_large_frames_are_no_bombs(tmp_path, monkeypatch):
    """Catches Pillow's limit on pictures, which is below the largest frame."""
    write_rgba(tmp_path / "x.png", COUNTS)
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 30)
    np.testing.assert_array_equal(read_rgba(tmp_path / "x.png"), COUNTS)


def test_broken_files(tmp_path):
    path = tmp_path / "x.png"
    write_rgba(path, COUNTS)
    whole = path.read_bytes()
    for length in range(1, len(whole)):
        path.write_bytes(whole[:length])
        refused(path, unmarked=True)
    path.write_bytes(b"")
    assert "is empty" in refused(path)
    path.write_bytes(b"GIF89a")
    assert "is not a PNG file" in refused(path)
    with pytest.raises(FileNotFoundError, match="cannot read"):
        read_rgba(tmp_path / "none.png")
    flipped = bytearray(whole)
    flipped[whole.index(b"IDAT") + 20] ^= 1
    path.write_bytes(flipped)
    assert "a checksum does not match" in refused(path)
    path.write_bytes(png(2, 2, bytes([0, 1, 2, 3, 255])))
    refused(path, unmarked=True)


def test_an_existing_file_is_kept(tmp_path):
    path = tmp_path / "x.png"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_rgba(path, COUNTS)
    assert path.read_text() == "mine"
    write_rgba(path, COUNTS, overwrite=True)
    np.testing.assert_array_equal(read_rgba(path), COUNTS)

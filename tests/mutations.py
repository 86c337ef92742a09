"""Files of every kind that is read, and seeded ways to break them.

``python tests/mutations.py 100000 [seed]`` breaks that many by hand, and prints what went wrong.
"""

import gzip
import os
import re
import resource
import signal
import struct
import sys
import tempfile
import traceback
import warnings
import zlib
from contextlib import contextmanager, suppress
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import QTable, vstack

from napari_issis import Exposure, ImagePSF, Observation, source
from napari_issis.catalogue import read_catalogue, write_sources
from napari_issis.fits_header import wcs_header
from napari_issis.fits_image import DistortionWarning, read_image
from napari_issis.rgba import read_rgba, write_rgba
from napari_issis.sources import check_sources

CENTRE = SkyCoord(150.0, 60.0, unit="deg")
FRAME = Observation(shape=(6, 8), pointing=CENTRE, roll=30.0, psf=ImagePSF(np.ones((3, 3)), 0.03))
SOURCES = vstack([source("point", 1, 2), source("sersic", 3, 4, n=2), source("uniform", 5, 6)])
CPU_SECONDS = 2.0
LONGEST_MESSAGE = 400
REGIONS = """# Region file format: DS9 version 4.1
global color=green
fk5
point(150.0,60.0) # point=cross text={a}
circle(10:00:00.1,+60:00:01,2.5")
ellipse(150.0001,60.0001,2",0.01',30) # text={b}
-box(150,60,1",1",0)
"""
CSV = """RAJ2000,DEJ2000,mag,r_e_arcsec,q,PA,n,name
10 00 00.1,+60 00 01,20.5,0.3,0.5,40,2.5,a
10 00 00.2,+60 00 02,21.5,,,,,"b, c"
10 00 00.3,+59 59 58,22.5,0.1,1,0,1,d
"""
HOSTILE = [
    *("", "0", "-1", "1e999", "nan", "-inf", "99999999999999999999", "1e-400", "2147483648"),
    *("'x", '"', "''", "T", "F", "\x00", "é", "\u2028", "{", "[1,2", "!!python/object:os.system"),
    *("&a [*a]", "*a", "%", "#", "::", "10:99:99", "1" * 400, "mag(AB)", "erg/", "m**1e9"),
    *("!numpy.ndarray", "object", "json", "float64[1000000]", "string", "complex128", "bool"),
    *("'1PD(9)'", "'9999999999D'", "'P'", "'RICE_1'", "'GZIP_2'", "'HCOMPRESS_1'", "'PLIO_1'"),
    *("'RA---TAB'", "'RA---TPV'", "'DEC--ZPN'", "'GLON-CAR'", "<", ">", "]]>", "<!ENTITY a 'b'>"),
    *("-0", "1D5", "'(1,2)'", "(3.0,4.0)", "1", "2", "3", "8", "16", "-32", "-64", "32768", "7"),
]


def corpus(folder: Path) -> dict[str, bytes]:
    """Whole files by name; the reader follows from the name."""
    counts = np.arange(48).reshape(FRAME.shape)
    exposure = Exposure(counts, counts + 0.5, SOURCES, FRAME, 7)
    files = {}

    def keep(name: str) -> None:
        path = folder / name
        files[name] = path.read_bytes()
        path.unlink()

    for name, compress in (("exposure.fits", False), ("compressed.fits", True)):
        exposure.write(folder / name, compress=compress)
        files[name] = without_checksums(folder / name)
    images = [
        fits.CompImageHDU(counts.astype("i2"), compression_type="GZIP_1", name="A"),
        fits.CompImageHDU(counts + 0.5, compression_type="RICE_1", quantize_level=4, name="B"),
        fits.CompImageHDU(counts * 1.0, compression_type="GZIP_2", quantize_level=0, name="C"),
        fits.ImageHDU(counts.astype("i2"), name="D"),
    ]
    for image in images:
        image.header.update(wcs_header(FRAME))
    images[1].header["A_ORDER"], images[1].header["A_2_0"] = 2, 1e-5
    images[1].header["B_ORDER"], images[1].header["B_2_0"] = 2, 1e-5
    images[1].header["CTYPE1"], images[1].header["CTYPE2"] = "RA---TAN-SIP", "DEC--TAN-SIP"
    for i, image in enumerate(images):
        fits.HDUList([fits.PrimaryHDU(), image]).writeto(folder / f"image{i}.fits")
        keep(f"image{i}.fits")
    (folder / "exposure.fits").unlink()
    (folder / "compressed.fits").unlink()
    files["image.fits.gz"] = gzip.compress(files["image3.fits"])
    write_sources(SOURCES, folder / "sources.fits")
    files["sources.fits"] = without_checksums(folder / "sources.fits")
    (folder / "sources.fits").unlink()
    plain = QTable({"x": [1, 2], "y": [3.0, 4.0], "mag": [20.0, 21.0], "name": ["a", "bc"]})
    lists = fits.Column("list", "PD()", array=np.array([np.zeros(3), np.zeros(2)], dtype=object))
    table = fits.BinTableHDU.from_columns([*fits.table_to_hdu(plain).columns, lists])
    table.writeto(folder / "foreign.fits")
    keep("foreign.fits")
    numbers = [("x", "F8.3", [1.0, 2.0]), ("y", "E15.7", [3.0, 4.0]), ("mag", "I4", [20, 21])]
    columns = [fits.Column(name, form, array=values, ascii=True) for name, form, values in numbers]
    fits.TableHDU.from_columns(columns).writeto(folder / "ascii.fits")
    keep("ascii.fits")
    for ending in ("ecsv", "vot"):
        write_sources(SOURCES, folder / f"sources.{ending}")
        keep(f"sources.{ending}")
    sky = QTable({"sky": SkyCoord([CENTRE, CENTRE]), "mag": [20, 21] * u.ABmag})
    sky.write(folder / "sky.ecsv")
    keep("sky.ecsv")
    files["sky.csv"] = CSV.encode()
    files["sky.reg"] = REGIONS.encode()
    write_rgba(folder / "counts.png", counts * 100_000)
    keep("counts.png")
    return files


def without_checksums(path: Path) -> bytes:
    """The file without the sums that would refuse most changes before they are looked at."""
    content = path.read_bytes()
    for word in (b"DATASUM ", b"CHECKSUM"):
        content = re.sub(word + b"= .{70}", b"COMMENT ".ljust(80), content)
    return content


def read(path: Path) -> None:
    """Read a file with the reader of its name, and check what comes of it."""
    name = path.name
    if name.startswith(("exposure", "compressed")):
        exposure = Exposure.read(path)
        check_sources(exposure.sources)
        assert exposure.counts.shape == exposure.expected.shape == exposure.observation.shape
        assert exposure.counts.dtype == np.int64
    elif name.startswith("image"):
        image = read_image(path, FRAME)
        assert image.data.ndim == 2
        assert image.transform is None or np.isfinite(image.transform).all()
    elif name.endswith("png"):
        counts = read_rgba(path, unmarked=True)
        assert counts.min() >= 0
        assert counts.max() < 2**24
    else:
        catalogue = read_catalogue(path, FRAME)
        arrays = check_sources(catalogue.sources)
        assert np.isfinite(arrays.flux).all()
        assert all(catalogue.sources[n].dtype.kind != "O" for n in catalogue.sources.colnames)


def mutate(content: bytes, name: str, rng: np.random.Generator) -> bytes:
    """Break a file in one to three ways."""
    if name.endswith("gz") and rng.random() < 0.7:
        return gzip.compress(mutate(gzip.decompress(content), name[:-3], rng))
    if name.endswith("png") and rng.random() < 0.8:
        return mutate_chunk(content, rng)
    ways = [flip, flip, cut, splice]
    if name.endswith("fits"):
        ways += [edit_card] * 5
    elif not name.endswith(("png", "gz")):
        ways = [flip, cut, type_over, type_over, splice, shuffle_lines, *[edit_word] * 4]
    for _ in range(rng.integers(1, 4)):
        content = ways[rng.integers(len(ways))](content, rng) or b"\n"
    return content


def flip(content: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(content)
    for at in rng.integers(0, len(changed), rng.integers(1, 8)):
        changed[at] = rng.integers(0, 256)
    return bytes(changed)


def type_over(content: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(content)
    for at in rng.integers(0, len(changed), rng.integers(1, 8)):
        changed[at] = rng.integers(32, 127)
    return bytes(changed)


def mutate_chunk(content: bytes, rng: np.random.Generator) -> bytes:
    """Break one chunk of a PNG file, below its compression, and mend the checksum."""
    chunks, at = [], 8
    while at < len(content):
        (length,) = struct.unpack_from(">I", content, at)
        chunks.append((content[at + 4 : at + 8], content[at + 8 : at + 8 + length]))
        at += 12 + length
    broken = rng.integers(len(chunks))
    pieces = [content[:8]]
    for i, (kind, data) in enumerate(chunks):
        if i == broken:
            data = zlib.decompress(data) if kind == b"IDAT" else data
            data = [flip, cut, splice][rng.integers(3)](data or b"x", rng)
            data = zlib.compress(data) if kind == b"IDAT" else data
        crc = struct.pack(">I", zlib.crc32(kind + data))
        pieces.append(struct.pack(">I", len(data)) + kind + data + crc)
    return b"".join(pieces)


def cut(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: rng.integers(0, len(content))] if rng.random() < 0.3 else flip(content, rng)


def splice(content: bytes, rng: np.random.Generator) -> bytes:
    """Remove, repeat or move a piece."""
    start, length, to = (int(n) for n in rng.integers(0, [len(content), 400, len(content)]))
    piece = content[start : start + length]
    rest = content[:start] + content[start + length :] if rng.random() < 0.5 else content
    return rest if rng.random() < 0.3 else rest[:to] + piece + rest[to:]


def hostile(rng: np.random.Generator) -> str:
    return HOSTILE[rng.integers(len(HOSTILE))]


def edit_card(content: bytes, rng: np.random.Generator) -> bytes:
    """Give a card of a header another value, or the place of another card."""
    cards = [
        m.start() for m in re.finditer(rb"[A-Z0-9_-]{1,8} *= ", content) if m.start() % 80 == 0
    ]
    if not cards:
        return content
    at = cards[rng.integers(len(cards))]
    if rng.random() < 0.2:
        other = cards[rng.integers(len(cards))]
        return content[:at] + content[other : other + 80] + content[at + 80 :]
    if rng.random() < 0.3:
        old = re.search(rb"-?\d+", content[at + 10 : at + 80])
        value = str(int(old[0]) + int(rng.integers(-3, 4))) if old else "0"
    else:
        value = hostile(rng)
    card = content[at : at + 10] + value.encode()[:70].rjust(20)
    return content[:at] + card.ljust(80)[:80] + content[at + 80 :]


def shuffle_lines(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.split(b"\n")
    first, second = rng.integers(0, len(lines), 2)
    lines[first], lines[second] = lines[second], lines[first]
    return b"\n".join(lines * 2 if rng.random() < 0.05 else lines)


def edit_word(content: bytes, rng: np.random.Generator) -> bytes:
    words = list(re.finditer(rb"[^\s,<>=\"():{}]+", content))
    if not words:
        return content
    word = words[rng.integers(len(words))]
    new = words[rng.integers(len(words))][0] if rng.random() < 0.3 else hostile(rng).encode()
    return content[: word.start()] + new + content[word.end() :]


class TooSlow(BaseException):
    """Reading took more than `CPU_SECONDS` of the processor."""


@contextmanager
def time_limit():
    def stop(*_):
        raise TooSlow

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, CPU_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def outcome(path: Path) -> str | None:
    """Read a broken file; say what is wrong with how that went, or None."""
    try:
        with time_limit(), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", DistortionWarning)
            read(path)
    except (ValueError, OSError) as error:
        text = str(error)
        if "\n" in text or len(text) > LONGEST_MESSAGE or not text:
            return f"{type(error).__name__} of {len(text)} characters: {text}"
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        return "".join(traceback.format_exception(error)[-4:])
    if os.listdir(path.parent) != [path.name]:
        return f"files are left behind: {os.listdir(path.parent)}"
    return None


def run(number: int, seed: int, folder: Path) -> list[str]:
    """Break a number of files in turn; return what went wrong."""
    rng = np.random.default_rng(seed)
    files = corpus(folder)
    names = list(files)
    wrong = []
    for i in range(number):
        name = names[i % len(names)]
        path = folder / name
        broken = mutate(files[name], name, rng)
        path.write_bytes(broken)
        fault = outcome(path)
        if fault is not None:
            wrong.append(f"{name}, number {i} of seed {seed}: {fault}")
            if "KEEP" in os.environ:
                Path(os.environ["KEEP"], f"{seed}-{i}-{name}").write_bytes(broken)
        path.unlink()
    return wrong


def peak_megabytes() -> float:
    """Largest memory of the process so far, or since `forget_peak`."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def forget_peak() -> float:
    """Measure the peak anew from here, where the system can (Linux), and return it.

    Else a rise would go unseen behind a higher peak of an earlier test.
    """
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return peak_megabytes()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        before = forget_peak()
        found = run(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1, Path(folder))
    print("\n".join(found))
    print(f"{len(found)} faults; memory {before:.0f} to {peak_megabytes():.0f} MB")

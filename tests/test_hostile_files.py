"""Files made to do harm: a sentence within two seconds, and no memory for what is not there.

Each of these would cost gigabytes, minutes, a look at other files or the running of code, if
what the file says of itself were believed.
"""

import gzip
import io
import os
import sys
import zlib

import numpy as np
import pytest
from astropy.io import fits

from napari_issis import Exposure
from napari_issis.catalogue import read_catalogue
from napari_issis.fits_image import read_image

if sys.platform == "win32":
    pytest.skip("signals and resource limits of POSIX", allow_module_level=True)

from mutations import forget_peak, peak_megabytes, run, time_limit


def card(keyword, value):
    return f"{keyword:<8}= {value:>20}".ljust(80).encode()


def header(*cards):
    text = b"".join(cards) + b"END".ljust(80)
    return text + b" " * (-len(text) % 2880)


SIMPLE = card("SIMPLE", "T")
EMPTY = header(SIMPLE, card("BITPIX", 8), card("NAXIS", 0), card("EXTEND", "T"))
XTENSION = b"XTENSION= 'BINTABLE'".ljust(80)
GIANT = (card("NAXIS", 2), card("NAXIS1", 40_000), card("NAXIS2", 40_000))


def table(width, rows, form):
    shape = [card("BITPIX", 8), card("NAXIS", 2), card("NAXIS1", width), card("NAXIS2", rows)]
    rest = [card("PCOUNT", 0), card("GCOUNT", 1), card("TFIELDS", 1)]
    return (
        EMPTY
        + header(XTENSION, *shape, *rest, card("TTYPE1", "'x'"), card("TFORM1", f"'{form}'"))
        + bytes(2880)
    )


def compressed(tile=None, **cards):
    """A compressed image with some cards changed, or with one tile of the bytes given."""
    file = io.BytesIO()
    image = fits.CompImageHDU(
        np.zeros((100, 100), "i4"), compression_type="GZIP_1", tile_shape=(100, 100)
    )
    fits.HDUList([fits.PrimaryHDU(), image]).writeto(file)
    file.seek(0)
    with fits.open(file, disable_image_compression=True) as hdus:
        hdu = hdus[1]
        if tile is not None:
            data = np.empty(1, dtype=object)
            data[0] = np.frombuffer(tile, np.uint8)
            column = fits.Column("COMPRESSED_DATA", "1PB()", array=data)
            hdu = fits.BinTableHDU.from_columns([column])
            hdu.header.update({k: v for k, v in hdus[1].header.items() if k[0] == "Z"})
        hdu.header.update(cards)
        file = io.BytesIO()
        fits.HDUList([fits.PrimaryHDU(), hdu]).writeto(file)
    return file.getvalue()


BOMB = gzip.compress(bytes(10**8))
FITS = {
    "an image of 10 GB": (header(SIMPLE, card("BITPIX", -64), *GIANT), "truncated"),
    "a header without end": (SIMPLE + b"COMMENT".ljust(80) * 10**6, "more than 36000 cards"),
    "a header of 80 MB": (
        header(SIMPLE, card("BITPIX", 8), card("NAXIS", 0), b"COMMENT".ljust(80) * 10**6),
        "more than 36000 cards",
    ),
    "20,000 extensions": (
        EMPTY
        + header(
            *(b"XTENSION= 'IMAGE   '".ljust(80), card("BITPIX", 8), card("NAXIS", 0)),
            *(card("PCOUNT", 0), card("GCOUNT", 1)),
        )
        * 20_000,
        "more than 500 extensions",
    ),
    "a column of 2 GB": (table(10, 1, "2000000000A"), "take 2000000000 bytes, its rows 10"),
    "rows of no width": (table(0, 10**12, "0A"), "1000000000000 rows of no width"),
    "rows without end": (table(8, 10**10, "D"), "truncated"),
    "a million axes": (
        header(SIMPLE, card("BITPIX", 8), card("NAXIS", 10**9)),
        "NAXIS is 1000000000 in a header",
    ),
    "a matrix of a billion coordinates": (
        header(
            *(SIMPLE, card("BITPIX", 8), card("NAXIS", 2), card("NAXIS1", 1), card("NAXIS2", 1)),
            *(card("CTYPE1", "'RA---TAN'"), card("CTYPE2", "'DEC--TAN'"), card("WCSAXES", 32768)),
        )
        + bytes(2880),
        "WCSAXES is 32768 in a header",
    ),
    "a size that is text": (
        header(
            *(SIMPLE, card("BITPIX", 8), card("NAXIS", 1), card("NAXIS1", 10**15)),
            *(card("PCOUNT", 0), card("GCOUNT", "'x'")),
        ),
        "GCOUNT is text in a header",
    ),
    "axes below zero": (
        header(SIMPLE, card("BITPIX", 8), card("NAXIS", 2), card("NAXIS1", -9), card("NAXIS2", -9)),
        "negative|impossible",
    ),
    "a compressed image of 64 GB": (compressed(ZNAXIS1=160_000_000), "which cannot be"),
    "tiles missing": (compressed(ZTILE2=1), "has 1 of 100 tiles"),
    "a tile that grows": (compressed(BOMB), "holds more than its pixels"),
    "a compression whose decoder trusts": (compressed(ZCMPTYPE="HCOMPRESS_1"), "funpack"),
    "a gzip bomb": (gzip.compress(b"SIMPLE  =" + bytes(3 * 10**8)), "unpack it first with gunzip"),
    "a gzip file cut short": (gzip.compress(EMPTY)[:-9], "truncated"),
    "a gzip file in a gzip file": (gzip.compress(gzip.compress(EMPTY)), "is not a FITS file"),
}


def refused(read, path, content, message):
    path.write_bytes(content)
    before = forget_peak()
    with time_limit(), pytest.raises(ValueError, match=message or None) as error:
        read(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400
    assert str(path) in str(error.value)
    assert peak_megabytes() - before < 400


@pytest.mark.parametrize("reader", [Exposure.read, read_image, read_catalogue])
@pytest.mark.parametrize("name", FITS)
def test_fits(tmp_path, name, reader):
    content, message = FITS[name]
    refused(reader, tmp_path / "x.fits", content, message)


ECSV = """# %ECSV 1.0
# ---
# datatype:
# - {{name: x, datatype: float64}}
# - {{name: y, datatype: float64}}
# - {{name: flux, datatype: {datatype}{more}}}
{meta}# schema: astropy-2.0
x y flux
1 2 {value}
"""


def ecsv(meta="", datatype="float64", more="", value="1"):
    return ECSV.format(meta=meta, datatype=datatype, more=more, value=value).encode()


LAUGHS = "# meta:\n#   a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"#   a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30)
)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ecsv("# meta: !!python/object/apply:os.system ['touch /tmp/harm']\n"), "python/object"),
        (ecsv("# meta: !!python/name:os.system\n"), "the tag"),
        (ecsv("# meta: !numpy.ndarray {buffer: !!binary gASV, dtype: object}\n"), "numpy.ndarray"),
        (ecsv("# meta: !<!harm> 1\n"), "!harm"),
        (ecsv(LAUGHS), "references within references"),
        (ecsv("# meta: &a {b: *a}\n"), "references within references"),
        (ecsv(f"# meta: {'[' * 5000}\n"), "nested more than 20 deep"),
        (ecsv(f"# meta: [{'a, ' * 50_000}]\n"), "header has more than 100000 characters"),
        (ecsv(datatype="string", more=", subtype: json", value="[1]"), "no column flux"),
        (ecsv(datatype="float64", more=", subtype: 'float64[99999999999]'"), ""),
        (ecsv("# meta: {__serialized_columns__: {flux: {__class__: os.system}}}\n"), "os"),
        (b"x,y,flux\n1,2,3\n", "not a readable ECSV"),
    ],
)
def test_ecsv(tmp_path, content, message):
    refused(read_catalogue, tmp_path / "x.ecsv", content, message)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"x,y,flux\n" + b"1" * 10**7 + b",2,3\n" + b"1,2,3\n" * 10**5, "too many for 100002 rows"),
        (b",".join(b"c%d" % i for i in range(10**6)) + b"\n", "1000000 columns; 2000 at most"),
        (b"http://localhost/x.csv", "no column"),
        (b"/etc/passwd", "no column"),
        (b"x,y,flux\n1,2,\x00\n", "is not a text file"),
    ],
)
def test_csv(tmp_path, content, message):
    refused(read_catalogue, tmp_path / "x.csv", content, message)


FIELDS = "".join(f'<FIELD name="{name}" datatype="double"/>' for name in ("x", "y", "flux"))
ROW = "<TR><TD>1</TD><TD>2</TD><TD>3e-15</TD></TR>"


def votable(
    fields=FIELDS, data=f"<TABLEDATA>{ROW}</TABLEDATA>", start="", attributes="", root="VOTABLE"
):
    return (
        f'<?xml version="1.0"?>{start}<{root} version="1.3"><RESOURCE><TABLE {attributes}>'
        f"{fields}<DATA>{data}</DATA></TABLE></RESOURCE></{root}>"
    ).encode()


def entities():
    nested = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 30))
    return f'<!DOCTYPE VOTABLE [<!ENTITY e0 "x">{nested}]>'


STREAM = "<BINARY><STREAM {}>AAAA</STREAM></BINARY>"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (votable(start=entities(), data="<TABLEDATA>&e29;</TABLEDATA>"), "declares entities"),
        (votable(start='<!DOCTYPE V [<!ENTITY x SYSTEM "/etc/passwd">]>'), "declares entities"),
        (votable(start='<!DOCTYPE V [<!ENTITY % x SYSTEM "http://localhost/">%x;]>'), "entities"),
        (votable(data=STREAM.format('href="file:///etc/passwd"')), "lie elsewhere"),
        (votable(data=STREAM.format('actuate=">" href="http://localhost/x"')), "lie elsewhere"),
        (votable(data=STREAM.format('encoding="gzip"')), "packed"),
        (votable(data="<FITS><STREAM>AAAA</STREAM></FITS>"), "its table is in FITS"),
        (votable(attributes='nrows="99999999999"'), "claims 99999999999 rows"),
        (votable(FIELDS + '<FIELD name="a" datatype="double" arraysize="999999999"/>'), "too long"),
        (votable(FIELDS + '<FIELD name="a" datatype="int" arraysize="9999x9999x99"/>'), "too long"),
        (votable(FIELDS + '<FIELD name="a" datatype="int"/>' * 10_000), "more than 2000 columns"),
        (votable(data="<TABLEDATA>" * 1000), "nested more than 50 deep"),
        (votable(root="html"), "its root element is html"),
        (votable().decode().encode("utf-16"), "is not in UTF-8"),
        (gzip.compress(votable()), "not a readable VOTable"),
        (b"<VOTABLE/>", "holds no table"),
    ],
)
def test_votable(tmp_path, content, message):
    refused(read_catalogue, tmp_path / "x.vot", content, message)


def test_the_votable_of_these_tests_is_good(tmp_path):
    """Else the refusals above would prove nothing."""
    (tmp_path / "x.vot").write_bytes(votable())
    assert read_catalogue(tmp_path / "x.vot").sources["flux"][0].value == 3e-15
    (tmp_path / "x.ecsv").write_bytes(ecsv())
    assert read_catalogue(tmp_path / "x.ecsv").sources["flux"][0].value == 1.0
    (tmp_path / "x.fits").write_bytes(compressed())
    assert read_image(tmp_path / "x.fits").data.shape == (100, 100)


@pytest.mark.parametrize(
    "content",
    [
        b"image\n" + b"circle(" * 10**5,
        b"image\ncircle(" + b"1," * 10**6 + b")",
        b"fk5\ncircle(" + b"1" * 10**6 + b",2,3)",
        b"fk5\nellipse(1e300,2,3,4,5)\npoint(1,2)\n",
    ],
)
def test_regions(tmp_path, content):
    refused(read_catalogue, tmp_path / "x.reg", content, "")


def test_long_labels_of_regions(tmp_path):
    """Catches a table as wide as its longest label: 4 GB here."""
    path = tmp_path / "x.reg"
    path.write_text("image\ncircle(1,2,3) # text={" + "a" * 10**6 + "}\n" + "point(1,2)\n" * 1000)
    before = forget_peak()
    assert len(read_catalogue(path).sources) == 1001
    assert peak_megabytes() - before < 400


def test_neither_pipes_nor_devices_are_waited_for(tmp_path):
    os.mkfifo(tmp_path / "x.fits")
    for path in (tmp_path / "x.fits", "/dev/zero"):
        for reader in (Exposure.read, read_image):
            with time_limit(), pytest.raises(OSError, match="not a regular file"):
                reader(path)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_broken_at_random(tmp_path, seed):
    """Hundreds of files broken by bytes, cards, words, lines and pieces: see `mutations`.

    Catches any outcome but valid values or a sentence: other exceptions, warnings, text of
    pages, two seconds of computing, files left behind, and memory that grows.
    """
    before = forget_peak()
    assert run(600, seed, tmp_path) == []
    assert peak_megabytes() - before < 400


def test_the_harness_sees_faults(tmp_path, monkeypatch):
    """Each kind of fault once, so that the silence of the test above means something."""
    import mutations

    def fault(read):
        monkeypatch.setattr(mutations, "read", read)
        path = tmp_path / "x.csv"
        path.write_bytes(b"x")
        return mutations.outcome(path)

    def spin(path):
        while True:
            zlib.crc32(b"x")

    def leave(path):
        (path.parent / "left").write_text("")

    def raise_(error):
        def read(path):
            raise error

        return read

    assert fault(lambda path: None) is None
    assert fault(raise_(ValueError("a sentence"))) is None
    assert "TooSlow" in fault(spin)
    assert "KeyError" in fault(raise_(KeyError("x")))
    assert "UserWarning" in fault(raise_(UserWarning("x")))
    assert "500 characters" in fault(raise_(ValueError("x" * 500)))
    assert "left behind" in fault(leave)

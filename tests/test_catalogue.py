"""Source tables in files."""

import os

import astropy.units as u
import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table, vstack

from napari_issis import Exposure, Observation, random_sources, source
from napari_issis.catalogue import read_sources, write_sources
from napari_issis.exposure import same_table
from napari_issis.sources import FLUX_UNIT, check_sources

ODD = 0.1 + 0.2
MIXED = vstack(
    [source("point", ODD, 1 / 3, flux=ODD * 1e-15), source("sersic", 3, 4, n=1 + ODD, pa=ODD)]
)
TABLES = {
    "mixed": MIXED,
    "random": random_sources("exponential", 20, seed=1),
    "empty": random_sources("point", 0),
}
WITH_UNITS = {
    "magnitudes": source("point", 1, 2, flux=(20 + ODD) * u.ABmag),
    "arcsec": source("uniform", 1, 2, r_half=ODD * u.arcsec, pa=ODD * u.rad),
}


@pytest.mark.parametrize("ending", [".ecsv", ".fits", ".csv", ".FITS"])
@pytest.mark.parametrize("name", TABLES)
def test_round_trip(tmp_path, name, ending):
    """Catches digits lost in text, and columns without their unit."""
    path = tmp_path / f"table{ending}"
    write_sources(TABLES[name], path)
    assert same_table(read_sources(path), TABLES[name])


@pytest.mark.parametrize("ending", [".ecsv", ".fits"])
@pytest.mark.parametrize("name", WITH_UNITS)
def test_round_trip_of_units(tmp_path, name, ending):
    """Catches a magnitude read back as a plain number, which would be a flux of 20."""
    path = tmp_path / f"table{ending}"
    write_sources(WITH_UNITS[name], path)
    back = read_sources(path)
    assert same_table(back, WITH_UNITS[name])
    before, after = check_sources(WITH_UNITS[name]), check_sources(back)
    assert after.flux[0] == before.flux[0]
    assert after.r_half[0] == before.r_half[0]


@pytest.mark.parametrize("name", WITH_UNITS)
def test_csv_takes_no_units(tmp_path, name):
    with pytest.raises(ValueError, match="which a CSV file cannot say; write ECSV or FITS"):
        write_sources(WITH_UNITS[name], tmp_path / "table.csv")
    assert os.listdir(tmp_path) == []


def test_a_csv_typed_by_hand(tmp_path):
    """Catches empty cells of points taken for bad values, and whole numbers kept as integers."""
    path = tmp_path / "table.csv"
    path.write_bytes(
        b"\xef\xbb\xbfkind,x,y,flux,r_half,ellipticity,pa\r\n"
        b"point,10,20,1e-14,,,\r\n"
        b" exponential ,30,40,2e-14,5,0.5,45\r\n"
    )
    table = read_sources(path)
    assert list(table["kind"]) == ["point", "exponential"]
    assert table["x"].dtype == np.float64
    assert table["flux"].unit == FLUX_UNIT
    assert table["flux"][1].value == 2e-14
    assert np.isnan(table["r_half"][0])
    assert table["r_half"][1] == 5 * u.pix


@pytest.mark.parametrize(
    ("separator", "decimal"), [(";", ","), (";", "."), ("\t", "."), ("\t", ","), (",", ".")]
)
def test_a_csv_of_a_spreadsheet_in_another_language(tmp_path, separator, decimal):
    """Catches semicolons and decimal commas that are told to be missing columns."""
    rows = [
        ["kind", "x", "y", "flux"],
        ["point", "12.5", "-3", "1e-15"],
        ["point", "7", "4.25", "2e-15"],
    ]
    text = "\n".join(separator.join(row).replace(".", decimal) for row in rows)
    path = tmp_path / "table.csv"
    path.write_text(text + "\n", encoding="utf-8")
    read = check_sources(read_sources(path))
    assert read.x.tolist() == [12.5, 7.0]
    assert read.y.tolist() == [-3.0, 4.25]
    assert read.flux.tolist() == [1e-15, 2e-15]


def test_two_decimal_marks_in_a_column_are_refused(tmp_path):
    """Catches a thousand for one."""
    path = tmp_path / "table.csv"
    path.write_text("kind;x;y;flux\npoint;12,5;3;1e-15\npoint;12.5;3;1e-15\n", encoding="utf-8")
    with pytest.raises(ValueError, match="row 0, x: '12,5' is not a number"):
        read_sources(path)


def test_points_need_four_columns_only(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("kind,x,y,flux\npoint,1,2,1e-14\n")
    assert len(read_sources(path)) == 1


def test_an_exposure_is_a_catalogue_too(tmp_path):
    image = np.zeros((3, 4))
    observation = Observation(shape=(3, 4))
    Exposure(image.astype(int), image, MIXED, observation, 0).write(tmp_path / "x.fits")
    assert same_table(read_sources(tmp_path / "x.fits"), MIXED)


def test_a_fits_table_of_another_program(tmp_path):
    """Catches the order of columns or the extension's name taken for granted."""
    table = Table({"flux": [1.0, 2.0], "y": [1.0, 2.0], "x": [3, 4], "kind": ["point", "point"]})
    table["flux"].unit = "mJy"
    fits.HDUList(
        [fits.PrimaryHDU(), fits.ImageHDU(np.zeros((2, 2))), fits.table_to_hdu(table)]
    ).writeto(tmp_path / "x.fits")
    back = read_sources(tmp_path / "x.fits")
    # F_lambda = F_nu c / lambda^2, 1 mJy at 2500 A
    expected = 1e-26 * 2.99792458e18 / 2500**2
    assert check_sources(back).flux[0] == pytest.approx(expected, rel=1e-12, abs=0)


GOOD = "kind,x,y,flux,r_half,ellipticity,pa\nexponential,1,2,1e-14,20,0.5,45\n"


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("t.csv", "", "t.csv is empty"),
        ("t.ecsv", " \n", "t.ecsv is empty"),
        ("t.ecsv", GOOD, "t.ecsv is not a readable ECSV table"),
        ("t.ecsv", "# %ECSV 1.0\n# ---\n# datatype: [\nx\n", "t.ecsv is not a readable ECSV"),
        ("t.csv", GOOD + "1,2,3,4,5,6,7,8\n", "t.csv is not a readable CSV table"),
        ("t.csv", "kind,x,y\npoint,1,2\n", "t.csv: the source table has no column flux"),
        ("t.csv", GOOD.replace("1e-14", "-1"), "t.csv: row 0, flux: -1 is not allowed"),
        ("t.csv", GOOD.replace("1e-14", "nan"), "t.csv: row 0, flux: nan is not allowed"),
        ("t.csv", GOOD + "point,1\n", "t.csv: row 1, y: the value is missing"),
        ("t.csv", GOOD + "point,,2,1e-14,,,\n", "t.csv: row 1, x: the value is missing"),
        ("t.csv", GOOD.replace("20", "twenty"), "row 0, r_half: 'twenty' is not a number"),
        ("t.csv", GOOD.replace("0.5", "1.0"), "row 0, ellipticity: 1 is not allowed"),
        ("t.csv", GOOD.replace("exponential", "galaxy"), "row 0, kind: 'galaxy' is unknown"),
        ("t.fits", GOOD, "t.fits is not a FITS file"),
        ("t.dat", GOOD, "t.dat is no source table; its name must end in .ecsv, .csv, .fits"),
        ("t", GOOD, "t is no source table"),
    ],
)
def test_bad_files_are_named(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message) as error:
        read_sources(tmp_path / name)
    assert "\n" not in str(error.value)
    assert str(tmp_path / name) in str(error.value)


def test_other_bad_files(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"cannot read .*none\.csv: No such file"):
        read_sources(tmp_path / "none.csv")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(OSError, match=r"cannot read .*folder\.csv"):
        read_sources(tmp_path / "folder.csv")
    (tmp_path / "binary.csv").write_bytes(bytes(range(256)))
    with pytest.raises(ValueError, match=r"binary\.csv is not a text file"):
        read_sources(tmp_path / "binary.csv")
    fits.PrimaryHDU(np.zeros((2, 2))).writeto(tmp_path / "image.fits")
    with pytest.raises(ValueError, match=r"image\.fits: the file holds no table"):
        read_sources(tmp_path / "image.fits")


@pytest.mark.parametrize("ending", [".ecsv", ".fits", ".csv"])
def test_writing_keeps_what_is_there(tmp_path, ending):
    path = tmp_path / f"table{ending}"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_sources(MIXED, path)
    broken = MIXED.copy()
    broken["x"][0] = np.nan
    with pytest.raises(ValueError, match="row 0, x"):
        write_sources(broken, path, overwrite=True)
    assert path.read_text() == "mine"
    write_sources(MIXED, path, overwrite=True)
    assert len(read_sources(path)) == 2
    assert os.listdir(tmp_path) == [path.name]


def test_a_table_name_without_a_known_ending(tmp_path):
    with pytest.raises(ValueError, match=r"table\.txt is no source table"):
        write_sources(MIXED, tmp_path / "table.txt")

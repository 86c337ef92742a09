"""Catalogues of other programs: what each column is taken for, and where a source ends up.

The oracle for positions and angles is astropy's WCS of a written exposure, and great circles.
"""

import time

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import Angle, SkyCoord
from astropy.io import fits
from astropy.io.votable import parse
from astropy.table import MaskedColumn, QTable, Table
from astropy.wcs import WCS

from napari_issis import Observation, random_sources, source
from napari_issis.catalogue import Catalogue, read_catalogue, read_sources, write_sources
from napari_issis.exposure import same_table
from napari_issis.fits_header import wcs_header
from napari_issis.sources import FLUX_UNIT, check_sources

CENTRE = SkyCoord(150.0, 60.0, unit="deg")
FRAME = Observation(shape=(200, 300), pointing=CENTRE, roll=30.0)
NEAR = (CENTRE.directional_offset_by([0, 70, 200] * u.deg, [0, 2, 3] * u.arcsec)).icrs


def read(tmp_path, text, observation=None, name="t.csv") -> Catalogue:
    (tmp_path / name).write_text(text)
    return read_catalogue(tmp_path / name, observation)


def refused(tmp_path, text, observation=None, name="t.csv"):
    with pytest.raises(ValueError, match=name) as error:
        read(tmp_path, text, observation, name)
    message = str(error.value)
    assert "\n" not in message
    return message


def rows(columns, *values):
    return "\n".join([columns, *(",".join(str(v) for v in row) for row in values)]) + "\n"


# --- positions ---


@pytest.mark.parametrize(
    "names",
    [
        *("ra,dec", "RA,Dec", "RAJ2000,DEJ2000", "_RA,_DE", "RA_ICRS,DE_ICRS", "ra_deg,dec_deg"),
        *("ALPHA_J2000,DELTA_J2000", "RAdeg,DEdeg", "ra [deg],dec [deg]"),
    ],
)
def test_positions_on_the_sky_fall_on_the_pixels_of_the_wcs(tmp_path, names):
    """Catches pixels counted from 1, a roll turned the other way, and x and y exchanged."""
    text = rows(f"{names},mag", *((p.ra.deg, p.dec.deg, 20) for p in NEAR))
    catalogue = read(tmp_path, text, FRAME)
    x, y = WCS(wcs_header(FRAME)).world_to_pixel(NEAR)
    np.testing.assert_allclose(catalogue.sources["x"], x, atol=1e-6)
    np.testing.assert_allclose(catalogue.sources["y"], y, atol=1e-6)
    # at roll 30 the +y axis has the position angle 30, and east lies at -x
    assert catalogue.sources["x"][0] == pytest.approx(149.5)
    assert catalogue.sources["x"][1] < 149.5
    assert "-> x, y (ICRS" in catalogue.notes[0]
    assert "3 of 3 sources lie in the frame" in catalogue.notes
    assert list(catalogue.sources["kind"]) == ["point"] * 3


@pytest.mark.parametrize("style", ["spaces", "colons", "letters", "hours", "h unit", "radians"])
def test_right_ascension_in_hours_and_other_units(tmp_path, style):
    """Catches hours read as degrees, the sign of -00 degrees lost, and radians read as degrees."""
    centre = SkyCoord("10h00m00.1s -00d30m12.5s")
    observation = Observation(pointing=centre)
    ra, dec = centre.ra, centre.dec
    table = Table({"mag": [20.0]})
    if style in ("spaces", "colons", "letters"):
        marks = {"spaces": " ", "colons": ":", "letters": "fromunit"}[style]
        options = {"sep": marks, "precision": 8, "pad": True}
        table["RAJ2000"] = [ra.to_string(u.hourangle, **options)]
        table["DEJ2000"] = [Angle(dec).to_string(u.deg, **options, alwayssign=True)]
    elif style == "radians":
        table["ra_rad"], table["dec_rad"] = [ra.rad], [dec.rad]
    else:
        table["ra"] = [ra.hour] * (u.hourangle if style == "hours" else u.hour)
        table["dec"] = [dec.deg] * u.deg
    ending = "ecsv" if style in ("hours", "h unit") else "csv"
    table.write(tmp_path / f"t.{ending}", format=f"ascii.{ending}")
    sources = read_sources(tmp_path / f"t.{ending}", observation)
    assert (sources["x"][0], sources["y"][0]) == pytest.approx((255.5, 255.5), abs=1e-3)


def test_sexagesimal_text_beside_degrees(tmp_path):
    """VizieR gives both: catches 10 00 00 taken for 10 degrees, and the text preferred."""
    text = rows("RAJ2000,DEJ2000,_RAJ2000,_DEJ2000,mag", ("11 11 11", "-1 2 3", 150.0, 60.0, 20))
    catalogue = read(tmp_path, text, FRAME)
    assert catalogue.sources["x"][0] == pytest.approx(149.5)
    assert catalogue.sources["RAJ2000"][0] == "11 11 11"


def test_sky_coordinates_as_one_column(tmp_path):
    QTable({"sky": NEAR.galactic, "mag": [20.0] * 3}).write(tmp_path / "t.ecsv")
    sources = read_sources(tmp_path / "t.ecsv", FRAME)
    np.testing.assert_allclose(
        [sources["x"], sources["y"]], WCS(wcs_header(FRAME)).world_to_pixel(NEAR), atol=1e-6
    )


def test_pixels_of_programs_that_count_from_1(tmp_path):
    """Catches sources of SExtractor one pixel off, and its sky position ignored where known."""
    text = rows("X_IMAGE,Y_IMAGE,mag", (1, 2, 20))
    catalogue = read(tmp_path, text)
    assert (catalogue.sources["x"][0], catalogue.sources["y"][0]) == (0.0, 1.0)
    assert "X_IMAGE, Y_IMAGE -> x, y (pixels counted from 1, less 1)" in catalogue.notes
    both = rows("X_IMAGE,Y_IMAGE,ALPHA_J2000,DELTA_J2000,mag", (1, 2, 150, 60, 20))
    assert read(tmp_path, both, FRAME).sources["x"][0] == pytest.approx(149.5)
    assert read(tmp_path, both).sources["x"][0] == 0.0


def test_our_own_pixels_come_before_the_sky(tmp_path):
    catalogue = read(tmp_path, rows("x,y,ra,dec,flux", (7, 8, 150, 60, 1e-15)), FRAME)
    assert catalogue.sources["x"][0] == 7.0
    assert catalogue.sources["ra"][0] == 150.0


def test_positions_that_cannot_be_used(tmp_path):
    sky = rows("ra,dec,mag", (150, 60, 20))
    assert "give the observation a pointing" in refused(tmp_path, sky)
    assert "give the observation a pointing" in refused(tmp_path, sky, Observation())
    far = rows("ra,dec,mag", (150, 60, 20), (330, -60, 20))
    assert "row 1, ra, dec: (330, -60) lies 180 degrees" in refused(tmp_path, far, FRAME)
    assert "row 0, dec: 95" in refused(tmp_path, rows("ra,dec,mag", (150, 95, 20)), FRAME)
    assert "row 0, ra: nan" in refused(tmp_path, rows("ra,dec,mag", ("nan", 9, 20)), FRAME)
    mixed = rows("ra,dec,mag", ("10 0 0", "60 0 0", 20), ("150.0", "60 0 0", 20))
    assert "row 1, ra: '150.0' is no angle" in refused(tmp_path, mixed, FRAME)
    minutes = rows("ra,dec,mag", ("10 61 0", "60 0 0", 20))
    assert "row 0, ra: '10 61 0' is no angle" in refused(tmp_path, minutes, FRAME)
    assert "no column x, y; it needs x and y, or ra and dec" in refused(tmp_path, "mag\n20\n")


# --- angles ---


@pytest.mark.parametrize(("dec", "roll"), [(0.0, 0.0), (60.0, 30.0), (-89.99, 200.0), (90.0, 0.0)])
@pytest.mark.parametrize("name", ["pa", "PA", "theta", "PA_sky"])
def test_a_position_angle_on_the_sky_is_turned_into_the_frame(tmp_path, dec, roll, name):
    """Catches the roll left out or added, and north taken for parallel all over the frame.

    The major axis is walked along on the sky; its direction in pixels is the angle in the frame.
    """
    observation = Observation(pointing=SkyCoord(150.0, dec, unit="deg"), roll=roll)
    centre = observation.pointing.directional_offset_by(80 * u.deg, 8 * u.arcsec)
    text = rows(
        f"ra,dec,mag,r_e,q,{name}", (float(centre.ra.deg), float(centre.dec.deg), 20, 5, 0.5, 40)
    )
    catalogue = read(tmp_path, text, observation)
    wcs = WCS(wcs_header(observation))
    x, y = wcs.world_to_pixel(centre)
    tip_x, tip_y = wcs.world_to_pixel(centre.directional_offset_by(40 * u.deg, 1 * u.arcsec))
    expected = np.degrees(np.arctan2(-(tip_x - x), tip_y - y))
    difference = (catalogue.sources["pa"][0].to_value(u.deg) - expected + 90) % 180 - 90
    assert abs(difference) < 0.01
    assert any("turned into the frame" in note for note in catalogue.notes)


def test_angles_beside_pixels(tmp_path):
    """Catches an angle from +x (SExtractor, photutils, Sersic2D) taken for one from +y."""
    for name, expected in [("pa", 30), ("PA", 30), ("theta", -60), ("THETA_IMAGE", -60)]:
        text = rows(f"x,y,mag,r_e,e,{name}", (1, 2, 20, 5, 0.5, 30))
        assert read(tmp_path, text).sources["pa"][0] == expected * u.deg, name
    text = rows("x,y,mag,r_e,e,theta_rad", (1, 2, 20, 5, 0.5, np.pi / 6))
    assert check_sources(read(tmp_path, text).sources).pa[0] == pytest.approx(-60)


# --- flux, size and kind ---


def test_magnitudes(tmp_path):
    """Catches AB magnitudes as fluxes; f_lambda = 3.63e-20 c / lambda^2 10^(-0.4 m)."""
    text = rows("x,y,mag", (1, 2, 20.0))
    sources = read(tmp_path, text).sources
    expected = 3.6307805e-20 * 2.99792458e18 / 2000**2 * 1e-8
    assert check_sources(sources, pivot=2000).flux[0] == pytest.approx(expected, rel=1e-6, abs=0)
    galex = rows("x,y,FUVmag,NUVmag", (1, 2, 22, 20))
    assert read(tmp_path, galex).sources["flux"][0].value == 20
    catalogue = read(tmp_path, galex, Observation("FUV"))
    assert catalogue.sources["flux"][0].value == 22
    assert "FUVmag -> flux (taken as AB magnitudes, at the channel's pivot" in catalogue.notes[0]
    assert "1 further column kept: NUVmag" in catalogue.notes
    assert "no column flux; it needs flux or mag" in refused(tmp_path, rows("x,y,Vmag", (1, 2, 3)))
    unmeasured = rows("x,y,mag", (1, 2, 99), (1, 2, 20))
    assert "1 of them above 40: does this" in read(tmp_path, unmeasured).notes[1]
    assert "row 0, mag: the value is missing" in refused(tmp_path, "x,y,mag\n1,2,\n")


def test_fluxes_in_other_units(tmp_path):
    text = rows("x,y,flux [erg/s/cm2/A]", (1, 2, 3e-15))
    catalogue = read(tmp_path, text)
    assert check_sources(catalogue.sources).flux[0] == pytest.approx(3e-15, abs=0)
    assert any("A read as angstrom" in note for note in catalogue.notes)
    sources = read(tmp_path, rows("x,y,flux_uJy", (1, 2, 3))).sources
    expected = 3e-29 * 2.99792458e18 / 2500**2
    assert check_sources(sources).flux[0] == pytest.approx(expected, abs=0)
    table = Table({"x": [1.0], "y": [2.0], "flux": [3.0] * u.count})
    table.write(tmp_path / "t.ecsv")
    with pytest.raises(ValueError, match="column flux has the unit ct; it must be convertible"):
        read_sources(tmp_path / "t.ecsv")


@pytest.mark.parametrize(
    ("name", "pixels"),
    [
        *(("r_half", 5), ("R_1/2", 5), ("r_e", 5), ("Reff", 5), ("hlr_pix", 5), ("FLUX_RADIUS", 5)),
        *(("r_e_arcsec", 5 / 0.036), ("re [mas]", 5e-3 / 0.036), ("R50 (arcsec)", 5 / 0.036)),
    ],
)
def test_sizes(tmp_path, name, pixels):
    """Catches arcsec taken for pixels of 0.036 arcsec."""
    sources = read(tmp_path, rows(f"x,y,mag,{name}", (1, 2, 20, 5))).sources
    arrays = check_sources(sources)
    assert arrays.r_half[0] == pytest.approx(pixels)
    assert arrays.kind[0] == "exponential"
    assert arrays.ellipticity[0] == 0.0


def test_axis_ratio_and_kinds(tmp_path):
    """Catches q taken for e, a size of 0 taken for a galaxy, and indices given to points."""
    text = rows(
        "x,y,mag,Re,b/a,PA,n",
        *((1, 2, 20, 5, 0.25, 10, 2), (1, 2, 20, 0, 1, 0, 0), (1, 2, 20, "", "", "", "")),
        (1, 2, 20, 5, 1, 0, ""),
    )
    catalogue = read(tmp_path, text)
    arrays = check_sources(catalogue.sources)
    assert list(arrays.kind) == ["sersic", "point", "point", "exponential"]
    assert arrays.ellipticity[0] == 0.75
    assert "no kind: 1 exponential, 2 point, 1 sersic" in catalogue.notes
    assert "b/a -> ellipticity (1 - axis ratio)" in catalogue.notes
    wrong = rows("x,y,mag,Re,q", (1, 2, 20, 5, 1.5))
    assert "row 0, q: 1.5 is not allowed" in refused(tmp_path, wrong)
    no_angle = rows("x,y,mag,Re,e", (1, 2, 20, 5, 0.5))
    assert "no column pa, which row 0 with the ellipticity 0.5 needs" in refused(tmp_path, no_angle)


def test_words_for_kinds(tmp_path):
    text = rows(
        "x,y,mag,r,type,shape_r", *((1, 2, 20, 9, t, 1) for t in ("PSF", "EXP", "DEV", "REX"))
    )
    catalogue = read(tmp_path, text)
    kinds = ["point", "exponential", "devaucouleurs", "exponential"]
    assert list(catalogue.sources["kind"]) == kinds
    assert check_sources(catalogue.sources).r_half[1] == pytest.approx(1 / 0.036)
    assert any("DEV -> devaucouleurs" in note for note in catalogue.notes)
    other = read(tmp_path, rows("x,y,mag,type", (1, 2, 20, "QSO")))
    assert other.sources["type"][0] == "QSO"
    assert other.sources["kind"][0] == "point"


def test_short_names_mean_nothing_without_a_size(tmp_path):
    """Catches a quality flag q or a note n taken for an axis ratio or an index."""
    catalogue = read(tmp_path, rows("x,y,mag,q,n,e,pa", (1, 2, 20, 7, "a", 9, "b")))
    assert list(catalogue.sources["kind"]) == ["point"]
    assert catalogue.sources["q"][0] == 7
    assert catalogue.sources["n_catalogue"][0] == "a"
    assert "n (as n_catalogue)" in catalogue.notes[-1]


def test_further_columns_are_kept(tmp_path):
    """Catches a column lost, out of order, or its missing values invented."""
    table = QTable(
        {"name": ["α", "b"], "x": [1.0, 2.0], "z": MaskedColumn([1, 2], mask=[True, False])}
    )
    table["y"], table["flux"] = [3.0, 4.0], [1e-15, 2e-15] * FLUX_UNIT
    table.write(tmp_path / "t.ecsv")
    sources = read_sources(tmp_path / "t.ecsv")
    assert sources.colnames == ["kind", "name", "x", "z", "y", "flux"]
    assert list(sources["name"]) == ["α", "b"]
    assert list(sources["z"].mask) == [True, False]


def test_our_own_tables_need_no_notes(tmp_path):
    write_sources(source("sersic", 1, 2, n=2), tmp_path / "t.csv")
    assert read_catalogue(tmp_path / "t.csv").notes == ()


# --- formats ---


@pytest.mark.parametrize("ending", [".vot", ".xml", ".votable"])
@pytest.mark.parametrize(
    "table",
    [
        random_sources("sersic", 5, seed=1),
        random_sources("point", 0),
        source("point", 0.1 + 0.2, 1 / 3),
        source("point", 1, 2, flux=20.1 * u.ABmag),
        source("uniform", 1, 2, r_half=0.3 * u.arcsec),
    ],
)
def test_votable_round_trip(tmp_path, table, ending):
    """Catches digits lost, units lost (a magnitude read as a flux of 20), and invalid XML."""
    path = tmp_path / f"t{ending}"
    write_sources(table, path)
    parse(path, verify="exception")
    back = read_sources(path)
    assert same_table(back, table)
    assert check_sources(back).flux.tolist() == check_sources(table).flux.tolist()


VIZIER = """<?xml version="1.0" encoding="UTF-8"?>
<VOTABLE version="1.4" xmlns="http://www.ivoa.net/xml/VOTable/v1.3"><RESOURCE><TABLE>
<FIELD name="_RAJ2000" datatype="double" unit="deg"/>
<FIELD name="_DEJ2000" datatype="double" unit="deg"/>
<FIELD name="NUVmag" datatype="float" unit="mag"/><FIELD name="Name" datatype="char" arraysize="*"/>
<DATA><TABLEDATA>
<TR><TD>150.0</TD><TD>60.0</TD><TD>21.5</TD><TD>A &amp; B</TD></TR>
</TABLEDATA></DATA>
</TABLE></RESOURCE></VOTABLE>
"""


def test_a_votable_of_vizier(tmp_path):
    catalogue = read(tmp_path, VIZIER, FRAME, "t.vot")
    assert catalogue.sources["x"][0] == pytest.approx(149.5)
    assert catalogue.sources["flux"][0].value == pytest.approx(21.5)
    assert catalogue.sources["Name"][0] == "A & B"


def test_packed_fits(tmp_path):
    table = Table({"RA": [150.0], "DEC": [60.0], "MAG_AUTO": [20.0]})
    fits.table_to_hdu(table).writeto(tmp_path / "t.fits.gz")
    assert read_sources(tmp_path / "t.fits.gz", FRAME)["x"][0] == pytest.approx(149.5)


def test_a_fits_table_with_lists(tmp_path):
    """Catches lists of a table taken for objects, or the whole table refused for them."""
    lists = fits.Column("list", "PD()", array=np.array([np.zeros(3), np.zeros(2)], dtype=object))
    columns = [fits.Column(name, "D", array=[1.0, 2.0]) for name in ("x", "y", "mag")]
    fits.BinTableHDU.from_columns([lists, *columns]).writeto(tmp_path / "t.fits")
    catalogue = read_catalogue(tmp_path / "t.fits")
    assert len(catalogue.sources) == 2
    assert catalogue.notes[0] == "left out, as they are lists: list"


@pytest.mark.parametrize("ending", ["ecsv", "csv", "fits", "vot"])
def test_a_hundred_thousand_rows_load_in_seconds(tmp_path, ending):
    """Catches a loop over rows that is slower than reading them (2.5 s at most here)."""
    table = Table({"RAJ2000": 150 + np.linspace(0, 1e-3, 100_000)})
    table["DEJ2000"], table["mag"], table["r_e"] = 60.0, 20.0, 1.0
    if ending == "csv":
        table["RAJ2000"] = ["10 00 00.0%05d" % i for i in range(100_000)]  # noqa: UP031
        table["DEJ2000"] = ["+60 00 00.1"] * 100_000
    format_ = {"vot": "votable", "fits": "fits"}.get(ending, f"ascii.{ending}")
    table.write(tmp_path / f"t.{ending}", format=format_)
    start = time.process_time()
    assert len(read_sources(tmp_path / f"t.{ending}", FRAME)) == 100_000
    assert time.process_time() - start < 8

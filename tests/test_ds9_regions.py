"""Region files of DS9; the regions package of astropy is the oracle where it is installed."""

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from astropy.wcs import WCS

from napari_issis import Observation
from napari_issis.catalogue import read_catalogue
from napari_issis.fits_header import wcs_header
from napari_issis.sources import check_sources

FRAME = Observation(shape=(200, 300), pointing=SkyCoord(150.0, 60.0, unit="deg"), roll=30.0)
SAVED_BY_DS9 = """# Region file format: DS9 version 4.1
global color=green dashlist=8 3 width=1 font="helvetica 10 normal roman" select=1 fixed=0
image
point(10,20) # point=cross text={a; #1}
circle(30.5,40,5) # color=red
ellipse(50,60,8,4,30)
ellipse(50,60,4,8,30)
-circle(1,2,3)
box(5,5,10,10,0)
polygon(1,1,2,2,3,1)
"""


def read(tmp_path, text, observation=None):
    (tmp_path / "t.reg").write_text(text)
    return read_catalogue(tmp_path / "t.reg", observation)


def test_regions_in_pixels(tmp_path):
    """Catches pixels counted from 1, an angle from +x taken for one from +y, and axes exchanged."""
    catalogue = read(tmp_path, SAVED_BY_DS9)
    arrays = check_sources(catalogue.sources)
    assert arrays.x.tolist() == [9, 29.5, 49, 49]
    assert arrays.y.tolist() == [19, 39, 59, 59]
    assert list(arrays.kind) == ["point", "exponential", "exponential", "exponential"]
    assert arrays.r_half.tolist() == [0, 5, 8, 8]
    assert arrays.ellipticity.tolist() == [0, 0, 0.5, 0.5]
    # the longer axis lies at 30 degrees from +x, that is -60 from +y; then at 120, that is 30
    assert arrays.pa[2:].tolist() == [-60, 30]
    assert list(catalogue.sources["name"]) == ["a; #1", "", "", ""]
    assert "left out: 1 excluded circle, 1 box, 1 polygon" in catalogue.notes
    assert any("no fluxes: 1e-14" in note for note in catalogue.notes)


@pytest.mark.parametrize("system", ["fk5", "icrs"])
@pytest.mark.parametrize("roll", [0.0, 30.0])
def test_regions_on_the_sky_lie_where_the_regions_package_puts_them(tmp_path, system, roll):
    """Catches RA in hours, minutes of arc read as degrees, and the roll or north left out."""
    regions = pytest.importorskip("regions")
    observation = FRAME.replace(roll=roll)
    centre = observation.pointing.directional_offset_by(70 * u.deg, 3 * u.arcsec)
    centre = centre.transform_to(system)
    longitude, latitude = (centre.data.lon.deg, centre.data.lat.deg)
    text = f"{system}\nellipse({longitude:.9f},{latitude:.9f},0.4\",0.01',25)\n"
    arrays = check_sources(read(tmp_path, text, observation).sources)
    theirs = regions.Regions.parse(text, format="ds9")[0].to_pixel(WCS(wcs_header(observation)))
    assert arrays.x[0] == pytest.approx(theirs.center.x, abs=0.01)
    assert arrays.y[0] == pytest.approx(theirs.center.y, abs=0.01)
    longer = max(theirs.width, theirs.height)
    assert arrays.r_half[0] == pytest.approx(longer / 2, rel=1e-3)
    assert arrays.ellipticity[0] == pytest.approx(1 / 3, rel=1e-3)
    angle = theirs.angle.to_value(u.deg) + (90 if theirs.height > theirs.width else 0)
    assert abs((arrays.pa[0] - (angle - 90) + 90) % 180 - 90) < 0.05


@pytest.mark.parametrize("system", ["fk5", "icrs", "galactic", "fk4"])
def test_an_angle_is_one_in_the_system_of_the_region(tmp_path, system):
    """As in DS9: catches the angle in galactic coordinates taken for one from celestial north.

    An ellipse at 0 degrees lies along +x, across its system's north.
    """
    centre = FRAME.pointing.directional_offset_by(70 * u.deg, 3 * u.arcsec).transform_to(system)
    text = f'{system}\nellipse({centre.data.lon.deg:.9f},{centre.data.lat.deg:.9f},2",1",0)\n'
    arrays = check_sources(read(tmp_path, text, FRAME).sources)
    wcs = WCS(wcs_header(FRAME))
    (x, y), (tip_x, tip_y) = (
        wcs.world_to_pixel(point)
        for point in (centre, centre.directional_offset_by(-90 * u.deg, 1 * u.arcsec))
    )
    assert (arrays.x[0], arrays.y[0]) == pytest.approx((float(x), float(y)), abs=0.01)
    expected = np.degrees(np.arctan2(-(tip_x - x), tip_y - y))
    assert abs((arrays.pa[0] - expected + 90) % 180 - 90) < 0.05


@pytest.mark.parametrize(
    "centre", ["10:00:00.0,+60:00:00", "10h00m00.0s,+60d00m00s", "150.0, 60.0", "150d 60d"]
)
def test_ways_to_write_a_position(tmp_path, centre):
    arrays = check_sources(read(tmp_path, f'icrs;circle({centre},1.8")', FRAME).sources)
    assert (arrays.x[0], arrays.y[0]) == pytest.approx((149.5, 99.5), abs=1e-3)
    assert arrays.r_half[0] == pytest.approx(50)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("image\nbox(1,2,3,4,5)\n", "holds no point, circle or ellipse"),
        ("image\ncircle(1,2)\n", "line 2: circle has 2 values; it must have 3"),
        ("image\ncircle(1,2,-3)\n", "line 2: '1,2,-3' has an axis of no length"),
        ("image\ncircle(1,two,3)\n", "line 2: 'two' is not a number"),
        ("hello\n", "line 1: 'hello' is no region of DS9"),
        ("wcsa\npoint(1,2)\n", "line 1: regions in the coordinates 'wcsa' cannot be read"),
        ('image\ncircle(1,2,3")\n', "the length '3\"' and the position are in different units"),
        ("fk5\npoint(1,99)\n", "99 degrees is no declination"),
        ("fk5\npoint(1,9)\nimage\npoint(1,2)\n", "mixes regions in pixels and on the sky"),
        ("", "is empty"),
    ],
)
def test_broken_region_files(tmp_path, text, message):
    with pytest.raises(ValueError, match=r"t\.reg") as error:
        read(tmp_path, text, FRAME)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_regions_on_the_sky_need_a_pointing(tmp_path):
    with pytest.raises(ValueError, match="give the observation a pointing"):
        read(tmp_path, "fk5\npoint(1,2)\n")

"""Pictures: at the image's own pixels, row 0 at the bottom."""

import os

import numpy as np
import pytest
from astropy.table import vstack
from PIL import Image

from napari_issis import source
from napari_issis.plugin import layer_styles
from napari_issis.png import (
    ELLIPSE_COLORS,
    POINT_COLOR,
    write_png,
    write_side_by_side_png,
    write_source_png,
)


def picture(path):
    with Image.open(path) as image:
        image.load()
        return np.asarray(image), image.text


def test_row_0_is_at_the_bottom(tmp_path):
    """Catches a picture drawn upside down, transposed or mirrored."""
    image = np.zeros((3, 5))
    image[0, 1] = 1.0
    write_png(tmp_path / "x.png", image)
    pixels, text = picture(tmp_path / "x.png")
    assert pixels.shape == (3, 5)
    assert pixels[2, 1] == 255
    assert pixels.sum() == 255
    assert text["Orientation"] == "row 0 at the bottom"


@pytest.mark.parametrize(
    ("scale", "curve"),
    [
        ("linear", lambda c: c / 1000),
        # 1000 counts above zero: DS9's logarithm is then log(1 + C)
        ("log", lambda c: np.log(1 + c) / np.log(1001)),
        ("sqrt", lambda c: np.sqrt(c / 1000)),
    ],
)
def test_scales(tmp_path, scale, curve):
    """Catches one scale drawn for another, and truncation where rounding is meant."""
    image = np.arange(1001).reshape(7, 143)
    write_png(tmp_path / "x.png", image, scale=scale)
    pixels, text = picture(tmp_path / "x.png")
    difference = pixels[::-1].ravel() - 255 * curve(np.arange(1001))
    assert np.abs(difference).max() <= 0.5 + 1e-9
    assert text["Scale"] == scale
    assert text["Limits"] == "0.0 1000.0"


def test_limits_clip_and_are_kept_exactly(tmp_path):
    image = np.array([[-5.0, 0.1 + 0.2, 1.0, 7.0, np.nan, np.inf, -np.inf]])
    write_png(tmp_path / "x.png", image, limits=(0.1 + 0.2, 1.0))
    pixels, text = picture(tmp_path / "x.png")
    assert pixels.tolist() == [[0, 0, 255, 255, 0, 255, 0]]
    assert [float(limit) for limit in text["Limits"].split()] == [0.1 + 0.2, 1.0]


@pytest.mark.parametrize("value", [0.0, 3.0, np.nan, 1.7e308])
def test_an_image_without_contrast_is_dark(tmp_path, value):
    write_png(tmp_path / "x.png", np.full((2, 2), value), scale="log")
    assert not picture(tmp_path / "x.png")[0].any()


def test_extremes_do_not_overflow(tmp_path):
    write_png(tmp_path / "x.png", [[-1.7e308, 0.0, 1.7e308]])
    assert picture(tmp_path / "x.png")[0].tolist() == [[0, 128, 255]]


def test_colormaps(tmp_path):
    ramp = np.arange(256)[None, :]
    for name in ("gray", "gray_r", "heat"):
        write_png(tmp_path / f"{name}.png", ramp, colormap=name)
    gray, inverted, heat = (
        picture(tmp_path / f"{name}.png")[0][0] for name in ("gray", "gray_r", "heat")
    )
    np.testing.assert_array_equal(gray, np.arange(256))
    np.testing.assert_array_equal(inverted, 255 - np.arange(256))
    assert heat[0].tolist() == [0, 0, 0]
    assert heat[85].tolist() == [255, 0, 0]
    assert heat[255].tolist() == [255, 255, 255]
    assert (np.diff(heat.astype(int).sum(axis=1)) > 0).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scale": "cubic"}, "scale is 'cubic'; known: linear, log, sqrt"),
        ({"colormap": "jet"}, "colormap is 'jet'"),
        ({"limits": (1, 1)}, r"limits is \(1, 1\)"),
        ({"limits": (0, np.nan)}, "limits is"),
        ({"limits": 3}, "limits is 3; give"),
        ({"image": np.zeros(3)}, r"two dimensions; this one's are \(3,\)"),
        ({"image": np.zeros((0, 3))}, "two dimensions"),
        ({"path": "x.jpg"}, r"x\.jpg: the name must end in \.png"),
    ],
)
def test_bad_input(tmp_path, options, message):
    path = tmp_path / options.pop("path", "x.png")
    image = options.pop("image", np.zeros((2, 2)))
    with pytest.raises(ValueError, match=message):
        write_png(path, image, **options)
    assert os.listdir(tmp_path) == []


def test_an_existing_picture_is_kept(tmp_path):
    path = tmp_path / "x.png"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_png(path, np.zeros((2, 2)))
    assert path.read_text() == "mine"
    write_png(path, np.zeros((2, 2)), overwrite=True)
    assert picture(path)[0].shape == (2, 2)


def test_magnified(tmp_path):
    """Catches interpolation between pixels, and a picture magnified along one axis."""
    image = np.arange(6).reshape(2, 3)
    write_png(tmp_path / "x.png", image)
    write_png(tmp_path / "z.png", image, zoom=3)
    plain, large = picture(tmp_path / "x.png")[0], picture(tmp_path / "z.png")
    np.testing.assert_array_equal(large[0], np.kron(plain, np.ones((3, 3), np.uint8)))
    assert large[1]["Zoom"] == "3"
    for zoom, message in [(0, "zoom is 0"), (1.5, "zoom is 1.5"), (65, "from 1 to 64")]:
        with pytest.raises(ValueError, match=message):
            write_png(tmp_path / "y.png", image, zoom=zoom)
    with pytest.raises(ValueError, match="1024 pixels become 65536"):
        write_png(tmp_path / "y.png", np.zeros((1, 1024)), zoom=64)


@pytest.mark.parametrize("zoom", [1, 4])
def test_half_light_ellipses(tmp_path, zoom):
    """Catches an ellipse turned the wrong way, mirrored, upside down or of twice the size.

    Every drawn pixel must lie within one pixel of the ellipse that the source table says:
    major axis 40 pixels at 30 degrees from +y towards -x, minor axis 16.
    """
    galaxy = source("sersic", 70.0, 40.0, r_half=40.0, ellipticity=0.6, pa=30.0, n=2)
    write_source_png(tmp_path / "x.png", galaxy, (100, 140), zoom=zoom)
    pixels, text = picture(tmp_path / "x.png")
    assert pixels.shape == (100 * zoom, 140 * zoom, 3)
    assert text["Zoom"] == str(zoom)
    drawn = pixels.any(axis=2)
    assert np.unique(pixels[drawn], axis=0).tolist() == [[255, 0, 255]]
    row, column = np.nonzero(drawn)
    x = (column + 0.5) / zoom - 0.5 - 70.0
    y = 100 - (row + 0.5) / zoom - 0.5 - 40.0
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    along, across = -s * x + c * y, c * x + s * y
    for grow in (-1, 1):
        radius = np.hypot(along / (40 + grow / zoom), across / (16 + grow / zoom))
        assert (grow * (1 - radius) > 0).all()
    assert along.max() > 39
    assert across.max() > 15


def test_stars_and_colours(tmp_path):
    """Catches colours other than those of the layers in napari, and a star off its place."""
    assert layer_styles.ELLIPSE_COLORS == ELLIPSE_COLORS
    assert layer_styles.POINTS["border_color"] == POINT_COLOR
    write_source_png(tmp_path / "x.png", source("point", 20.0, 30.0), (50, 60))
    pixels = picture(tmp_path / "x.png")[0]
    row, column = np.nonzero(pixels[..., 0])
    assert not pixels[..., 1:].any()
    assert (column.min() + column.max()) / 2 == 20
    assert row.min() == 49 - 30 - 6
    assert np.ptp(row) < 14


def test_sources_outside_the_frame(tmp_path):
    write_source_png(tmp_path / "x.png", source("uniform", 1e8, -1e8, r_half=1e7), (5, 6))
    assert not picture(tmp_path / "x.png")[0].any()
    write_source_png(tmp_path / "y.png", source("uniform", 1e7, 2, r_half=1e7), (5, 6))
    with pytest.raises(ValueError, match="shape is"):
        write_source_png(tmp_path / "z.png", source("point", 1, 2), (0, 6))


@pytest.mark.parametrize("zoom", [1, 3])
def test_side_by_side(tmp_path, zoom):
    """Catches sides exchanged, one at another zoom or upside down, and a frame cut off."""
    rng = np.random.default_rng(5)
    image = rng.uniform(0, 9, (40, 50))
    sources = vstack([source("point", 12.0, 30.0), source("uniform", 30.0, 9.0, r_half=7.0)])
    look = {"scale": "sqrt", "limits": (1.0, 7.0), "colormap": "heat", "zoom": zoom}
    write_side_by_side_png(tmp_path / "both.png", sources, image, **look, words={"Image": "me"})
    write_png(tmp_path / "right.png", image, **look)
    write_source_png(tmp_path / "left.png", sources, (40, 50), zoom=zoom)
    both, text = picture(tmp_path / "both.png")
    left, right = (picture(tmp_path / f"{side}.png")[0] for side in ("left", "right"))
    assert both.shape == (40 * zoom, 100 * zoom + 2, 3)
    np.testing.assert_array_equal(both[:, : 50 * zoom], left)
    np.testing.assert_array_equal(both[:, 50 * zoom + 2 :], right)
    assert (both[:, 50 * zoom : 50 * zoom + 2] == 128).all()
    # the star near the upper left corner is where a reader of pixels expects it
    assert both[: 20 * zoom, : 20 * zoom].any()
    assert text["Image"] == "me"
    assert (text["Scale"], text["Zoom"]) == ("sqrt", str(zoom))


def test_side_by_side_refuses(tmp_path):
    with pytest.raises(ValueError, match="two dimensions"):
        write_side_by_side_png(tmp_path / "x.png", source("point", 1, 1), np.zeros(4))
    with pytest.raises(ValueError, match="20002 pixels become 40004"):
        write_side_by_side_png(
            tmp_path / "x.png", source("point", 1, 1), np.zeros((1, 10000)), zoom=2
        )
    assert not list(tmp_path.iterdir())

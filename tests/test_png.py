"""Pictures: at the image's own pixels, row 0 at the bottom."""

import os

import numpy as np
import pytest
from PIL import Image

from napari_issis.png import write_png


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

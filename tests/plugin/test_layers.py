"""Source table to layer data and back."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.table import QTable
from hypothesis import given, settings
from hypothesis import strategies as st
from napari.layers import Shapes

from napari_issis import Observation, count_rate, source
from napari_issis.plugin.layers import (
    adopt_features,
    adopt_points,
    adopt_shapes,
    ellipses,
    features,
    points_data,
    same_ellipses,
    shapes_data,
)
from napari_issis.plugin.table import master_table

galaxies = st.builds(
    lambda x, y, r, e, pa: master_table(
        source("exponential", x, y, r_half=r, ellipticity=e, pa=pa)
    ),
    st.floats(-100, 2100),
    st.floats(-100, 2100),
    st.floats(1, 200),
    st.floats(0, 0.9),
    st.floats(-360, 360),
)


def as_napari_keeps(corners: np.ndarray) -> np.ndarray:
    return corners.astype(np.float32)


def values(table: QTable) -> np.ndarray:
    names = ("x", "y", "r_half", "ellipticity", "pa")
    return np.array([[getattr(v, "value", v) for v in table[name]] for name in names])


def image_angle(image: np.ndarray) -> float:
    """Position angle from second moments, by the definition: from +y towards -x."""
    y, x = np.indices(image.shape)
    total = image.sum()
    x, y = x - (image * x).sum() / total, y - (image * y).sum() / total
    vectors = np.linalg.eigh(np.cov(np.vstack([x.ravel(), y.ravel()]), aweights=image.ravel()))[1]
    dx, dy = vectors[:, 1]
    return float(np.degrees(np.arctan2(-dx, dy)) % 180)


@pytest.mark.parametrize("pa", [20.0, 70.0, 110.0, 165.0])
def test_the_ellipse_lies_as_the_rendered_galaxy(pa):
    """Catches a mirrored or transposed position angle: ellipse and image by their moments."""
    table = source("gaussian", 60, 60, r_half=15, ellipticity=0.6, pa=pa)
    layer = Shapes([shapes_data(table)[0]], shape_type="ellipse")
    drawn = image_angle(layer.to_masks((121, 121))[0].astype(float))
    rendered = image_angle(count_rate(table, Observation(shape=(121, 121))))
    # The mask is one of whole pixels.
    assert drawn == pytest.approx(pa, abs=1.0)
    assert rendered == pytest.approx(pa, abs=0.5)


def test_the_major_axis_points_up_and_left_at_small_angles():
    """Catches an angle counted from x, or clockwise: at 10 degrees the top is at smaller x."""
    corners = shapes_data(source("uniform", 0, 0, r_half=10, ellipticity=0.9, pa=10))[0]
    top = corners[corners[:, 0] > 0].mean(axis=0)
    assert top == pytest.approx([10 * np.cos(np.radians(10)), -10 * np.sin(np.radians(10))])


def test_the_ellipse_holds_half_of_the_light():
    """Catches semi-axes taken for full ones: flux within the drawn ellipse, by its mask."""
    table = source("exponential", 100, 100, r_half=15, ellipticity=0.3, pa=40)
    rate = count_rate(table, Observation(shape=(201, 201)))
    inside = Shapes([shapes_data(table)[0]], shape_type="ellipse").to_masks((201, 201))[0]
    total = 1e-14 * 1.14e17
    assert rate[inside].sum() / total == pytest.approx(0.5, abs=0.02)


@given(galaxies)
@settings(max_examples=30, deadline=None)
def test_round_trip_changes_nothing(table):
    """Catches rows that drift because napari rounds to float32."""
    written = as_napari_keeps(shapes_data(table))
    assert np.array_equal(values(adopt_shapes(table, written, written)), values(table))


@given(galaxies, st.integers(0, 3), st.booleans())
@settings(max_examples=30, deadline=None)
def test_any_corner_first_and_mirrored_boxes_are_the_same_ellipse(table, first, mirrored):
    """Catches a conversion that trusts the order of the corners."""
    corners = shapes_data(table)
    other = np.roll(corners, first, axis=1)
    if mirrored:
        other = other[:, ::-1]
    centre, semi, pa = ellipses(as_napari_keeps(other))
    a = table["r_half"].value
    assert np.abs(centre[0] - [table["y"][0], table["x"][0]]).max() < 2e-4
    assert np.abs(semi[0] - [a[0], a[0] * (1 - table["ellipticity"][0])]).max() < 3e-4
    if table["ellipticity"][0] > 0.1:
        turn = (pa[0] - table["pa"][0].value + 90) % 180 - 90
        assert abs(np.radians(turn)) * a[0] < 5e-3
    assert same_ellipses(corners, other)


def test_a_sheared_box_is_the_affine_image_of_a_circle():
    """Catches axes read off the edges: compared with the largest radius of 3600 points."""
    box = shapes_data(source("uniform", 30, 40, r_half=10, ellipticity=0.5, pa=25))
    sheared = 35 + (box - 35) @ np.array([[1.0, 0.3], [0.0, 1.2]])
    t = np.linspace(0, 2 * np.pi, 3600)[:, None]
    q = sheared[0]
    u, w = (q[1] - q[0]) / 2, (q[3] - q[0]) / 2
    outline = u * np.cos(t) + w * np.sin(t)
    radius = np.hypot(*outline.T)
    row, column = outline[radius.argmax()]
    centre, semi, pa = ellipses(sheared)
    assert centre[0] == pytest.approx(q.mean(axis=0))
    assert semi[0] == pytest.approx([radius.max(), radius.min()], rel=1e-5)
    assert pa[0] == pytest.approx(np.degrees(np.arctan2(-column, row)) % 180, abs=0.2)


def test_a_moved_ellipse_keeps_its_shape_bit_for_bit():
    """Catches a shape that is read back from float32 after 300 small moves."""
    table = master_table(source("exponential", 300.1, 400.2, r_half=17.3, ellipticity=0.37, pa=77))
    before = values(table)
    layer = Shapes([shapes_data(table)[0]], shape_type="ellipse")
    rng = np.random.default_rng(5)
    for shift in rng.uniform(-3, 3, (300, 2)):
        written = np.array(layer.data, dtype=float)
        layer._data_view.shift(0, shift.astype(np.float32))
        table = adopt_shapes(table, written, np.array(layer.data))
    after = values(table)
    assert np.array_equal(after[2:], before[2:])
    assert not np.array_equal(after[:2], before[:2])
    centre = np.mean(layer.data[0].astype(float), axis=0)
    assert np.abs(centre - after[[1, 0], 0]).max() < 1e-4


def test_turning_changes_the_angle_alone():
    """Catches a rotation that touches radius, ellipticity or position."""
    table = master_table(source("gaussian", 50, 60, r_half=12, ellipticity=0.5, pa=20))
    written = as_napari_keeps(shapes_data(table))
    turned = source("gaussian", 50, 60, r_half=12, ellipticity=0.5, pa=65)
    after = adopt_shapes(table, written, as_napari_keeps(shapes_data(turned)))
    assert np.array_equal(values(after)[:4], values(table)[:4])
    assert after["pa"][0].value == pytest.approx(65, abs=1e-3)


def test_stretching_is_adopted():
    """Catches r_half and ellipticity taken from the wrong axes, and a swap of the two."""
    table = master_table(source("gaussian", 50, 60, r_half=12, ellipticity=0.5, pa=20))
    written = as_napari_keeps(shapes_data(table))
    wider = source("gaussian", 50, 60, r_half=18, ellipticity=1 - 12 / 18, pa=110)
    after = adopt_shapes(table, written, as_napari_keeps(shapes_data(wider)))
    assert values(after)[:, 0] == pytest.approx([50, 60, 18, 1 / 3, 110], abs=1e-4)
    assert np.array_equal(values(after)[:2], values(table)[:2])


def test_a_circle_keeps_its_angle():
    """Catches an angle made up from rounding where there is none."""
    table = master_table(source("gaussian", 50, 60, r_half=12, ellipticity=0.0, pa=33))
    written = as_napari_keeps(shapes_data(table))
    larger = source("gaussian", 50, 60, r_half=15, ellipticity=0.0, pa=120)
    after = adopt_shapes(table, written, as_napari_keeps(shapes_data(larger)))
    assert after["pa"][0].value == 33
    assert after["r_half"][0].value == pytest.approx(15, abs=1e-4)


def test_an_ellipse_squeezed_to_nothing_keeps_a_size():
    """Catches a radius of zero or an ellipticity of one, which no source has."""
    table = master_table(source("gaussian", 50, 60, r_half=12, ellipticity=0.5, pa=20))
    written = shapes_data(table)
    after = adopt_shapes(table, written, np.repeat(written.mean(axis=1, keepdims=True), 4, axis=1))
    assert after["r_half"][0].value == 0.5
    assert after["ellipticity"][0] == 0.0


def test_points_take_the_exact_position():
    """Catches x and y exchanged, and points that move though they were not touched."""
    table = master_table(source("point", 1 / 3, 2 / 3))
    data = points_data(table)
    moved = data + np.array([1.25, 10.0])
    after = adopt_points(table, data, moved)
    assert (after["x"][0], after["y"][0]) == (1 / 3 + 10.0, 2 / 3 + 1.25)
    assert np.array_equal(values(adopt_points(table, data, data)), values(table))


def test_edited_features_are_adopted_and_refused():
    """Catches edits of the flux that are lost, and wrong values that come through."""
    table = master_table(source("gaussian", 50, 60))
    written = features(table, np.array([7]))
    edited = written.assign(flux=3e-15)
    after = adopt_features(table, written, edited)
    assert after["flux"][0].value == 3e-15
    assert np.array_equal(values(after), values(table))
    with pytest.raises(ValueError, match="ellipticity"):
        adopt_features(table, written, written.assign(ellipticity=1.5))

"""Source table to layer data and back: pure functions, without napari.

Layer data are (row, column) = (y, x) in pixels. An ellipse is given by the four corners of its
box in order, as napari keeps it (in float32); the ellipse that napari draws in any such
parallelogram is the affine image of a circle.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from astropy import units as u
from astropy.table import QTable
from numpy.typing import NDArray

from ..source_image import kept_image
from ..sources import IMAGE, SourceArrays, check_sources
from .table import TEXTS, put

Array = NDArray[np.float64]

NUMBERS = ("x", "y", "flux", "r_half", "ellipticity", "pa", "n")
FEATURES = ("kind", *NUMBERS, *TEXTS)
# Semi-axes below half a pixel are drawn by a slip of the mouse, not on purpose.
MIN_SEMI_AXIS = 0.5


def points_data(table: QTable) -> Array:
    """Positions of sources as Points data, shape (n, 2), float64."""
    return np.column_stack([np.asarray(table["y"], float), np.asarray(table["x"], float)])


def shapes_data(table: QTable) -> Array:
    """Half-light isophotes of extended sources as corners of ellipses, shape (n, 4, 2).

    The semi-major axis is ``r_half``, the semi-minor one ``r_half (1 - ellipticity)``; the
    position angle is counted from +y counter-clockwise towards -x. Of images it is the outline.
    """
    s = check_sources(table)
    pa = np.radians(s.pa)
    along, across = _semi_axes(s)
    major = along[:, None] * np.column_stack([np.cos(pa), -np.sin(pa)])
    minor = across[:, None] * np.column_stack([np.sin(pa), np.cos(pa)])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    centre = np.column_stack([s.y, s.x])
    corners: Array = (
        centre[:, None, :]
        + signs[None, :, :1] * major[:, None, :]
        + signs[None, :, 1:] * minor[:, None, :]
    )
    return corners


def _semi_axes(s: SourceArrays) -> tuple[Array, Array]:
    """Half-sizes along the direction of the position angle and across it."""
    along, across = s.r_half.copy(), s.r_half * (1 - s.ellipticity)
    for row in np.flatnonzero(s.kind == IMAGE):
        half_y, half_x = kept_image(str(s.image[row])).half_sizes
        along[row], across[row] = s.r_half[row] * half_y, s.r_half[row] * half_x
    return along, across


def ellipses(corners: Array) -> tuple[Array, Array, Array]:
    """Centres (n, 2), semi-axes (n, 2) and position angles (n,) in degrees of ellipses.

    The half-edges of the box map the unit circle onto the ellipse; their singular values are
    its semi-axes. So any order of the corners, a mirrored and a sheared box are right.

    Parameters
    ----------
    corners : ndarray, shape (n, 4, 2)
        Corners (row, column) of the boxes.

    Returns
    -------
    centre : ndarray, shape (n, 2)
        As (row, column).
    semi_axes : ndarray, shape (n, 2)
        Major, minor.
    pa : ndarray, shape (n,)
        From +row counter-clockwise towards -column, in [0, 180).
    """
    q = np.asarray(corners, dtype=np.float64)
    axes, semi, _ = np.linalg.svd(_half_edges(q))
    row, column = axes[:, 0, 0], axes[:, 1, 0]
    return q.mean(axis=1), semi, np.degrees(np.arctan2(-column, row)) % 180.0


def adopt_points(table: QTable, written: Array, data: Array) -> QTable:
    """Return the table with the positions of the points that were moved.

    Parameters
    ----------
    table : astropy.table.QTable
        Sources, in the order of the points.
    written : ndarray, shape (n, 2)
        What the layer held when the table was last in step with it.
    data : ndarray, shape (n, 2)
        What it holds now.
    """
    moved = np.any(written != data, axis=1)
    table = table.copy()
    table["y"] = np.where(moved, data[:, 0], table["y"])
    table["x"] = np.where(moved, data[:, 1], table["x"])
    return table


def adopt_shapes(table: QTable, written: Array, corners: Array) -> QTable:
    """Return the table with what was changed of the ellipses: place, size, shape, angle.

    Only what differs from ``written`` by more than napari's float32 rounding is taken over;
    a moved ellipse keeps its radius, ellipticity and angle bit for bit. Semi-axes are at
    least half a pixel. An image keeps its proportions: it is scaled by area, and its position
    angle is the direction of the outline's first edge.

    Parameters
    ----------
    table : astropy.table.QTable
        Extended sources, in the order of the ellipses.
    written : ndarray, shape (n, 4, 2)
        What the layer held when the table was last in step with it.
    corners : ndarray, shape (n, 4, 2)
        What it holds now.
    """
    table = table.copy()
    if len(table) == 0:
        return table
    old, new = np.asarray(written, dtype=float), np.asarray(corners, dtype=float)
    # Four roundings of float32 at the largest coordinate.
    span = np.maximum(np.abs(old), np.abs(new)).max(axis=(1, 2))
    rounding = 4 * np.spacing(span.astype(np.float32)).astype(float)
    centre, old_centre = new.mean(axis=1), old.mean(axis=1)
    moved = np.any(np.abs(centre - old_centre) > rounding[:, None], axis=1)
    table["y"] = np.where(moved, centre[:, 0], table["y"])
    table["x"] = np.where(moved, centre[:, 1], table["x"])

    bent = np.any(np.abs(_half_edges(new) - _half_edges(old)) > rounding[:, None, None], (1, 2))
    if not bent.any():
        return table
    _, (old_a, old_b), old_pa = _axes(old)
    _, (a, b), pa = _axes(new)
    a, b = np.maximum(a, MIN_SEMI_AXIS), np.maximum(b, MIN_SEMI_AXIS)
    images = bent & (np.asarray(table["kind"]) == IMAGE)
    if images.any():
        table = _adopt_outlines(table, _half_edges(old), _half_edges(new), rounding, images)
        bent = bent & ~images
    longer = bent & (np.abs(a - old_a) > rounding)
    rounder = bent & (longer | (np.abs(b - old_b) > rounding))
    angle = np.radians((pa - old_pa + 90) % 180 - 90)
    turned = bent & ((a - b) * np.abs(angle) > rounding)
    table["r_half"] = np.where(longer, a, table["r_half"].to_value(u.pix)) * u.pix
    table["ellipticity"] = np.where(rounder, 1 - b / a, table["ellipticity"])
    table["pa"] = np.where(turned, pa, table["pa"].to_value(u.deg)) * u.deg
    return table


def _adopt_outlines(
    table: QTable, old: Array, new: Array, rounding: Array, rows: NDArray[np.bool_]
) -> QTable:
    """Return the table with the size and angle of images whose outline was changed."""
    s = check_sources(table)
    along, across = _semi_axes(s)
    r_half, pa = s.r_half.copy(), s.pa.copy()
    for row in np.flatnonzero(rows):
        before, area = (float(np.sqrt(abs(np.linalg.det(e[row])))) for e in (old, new))
        if abs(area - before) > rounding[row]:
            size = max(area, MIN_SEMI_AXIS)
            r_half[row] *= size / np.sqrt(along[row] * across[row])
        angle, was = (np.degrees(np.arctan2(-e[row, 1, 0], e[row, 0, 0])) for e in (new, old))
        turn = (angle - was + 180) % 360 - 180
        if abs(np.radians(turn)) * max(along[row], across[row]) > rounding[row]:
            pa[row] = angle % 360
    table["r_half"], table["pa"] = r_half * u.pix, pa * u.deg
    return table


def features(table: QTable, source_id: NDArray[np.int64]) -> pd.DataFrame:
    """Rows of the source table as layer features, with a stable ``source_id``.

    Values are those of the table's columns, in its units; ``n`` is NaN where there is none, the
    spectrum ``flat`` and the image an empty text.
    """
    columns: dict[str, Any] = {"kind": np.asarray(table["kind"], dtype=str).astype(object)}
    for name in NUMBERS:
        if name in table.colnames:
            column = table[name]
            columns[name] = np.array(getattr(column, "value", column), dtype=np.float64)
        else:
            columns[name] = np.full(len(table), np.nan)
    for name, text in TEXTS.items():
        texts = table[name] if name in table.colnames else np.full(len(table), text)
        columns[name] = np.asarray(texts).astype(object)
    columns["source_id"] = np.asarray(source_id, dtype=np.int64)
    return pd.DataFrame(columns)


def adopt_features(table: QTable, written: pd.DataFrame, current: pd.DataFrame) -> QTable:
    """Return the table with the feature values that differ from those last written.

    Raises
    ------
    ValueError
        If a new value is not allowed.
    """
    table = table.copy()
    for name in FEATURES:
        if name not in current.columns:
            continue
        old, new = written[name].to_numpy(), current[name].to_numpy()
        if name == "kind":
            changed = old.astype(str) != new.astype(str)
            if changed.any():
                table["kind"] = np.where(changed, new.astype(str), table["kind"]).astype("U13")
            continue
        if name in TEXTS:
            changed = old.astype(str) != new.astype(str)
            if changed.any():
                put(table, name, changed, new[changed])
            continue
        new = new.astype(np.float64)
        changed = ~((old == new) | (np.isnan(old.astype(np.float64)) & np.isnan(new)))
        if not changed.any():
            continue
        if name not in table.colnames:
            table[name] = np.full(len(table), np.nan)
        column = table[name]
        unit = getattr(column, "unit", None)
        values = np.where(changed, new, np.asarray(getattr(column, "value", column)))
        table[name] = values if unit is None else values * unit
    check_sources(table)
    return table


def same_ellipses(first: Array, second: Array, tolerance: float = 1e-3) -> bool:
    """Whether boxes hold the same ellipses to ``tolerance`` pixels, however they are drawn."""
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if first.shape != second.shape:
        return False
    if np.any(np.abs(first.mean(axis=1) - second.mean(axis=1)) > tolerance):
        return False
    one, two = _half_edges(first), _half_edges(second)
    size = np.maximum(np.abs(one).max(axis=(1, 2), initial=1.0), 1.0)[:, None, None]
    difference = one @ one.transpose(0, 2, 1) - two @ two.transpose(0, 2, 1)
    return bool(np.all(np.abs(difference) <= 2 * size * tolerance))


def _half_edges(q: Array) -> Array:
    """Half-edges of the boxes as the columns of 2 x 2 matrices."""
    first = (q[:, 1] - q[:, 0] + q[:, 2] - q[:, 3]) / 4
    second = (q[:, 3] - q[:, 0] + q[:, 2] - q[:, 1]) / 4
    return np.stack([first, second], axis=2)


def _axes(q: Array) -> tuple[Array, tuple[Array, Array], Array]:
    centre, semi, pa = ellipses(q)
    return centre, (semi[:, 0], semi[:, 1]), pa

"""Gaussians painted on a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .gaussians import Gaussians

Array = NDArray[np.float64]


def paint(
    mesh: Array,
    start: tuple[float, float],
    cell: float,
    gaussians: Gaussians,
    spread: float,
    cut: float,
) -> None:
    """Add Gaussians to a mesh of densities (cps per pixel area).

    Parameters
    ----------
    mesh : ndarray, shape (ny, nx)
        The mesh; every Gaussian must lie on it as far as it is cut.
    start : (float, float)
        Position (y, x) of the mesh's first point, pixels.
    cell : float
        Spacing of the mesh, pixels.
    gaussians : Gaussians
        What to paint.
    spread : float
        Standard deviation in pixels of a Gaussian by which each is widened.
    cut : float
        Distance in standard deviations beyond which a Gaussian is left out.
    """
    if not len(gaussians):
        return
    xx, yy, xy = gaussians.xx + spread**2, gaussians.yy + spread**2, gaussians.xy
    y = (gaussians.y - start[0]) / cell
    x = (gaussians.x - start[1]) / cell
    same = gaussians.major == 0
    if same.any():
        _paint_points(mesh, y[same], x[same], gaussians.rate[same], spread, cell, cut)
    for i in np.flatnonzero(~same):
        _paint_one(mesh, y[i], x[i], gaussians.rate[i], yy[i], xy[i], xx[i], cell, cut)


def _paint_one(
    mesh: Array,
    y: float,
    x: float,
    rate: float,
    yy: float,
    xy: float,
    xx: float,
    cell: float,
    cut: float,
) -> None:
    rows = _support(y, cut * np.sqrt(yy) / cell)
    columns = _support(x, cut * np.sqrt(xx) / cell)
    dy = (np.arange(rows.start, rows.stop) - y) * cell
    dx = (np.arange(columns.start, columns.stop) - x) * cell
    determinant = xx * yy - xy**2
    height = rate / (2 * np.pi * np.sqrt(determinant))
    if xy == 0:
        row_part = height * np.exp(-0.5 * xx / determinant * dy**2)
        mesh[rows, columns] += row_part[:, None] * np.exp(-0.5 * yy / determinant * dx**2)
        return
    # of the three factors the mixed one alone could overflow: exponents are added first
    exponent = (xy / determinant * dy)[:, None] * dx
    exponent -= (0.5 * xx / determinant * dy**2)[:, None]
    exponent -= 0.5 * yy / determinant * dx**2
    patch = np.exp(exponent, out=exponent)
    patch *= height
    mesh[rows, columns] += patch


def _support(centre: float, half: float) -> slice:
    return slice(int(np.ceil(centre - half)), int(np.floor(centre + half)) + 1)


def _paint_points(
    mesh: Array, y: Array, x: Array, rate: Array, spread: float, cell: float, cut: float
) -> None:
    sigma = spread / cell
    half = int(np.ceil(cut * sigma))
    offsets = np.arange(-half, half + 1)
    for first in range(0, y.size, 4096):
        part = slice(first, first + 4096)
        row, column = np.rint(y[part]).astype(np.intp), np.rint(x[part]).astype(np.intp)
        rows = row[:, None] + offsets
        columns = column[:, None] + offsets
        in_y = np.exp(-0.5 * ((rows - y[part, None]) / sigma) ** 2)
        in_x = np.exp(-0.5 * ((columns - x[part, None]) / sigma) ** 2)
        in_y *= (rate[part] / (2 * np.pi * spread**2))[:, None]
        index = (rows * mesh.shape[1])[:, :, None] + columns[:, None, :]
        value = in_y[:, :, None] * in_x[:, None, :]
        mesh += np.bincount(index.ravel(), value.ravel(), minlength=mesh.size).reshape(mesh.shape)

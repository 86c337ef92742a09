"""The paper's way: sources painted on a grid, convolved with the PSF by FFT.

A star falls on its nearest grid point, a galaxy is its profile at the grid points; the grid is
that of the pixels, or several times finer. The PSF's transform is kept; the frame is padded to
twice its side, so nothing wraps.
"""

from __future__ import annotations

from collections.abc import Callable

import galsim
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray
from scipy import fft
from scipy.special import gamma

from napari_issis import Observation, TelescopePSF
from renderer_galsim import galsim_psf

Array = NDArray[np.float64]
SERSIC = {
    "gaussian": (0.5, np.log(2)),
    "exponential": (1.0, 1.6783470),
    "devaucouleurs": (4, 7.6692494),
}


def pixel_grid(observation: Observation, oversampling: int = 1) -> Callable[[QTable], Array]:
    """Make a renderer on a grid of ``oversampling`` points a pixel."""
    assert isinstance(observation.psf, TelescopePSF)
    ny, nx = (oversampling * side for side in observation.shape)
    kernel = galsim.ImageD(2 * nx, 2 * ny)
    galsim_psf(observation.psf, "tight").drawImage(
        kernel,
        scale=observation.pixel_scale / oversampling,
        center=galsim.PositionD(nx + 1, ny + 1),
    )
    kernel_transform = fft.rfft2(fft.ifftshift(kernel.array))

    def draw(table: QTable) -> Array:
        painted = paint(table, observation, oversampling)
        transform = fft.rfft2(painted, s=(2 * ny, 2 * nx))
        transform *= kernel_transform
        image = fft.irfft2(transform, s=(2 * ny, 2 * nx))[:ny, :nx]
        shape = (ny // oversampling, oversampling, nx // oversampling, oversampling)
        rate: Array = image if oversampling == 1 else image.reshape(shape).sum(axis=(1, 3))
        return rate

    return draw


def paint(table: QTable, observation: Observation, oversampling: int) -> Array:
    """Paint the sources before the PSF, cps per grid cell."""
    ny, nx = (oversampling * side for side in observation.shape)
    frame = np.zeros((ny, nx))
    # pixel coordinates of the grid points
    grid_y = (np.arange(ny) + 0.5) / oversampling - 0.5
    grid_x = (np.arange(nx) + 0.5) / oversampling - 0.5
    rate = np.asarray(table["flux"].value) * observation.cps_per_flux
    radius = np.asarray(table["r_half"].value)
    angle = np.radians(np.asarray(table["pa"].value))
    x, y = np.asarray(table["x"]), np.asarray(table["y"])
    point = np.asarray(table["kind"]) == "point"
    column = np.floor((x[point] + 0.5) * oversampling).astype(int)
    row = np.floor((y[point] + 0.5) * oversampling).astype(int)
    inside = (column >= 0) & (column < nx) & (row >= 0) & (row < ny)
    np.add.at(frame, (row[inside], column[inside]), rate[point][inside])
    for i in np.flatnonzero(~point):
        ratio = 1 - float(table["ellipticity"][i])
        dx, dy = grid_x[None, :] - x[i], grid_y[:, None] - y[i]
        along = dy * np.cos(angle[i]) - dx * np.sin(angle[i])
        across = (dy * np.sin(angle[i]) + dx * np.cos(angle[i])) / ratio
        square = (along**2 + across**2) / radius[i] ** 2
        frame += (
            rate[i]
            / (radius[i] ** 2 * ratio * oversampling**2)
            * profile(str(table["kind"][i]), square)
        )
    return frame


def profile(kind: str, square: Array) -> Array:
    """Surface brightness of unit flux and half-light radius at the squared radius."""
    if kind == "uniform":
        return np.where(square <= 2, 1 / (2 * np.pi), 0.0)
    n, b = SERSIC[kind]
    flux = 2 * np.pi * n * gamma(2 * n) / b ** (2 * n)
    value: Array = np.exp(-b * square ** (0.5 / n)) / flux
    return value

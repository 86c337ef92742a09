"""Uniform ellipses painted on a mesh, from their exact transforms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..sources import SourceArrays
from .profiles import disc_transform

Array = NDArray[np.float64]


def elliptical_frequency(
    ky: Array, kx: Array, r_half: float, ellipticity: float, pa: float
) -> Array:
    """2 pi times the frequency in units of a source's half-light ellipse, on the grid (ky, kx).

    Frequencies in cycles per pixel, ``pa`` in degrees.
    """
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    along = (ky * cos)[:, None] - (kx * sin)[None, :]
    across = (ky * sin)[:, None] + (kx * cos)[None, :]
    q: Array = 2 * np.pi * r_half * np.hypot(along, (1 - ellipticity) * across)
    return q


def disc_half_sizes(sources: SourceArrays) -> tuple[Array, Array]:
    """Half-sizes (y, x) in pixels of the boxes around uniform ellipses."""
    pa = np.radians(sources.pa)
    a = np.sqrt(2) * sources.r_half
    b = a * (1 - sources.ellipticity)
    return np.hypot(a * np.cos(pa), b * np.sin(pa)), np.hypot(a * np.sin(pa), b * np.cos(pa))


def paint_discs(
    mesh: Array,
    start: tuple[float, float],
    cell: float,
    discs: SourceArrays,
    rate: Array,
    spread: float,
    cut: float,
) -> None:
    """Add uniform ellipses, widened by a Gaussian, to a mesh of densities.

    Parameters are those of `painting.paint`; ``rate`` holds the ellipses' count rates.
    """
    half_y, half_x = disc_half_sizes(discs)
    for i in range(len(discs)):
        n_y, first_y = _patch(discs.y[i], half_y[i] + cut * spread, start[0], cell)
        n_x, first_x = _patch(discs.x[i], half_x[i] + cut * spread, start[1], cell)
        ky, kx = fft.fftfreq(n_y, cell), fft.rfftfreq(n_x, cell)
        q = elliptical_frequency(ky, kx, discs.r_half[i], discs.ellipticity[i], discs.pa[i])
        offset_y = discs.y[i] - start[0] - first_y * cell
        offset_x = discs.x[i] - start[1] - first_x * cell
        factor_y = np.exp(-2j * np.pi * ky * offset_y - 2 * (np.pi * spread * ky) ** 2)
        factor_x = np.exp(-2j * np.pi * kx * offset_x - 2 * (np.pi * spread * kx) ** 2)
        spectrum = disc_transform(q) * factor_y[:, None] * factor_x
        patch = fft.irfft2(spectrum, (n_y, n_x)) * (rate[i] / cell**2)
        mesh[first_y : first_y + n_y, first_x : first_x + n_x] += patch


def _patch(centre: float, half: float, start: float, cell: float) -> tuple[int, int]:
    """Return the number of mesh points about a centre and the index of the first."""
    first = int(np.floor((centre - half - start) / cell))
    need = int(np.ceil((centre + half - start) / cell)) - first + 1
    return int(fft.next_fast_len(need, real=True)), first

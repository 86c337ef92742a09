"""Images and derivatives of broad profiles: of their Gaussians, wide ones on coarse meshes.

A profile is a sum of Gaussians. The narrow ones make the core, a Fourier series on a small
window; the others are Fourier series on meshes whose cells grow with their widths, interpolated
down to the pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.sparse import csr_array

from ..sources import SourceArrays
from .optics import Optics
from .profiles import sersic_gaussians

Array = NDArray[np.float64]

# natural logarithm of the accuracy of the sum of Gaussians
DIGITS = 16.0
# a Gaussian on a mesh is at least so many cells wide, along its minor axis
CELLS = 3.0
# points of a mesh that its interpolation to the next finer one takes; points around the window
TAPS, PAD = 10, 12
# standard deviations after which a Gaussian has ended
ENDED = 6.0


@dataclass(frozen=True, eq=False)
class Ellipses:
    """Concentric Gaussians of one ellipse.

    Attributes
    ----------
    sigma, fraction : ndarray, shape (n,)
        Widths over the half-light radius, and shares of the light.
    r_half, ratio, pa : float
        Half-light radius in pixels, axis ratio, position angle in degrees.
    """

    sigma: Array
    fraction: Array
    r_half: float
    ratio: float
    pa: float

    def transforms(self, ky: Array, kx: Array) -> list[Array]:
        """Transform and its derivatives by r_half, ellipticity and pa (degrees).

        Shape (len(ky), len(kx)) each.
        """
        sin, cos = np.sin(np.radians(self.pa)), np.cos(np.radians(self.pa))
        along = ky[:, None] * cos - kx * sin
        across = ky[:, None] * sin + kx * cos
        q = along**2 + (self.ratio * across) ** 2
        value, slope = np.zeros_like(q), np.zeros_like(q)
        for sigma, fraction in zip(self.sigma, self.fraction, strict=True):
            per_q = -2 * (np.pi * self.r_half * sigma) ** 2
            one = fraction * np.exp(np.maximum(per_q * q, -700.0))
            value += one
            slope += per_q * one
        return [
            value,
            slope * q * (2 / self.r_half),
            slope * across**2 * (-2 * self.ratio),
            slope * along * across * (np.radians(2.0) * (self.ratio**2 - 1)),
        ]


def split(one: SourceArrays) -> tuple[Ellipses, dict[int, Ellipses]]:
    """Return the narrow Gaussians of a smooth profile, and those of meshes of 2, 4, ... pixels.

    The keys are the levels: cells of 2^level pixels. The core holds no light: a Gaussian of
    the finest of these meshes is taken from it, and added there. So the PSF's wings around the
    core are left to that mesh, which they reach all over.
    """
    gaussians = sersic_gaussians(float(one.index[0]), DIGITS)
    r_half, ratio = float(one.r_half[0]), 1 - float(one.ellipticity[0])
    minor = r_half * ratio * gaussians.sigma
    level = np.maximum(np.floor(np.log2(minor / CELLS)), 0).astype(int)
    light = float(gaussians.fraction[level == 0].sum())
    stand_in = 2 * CELLS / (r_half * ratio)

    def part(chosen: NDArray[np.bool_], light: float) -> Ellipses:
        sigma = np.append(gaussians.sigma[chosen], stand_in)
        fraction = np.append(gaussians.fraction[chosen], light)
        kept = fraction != 0
        return Ellipses(sigma[kept], fraction[kept], r_half, ratio, float(one.pa[0]))

    levels = {1, *level[level > 0].tolist()}
    parts = {j: part(level == j, light if j == 1 else 0.0) for j in levels}
    return part(level == 0, -light), {j: each for j, each in parts.items() if each.sigma.size}


def broad_images(
    optics: Optics,
    parts: dict[int, Ellipses],
    y: float,
    x: float,
    shape: tuple[int, int],
    wing: float,
) -> Array:
    """Images of the wide Gaussians and its derivatives, shape (6, ny, nx).

    Parameters
    ----------
    optics : Optics
        The transfer function.
    parts : dict of Ellipses
        Those of each level.
    y, x : float
        The centre, in pixels of the window.
    shape : (int, int)
        The window.
    wing : float
        How far light goes by the PSF's wings, pixels.
    """
    images: Array | None = None
    for level in range(max(parts, default=0), 0, -1):
        nodes = _nodes(shape[0], level), _nodes(shape[1], level)
        here = None if images is None else _finer(images, shape, level)
        if level in parts:
            own = _mesh(optics, parts[level], (y, x), nodes, 2.0**level, wing)
            here = own if here is None else here + own
        images = here
    if images is None:
        return np.zeros((6, *shape))
    return _finer(images, shape, 0)


def _nodes(count: int, level: int) -> NDArray[np.intp]:
    """Return indices of the points of a level's mesh, from the window's first pixel."""
    if level == 0:
        return np.arange(count)
    return np.arange(-PAD, int(np.ceil((count - 1) / 2**level)) + PAD + 1)


def _mesh(
    optics: Optics,
    part: Ellipses,
    centre: tuple[float, float],
    nodes: tuple[NDArray[np.intp], NDArray[np.intp]],
    cell: float,
    wing: float,
) -> Array:
    """Images of a level's own Gaussians on its mesh."""
    reach = wing + ENDED * part.r_half * float(part.sigma.max())
    counts = []
    for place, index in zip(centre, nodes, strict=True):
        far = max(abs(place - cell * index[0]), abs(cell * index[-1] - place))
        # periodic images stay outside
        count = int(np.ceil(max((far + reach) / cell, index.size)))
        counts.append(int(fft.next_fast_len(count, real=True)))
    ky, kx = fft.fftfreq(counts[0], cell), fft.rfftfreq(counts[1], cell)
    system = optics.transfer(ky, kx) / cell**2
    phase = np.exp(-2j * np.pi * ky * centre[0])[:, None] * np.exp(-2j * np.pi * kx * centre[1])
    system = system * phase
    image, *shapes = part.transforms(ky, kx)
    image = image * system
    spectra = [image, image * (-2j * np.pi * kx), image * (-2j * np.pi * ky)[:, None]]
    spectra += [each * system for each in shapes]
    values = fft.irfft2(np.stack(spectra), counts)
    rows, columns = nodes[0] % counts[0], nodes[1] % counts[1]
    wanted: Array = values[:, rows[:, None], columns]
    return wanted


def _finer(images: Array, shape: tuple[int, int], level: int) -> Array:
    """Interpolate from the mesh of ``level + 1`` to that of ``level``."""
    rows, columns = _interpolation(shape[0], level), _interpolation(shape[1], level)
    number, ny, nx = images.shape
    along = columns @ images.reshape(number * ny, nx).T
    along = along.reshape(-1, number, ny).transpose(2, 1, 0).reshape(ny, -1)
    result: Array = (rows @ along).reshape(rows.shape[0], number, -1).transpose(1, 0, 2)
    return np.ascontiguousarray(result)


@lru_cache(maxsize=64)
def _interpolation(count: int, level: int) -> csr_array:
    """Lagrange's interpolation half-way between points; every second point is kept."""
    fine, coarse = _nodes(count, level), _nodes(count, level + 1)
    offset = np.arange(TAPS) - TAPS // 2 + 1
    weight = np.array(
        [np.prod([(0.5 - m) / (j - m) for m in offset if m != j]) for j in offset.tolist()]
    )
    below = fine // 2 - coarse[0]
    odd = fine % 2 == 1
    rows = np.concatenate([np.flatnonzero(~odd), np.repeat(np.flatnonzero(odd), TAPS)])
    columns = np.concatenate([below[~odd], (below[odd][:, None] + offset).ravel()])
    data = np.concatenate([np.ones(int((~odd).sum())), np.tile(weight, int(odd.sum()))])
    return csr_array((data, (rows, columns)), shape=(fine.size, coarse.size))

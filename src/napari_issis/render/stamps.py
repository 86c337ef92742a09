"""The frequencies above the meshes' band: each source on a stamp of its own.

On a stamp the filtered kernel is a Fourier series whose period is twice the kernel's reach, and
the image of a source a product of three small matrices: phases of the rows, the spectrum,
phases of the columns. A source's sub-pixel position enters through the phases alone, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..sources import IMAGE, SourceArrays
from .discs import disc_half_sizes, elliptical_frequency
from .images import image_amplitude, image_transform
from .near import high_pass
from .optics import Optics, Transfer
from .plan import Plan
from .profiles import disc_envelope, disc_transform, sersic_gaussians, sersic_transform
from .windows import place

Array = NDArray[np.float64]
CHUNK = 32


def add_stamps(
    image: Array, plan: Plan, sources: SourceArrays, rate: Array, allowed: float
) -> None:
    """Add the high frequencies of every source to an image.

    Parameters
    ----------
    image : ndarray, shape (ny, nx)
        Count rate in cps per pixel, added to in place.
    plan : Plan
        The split of the frequencies.
    sources : SourceArrays
        The scene.
    rate : ndarray, shape (n,)
        Count rates of the sources.
    allowed : float
        Sources whose high frequencies amount to less than this, in cps per pixel, are left
        out, and so are frequencies that add up to less.
    """
    reach = plan.reach(-1)
    plan = plan.filters
    is_point = sources.kind == "point"
    points = is_point & _within(sources, reach, image.shape)
    _add_points(image, plan, sources.y[points], sources.x[points], rate[points], reach)
    for i in np.flatnonzero(~is_point):
        _add_extended(image, plan, sources.take(slice(i, i + 1)), float(rate[i]), reach, allowed)


def _within(sources: SourceArrays, half: float, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    near: NDArray[np.bool_] = (
        (sources.y > -half - 1)
        & (sources.y < shape[0] + half)
        & (sources.x > -half - 1)
        & (sources.x < shape[1] + half)
    )
    return near


@dataclass(frozen=True, eq=False)
class _Grid:
    """Frequencies of a stamp: ``k`` >= 0 with weights 1 for zero and 2 for the others."""

    half: int
    k: Array
    weight: Array

    @property
    def offsets(self) -> Array:
        """Pixels of the stamp relative to its central one."""
        return np.arange(-self.half, self.half + 1.0)

    def tables(self) -> tuple[Array, Array]:
        """Cosine and sine of 2 pi k m, shape (2 half + 1, len(k))."""
        angle = 2 * np.pi * np.outer(self.offsets, self.k)
        return np.cos(angle), np.sin(angle)


@lru_cache(maxsize=256)
def _grid(half: int, limit: float) -> _Grid:
    period = 2 * half + 2
    count = int(np.ceil(limit * period))
    k = np.arange(count + 1) / period
    weight = np.where(k == 0, 1.0, 2.0) / period
    return _Grid(half, k, weight)


@lru_cache(maxsize=8)
def _point_spectrum(plan: Plan, half: int, limit: float) -> Transfer:
    """High-passed transfer function on the quadrant (radial) or the full grid of a stamp."""
    grid = _grid(half, limit)
    spectrum: Transfer
    if plan.optics.radial:
        spectrum = high_pass(plan, grid.k, grid.k) * grid.weight[:, None] * grid.weight
    else:
        spectrum = high_pass(plan, _both_signs(grid.k), grid.k) * grid.weight * grid.weight[0]
    return spectrum


def _both_signs(k: Array) -> Array:
    return np.concatenate([-k[:0:-1], k])


def _turned(grid: _Grid, tables: tuple[Array, Array], shift: Array) -> tuple[Array, Array]:
    """Cosine and sine of 2 pi k (m - shift) for each shift, shape (n, 2 half + 1, len(k))."""
    cos_m, sin_m = tables
    angle = 2 * np.pi * np.outer(shift, grid.k)
    cos_s, sin_s = np.cos(angle)[:, None, :], np.sin(angle)[:, None, :]
    return cos_m * cos_s + sin_m * sin_s, sin_m * cos_s - cos_m * sin_s


def _add_points(image: Array, plan: Plan, y: Array, x: Array, rate: Array, reach: float) -> None:
    half = int(np.ceil(reach))
    limit = plan.highest
    if not y.size or limit <= 0:
        return
    grid = _grid(half, limit)
    tables = grid.tables()
    spectrum = _point_spectrum(plan, half, limit)
    row, column = np.rint(y), np.rint(x)
    for first in range(0, y.size, CHUNK):
        part = slice(first, first + CHUNK)
        cos_y, sin_y = _turned(grid, tables, y[part] - row[part])
        cos_x, sin_x = _turned(grid, tables, x[part] - column[part])
        cos_y *= rate[part, None, None]
        sin_y *= rate[part, None, None]
        stamps = _images(spectrum, None, cos_y, sin_y, cos_x, sin_x)
        for stamp, r, c in zip(stamps, row[part], column[part], strict=True):
            place(image, stamp, int(r) - half, int(c) - half)


def _images(
    even: Transfer, odd: Array | None, cos_y: Array, sin_y: Array, cos_x: Array, sin_x: Array
) -> Array:
    """Stamps from spectra.

    A real spectrum comes as two quadrants, even in both frequencies and odd in both; a complex
    one, Hermitian, on all ky and kx >= 0.
    """
    turn = (0, 2, 1)
    if not np.iscomplexobj(even):
        stamps: Array = cos_y @ even.real @ cos_x.transpose(turn)
        if odd is not None:
            stamps -= sin_y @ odd @ sin_x.transpose(turn)
        return stamps
    phase_y = np.concatenate([(cos_y - 1j * sin_y)[..., :0:-1], cos_y + 1j * sin_y], axis=-1)
    half_way = phase_y @ even
    result: Array = half_way.real @ cos_x.transpose(turn) - half_way.imag @ sin_x.transpose(turn)
    return result


def _add_extended(
    image: Array, plan: Plan, one: SourceArrays, rate: float, reach: float, allowed: float
) -> None:
    if plan.highest <= 0:
        return
    limit = needed_limit(*_radial_high_pass(plan), one, rate, allowed)
    if limit <= 0:
        return
    half_y, half_x = _half_sizes(plan, one, rate, reach, allowed)
    row, column = round(float(one.y[0])), round(float(one.x[0]))
    if not (
        -half_y <= row < image.shape[0] + half_y and -half_x <= column < image.shape[1] + half_x
    ):
        return
    grid_y, grid_x = _grid(half_y, limit), _grid(half_x, limit)
    cos_y, sin_y = _turned(grid_y, grid_y.tables(), one.y - row)
    cos_x, sin_x = _turned(grid_x, grid_x.tables(), one.x - column)
    ky, kx = _both_signs(grid_y.k), grid_x.k
    profile = transform(one, ky, kx) * rate
    if plan.optics.radial:
        filtered = _quadrant_filter(plan, half_y, half_x, limit)
        count = grid_y.k.size
        upper, lower = profile[count - 1 :], profile[count - 1 :: -1]
        even = 0.5 * (upper + lower) * filtered
        odd = (0.5 * (upper - lower) * filtered).real
        stamp = _images(even, odd, cos_y, sin_y, cos_x, sin_x)[0]
    else:
        spectrum = high_pass(plan, ky, kx) * profile * grid_x.weight * grid_y.weight[0]
        stamp = _images(spectrum, None, cos_y, sin_y, cos_x, sin_x)[0]
    place(image, stamp, row - half_y, column - half_x)


@lru_cache(maxsize=256)
def _quadrant_filter(plan: Plan, half_y: int, half_x: int, limit: float) -> Transfer:
    grid_y, grid_x = _grid(half_y, limit), _grid(half_x, limit)
    filtered: Transfer = (
        high_pass(plan, grid_y.k, grid_x.k) * grid_y.weight[:, None] * grid_x.weight
    )
    return filtered


def transform(one: SourceArrays, ky: Array, kx: Array) -> Transfer:
    """Transform of a source's unit-flux profile, centred, on the grid (ky, kx)."""
    if one.kind[0] == IMAGE:
        return image_transform(one, ky, kx)
    q = elliptical_frequency(
        ky, kx, float(one.r_half[0]), float(one.ellipticity[0]), float(one.pa[0])
    )
    if one.kind[0] == "uniform":
        return disc_transform(q)
    return sersic_transform(float(one.index[0]), q)


def needed_limit(
    k: Array, transfer: Array, one: SourceArrays, rate: float, allowed: float
) -> float:
    """Frequency beyond which a source's spectrum adds up to less than ``allowed``.

    ``k`` are the midpoints of equal steps from zero, cycles per pixel, and ``transfer`` is the
    modulus of the transfer function there.
    """
    amplitude = transfer
    if one.kind[0] == IMAGE:
        amplitude = transfer * image_amplitude(one, k)
    elif one.kind[0] != "point":
        angle = (np.arange(24) + 0.5) * (np.pi / 24) + np.radians(one.pa[0])
        stretch = np.hypot(np.cos(angle), (1 - one.ellipticity[0]) * np.sin(angle))
        q = 2 * np.pi * one.r_half[0] * np.outer(k, stretch)
        if one.kind[0] == "uniform":
            profile = disc_envelope(q)
        else:
            profile = sersic_transform(float(one.index[0]), q)
        amplitude = transfer * profile.mean(axis=1)
    step = 2 * k[0]
    tail = np.cumsum((2 * np.pi * k * amplitude)[::-1])[::-1] * step * abs(rate)
    needed = np.flatnonzero(tail > allowed)
    return float(k[needed[-1]] + step) if needed.size else 0.0


@lru_cache(maxsize=16)
def _radial_high_pass(plan: Plan) -> tuple[Array, Array]:
    """Return frequencies, and the larger high-passed transfer on either axis."""
    k = (np.arange(160, dtype=np.float64) + 0.5) * (plan.highest / 160)
    return k, on_axes(plan.optics, k) * (1 - plan.lowpass(k, 0))


def on_axes(optics: Optics, k: Array) -> Array:
    """Modulus of the transfer function on the axis where it is larger."""
    zero: Array = np.zeros(1)
    larger: Array = np.maximum(
        np.abs(optics.transfer(zero, k)[0]), np.abs(optics.transfer(k, zero)[:, 0])
    )
    return larger


def _half_sizes(
    plan: Plan, one: SourceArrays, rate: float, reach: float, allowed: float
) -> tuple[int, int]:
    """Half-sizes (y, x) of the stamp: the kernel's reach and the source's own."""
    if one.kind[0] == "uniform":
        half_y, half_x = disc_half_sizes(one)
        return int(np.ceil(half_y[0] + reach)), int(np.ceil(half_x[0] + reach))
    gaussians = sersic_gaussians(float(one.index[0]), plan.digits + 3)
    k, high = _radial_high_pass(plan)
    amplitude = 2 * np.pi * k * high * (2 * k[0])
    major = one.r_half[0] * gaussians.sigma
    minor = major * (1 - one.ellipticity[0])
    level = np.exp(-2 * (np.pi * minor[:, None] * k) ** 2) @ amplitude
    felt = np.abs(rate * gaussians.fraction) * level > 0.1 * allowed
    widest = float(major[felt].max(initial=0.0))
    pa = np.radians(one.pa[0])
    ratio = 1 - one.ellipticity[0]
    sizes = []
    for direction in (
        np.hypot(np.cos(pa), ratio * np.sin(pa)),
        np.hypot(np.sin(pa), ratio * np.cos(pa)),
    ):
        own = np.sqrt(2 * plan.digits) * widest * direction
        sizes.append(int(np.ceil(np.hypot(reach, own))))
    return sizes[0], sizes[1]

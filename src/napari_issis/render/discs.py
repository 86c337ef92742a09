"""Uniform ellipses painted on a mesh, from their exact transforms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from ..sources import SourceArrays
from .profiles import disc_transform
from .spreading import spread_cut
from .threads import blocks, for_each

Array = NDArray[np.float64]

# ellipses painted by all threads before they are added to the mesh
TOGETHER = 16


def elliptical_frequency(
    ky: Array, kx: Array, r_half: float, ellipticity: float, pa: float
) -> Array:
    """2 pi times the frequency in units of a source's half-light ellipse, on the grid (ky, kx).

    Frequencies in cycles per pixel, ``pa`` in degrees.
    """
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    major = 2 * np.pi * r_half
    minor = major * (1 - ellipticity)
    along = (major * cos * ky)[:, None] - major * sin * kx
    across = (minor * sin * ky)[:, None] + minor * cos * kx
    along *= along
    across *= across
    along += across
    q: Array = np.sqrt(along, out=along)
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
    digits: float,
) -> None:
    """Add uniform ellipses, widened by a Gaussian, to a mesh of densities.

    Parameters are those of `painting.paint`; ``rate`` holds the ellipses' count rates and
    ``digits`` is the natural logarithm of the accuracy.
    """
    cut = float(spread_cut(digits))
    # taking back the spreading amplifies errors at high frequencies by up to exp(0.75 digits)
    accuracy = min(3e3 * np.exp(-1.75 * digits), 0.02 * np.exp(-digits))
    half_y, half_x = disc_half_sizes(discs)

    patches: dict[int, tuple[int, int, Array]] = {}

    def transform(i: int) -> None:
        n_y, first_y = _patch(discs.y[i], half_y[i] + cut * spread, start[0], cell)
        n_x, first_x = _patch(discs.x[i], half_x[i] + cut * spread, start[1], cell)
        ky, kx = fft.fftfreq(n_y, cell), fft.rfftfreq(n_x, cell)
        q = elliptical_frequency(ky, kx, discs.r_half[i], discs.ellipticity[i], discs.pa[i])
        offset_y = discs.y[i] - start[0] - first_y * cell
        offset_x = discs.x[i] - start[1] - first_x * cell
        factor_y = np.exp(-2j * np.pi * ky * offset_y - 2 * (np.pi * spread * ky) ** 2)
        factor_x = np.exp(-2j * np.pi * kx * offset_x - 2 * (np.pi * spread * kx) ** 2)
        factor_y *= rate[i] / cell**2
        spectrum = disc_transform(q, accuracy) * factor_y[:, None]
        spectrum *= factor_x
        patches[i] = first_y, first_x, fft.irfft2(spectrum, (n_y, n_x), overwrite_x=True)

    for some in blocks(len(discs), TOGETHER):
        for_each(transform, range(len(discs))[some])
        for i in range(len(discs))[some]:  # in the same order whoever was first
            y, x, patch = patches.pop(i)
            mesh[y : y + len(patch), x : x + patch.shape[1]] += patch


def paint_large_discs(
    mesh: Array,
    start: tuple[float, float],
    cell: float,
    discs: SourceArrays,
    rate: Array,
    spread: float,
    digits: float,
) -> None:
    """Add what lies on a mesh of uniform ellipses that may be far larger than it.

    Parameters are those of `paint_discs`.

    Notes
    -----
    Away from its edge the widened ellipse is constant. Near the edge it is integrated along
    lines through each point, perpendicular to the edge or, if both edges are near, to the major
    axis: exactly along each line, as differences of the normal distribution function, and by
    Gauss-Legendre across the lines.
    """
    reach = spread * np.sqrt(2 * (digits + 3))
    y = start[0] + cell * np.arange(mesh.shape[0])
    x = start[1] + cell * np.arange(mesh.shape[1])
    for i in range(len(discs)):
        a = np.sqrt(2) * discs.r_half[i]
        b = a * (1 - discs.ellipticity[i])
        sin, cos = np.sin(np.radians(discs.pa[i])), np.cos(np.radians(discs.pa[i]))
        dy, dx = (y - discs.y[i])[:, None], (x - discs.x[i])[None, :]
        along, across = dy * cos - dx * sin, dy * sin + dx * cos
        radius = np.hypot(along / a, across / b)
        # the ellipse lies between its copies scaled by 1 -+ reach / b on either side of a point
        near = np.abs(radius - 1) * b <= reach
        brightness = rate[i] / (np.pi * a * b)
        mesh[(radius < 1) & ~near] += brightness
        mesh[near] += brightness * _share_inside(along[near], across[near], a, b, spread, digits)


def _share_inside(
    along: Array, across: Array, a: float, b: float, spread: float, digits: float
) -> Array:
    """Share of a Gaussian about each point that lies inside the ellipse of semi-axes a and b."""
    limit = spread * np.sqrt(2 * (digits + 3))
    node, weight = np.polynomial.legendre.leggauss(int(40 + 4 * digits))
    slope_along, slope_across = along / a**2, across / b**2
    # unit vectors along the lines (n) and across them (t)
    if b > 2 * limit:
        length = np.hypot(slope_along, slope_across)
        n_along, n_across = slope_along / length, slope_across / length
    else:
        n_along, n_across = np.zeros_like(along), np.ones_like(along)
    # points p + s n + u t inside: A s^2 + 2 B s + C <= 0, B and C linear and quadratic in u
    quadratic = (n_along / a) ** 2 + (n_across / b) ** 2
    mixed = n_along * n_across * (1 / b**2 - 1 / a**2)
    square = (n_across / a) ** 2 + (n_along / b) ** 2
    linear = n_along * slope_along + n_across * slope_across
    turn = n_along * slope_across - n_across * slope_along
    inside = (along / a) ** 2 + (across / b) ** 2 - 1
    # lines that meet the ellipse: discriminant d0 + 2 d1 u - d2 u^2 >= 0
    d0 = linear**2 - quadratic * inside
    d1 = linear * mixed - quadratic * turn
    d2 = quadratic * square - mixed**2
    half = np.sqrt(np.maximum(d1**2 + d0 * d2, 0.0))
    low = np.clip((d1 - half) / d2, -limit, limit)
    high = np.clip((d1 + half) / d2, -limit, limit)
    share = np.zeros_like(along)
    for at, w in zip(0.5 * np.pi * node, 0.5 * np.pi * weight, strict=True):
        # the sine removes the square roots at the ends of the range
        u = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(at)
        root = np.sqrt(np.maximum(d0 + u * (2 * d1 - d2 * u), 0.0))
        middle = linear + mixed * u
        first = (-middle - root) / quadratic / spread
        last = (-middle + root) / quadratic / spread
        density = np.exp(-0.5 * (u / spread) ** 2) / (np.sqrt(2 * np.pi) * spread)
        measure = w * 0.5 * (high - low) * np.cos(at) * density
        share += measure * (special.ndtr(last) - special.ndtr(first))
    return share


def _patch(centre: float, half: float, start: float, cell: float) -> tuple[int, int]:
    """Return the number of mesh points about a centre and the index of the first."""
    first = int(np.floor((centre - half - start) / cell))
    need = int(np.ceil((centre + half - start) / cell)) - first + 1
    return int(fft.next_fast_len(need, real=True)), first

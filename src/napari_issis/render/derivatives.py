"""The images of single sources and their derivatives by the sources' parameters, on windows.

On a window the image is a Fourier series. A derivative by the position multiplies its terms
by the frequency, one by a shape parameter differentiates the profile's transform.

Windows end softly, and derivatives are those of the image that ends so: images of point sources
are then all the same image, moved. What two sources close together cannot tell apart stays so;
edges of two windows would tell them apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..sources import IMAGE, SourceArrays
from .broad import Ellipses, broad_images, split
from .moving import highest_frequency, point_reach, profile_half_sizes
from .optics import Optics, Transfer
from .small_products import stack_product
from .stamps import transform
from .wide import wide_images
from .windows import Window, overlap

Array = NDArray[np.float64]

# steps of the central differences of the transform: relative to r_half, and of the
# ellipticity and the angle in radians; the error is about their square
STEP = 1e-4
# frequencies that add up to less than this share of the peak are left out
TAIL = 1e-7
# point sources computed at once
CHUNK = 32
# half-size of a window in pixels from which a smooth profile is computed on several meshes
BROAD = 100
# shares of a point's peak where the PSF's wings end around a profile's core and on meshes
CORE_LEVEL, FAR_LEVEL = 1e-6, 1e-7
# half-size of a core in pixels above which the profile is not computed so
LARGEST_CORE = 500


@dataclass(frozen=True, eq=False)
class Derivatives:
    """Derivatives of a source's image where its window and the frame overlap.

    Attributes
    ----------
    window : (slice, slice)
        The overlap.
    images : ndarray, shape (3 or 6, ny, nx)
        Image of the source at a rate of 1 cps, which is the derivative by the rate, and the
        derivatives of that image by x and y (per pixel); for extended sources, images excepted,
        by r_half (per pixel), ellipticity and pa (per degree) too.
    """

    window: Window
    images: Array


@dataclass(frozen=True)
class _Taper:
    """Half a window: 1 up to ``start`` and 0 from ``stop`` pixels, in either direction."""

    start: float

    @property
    def stop(self) -> float:
        return 1.4 * self.start + 4.0

    @property
    def half(self) -> int:
        """Pixels from the one in which the source lies."""
        return int(self.stop) + 1

    @property
    def period(self) -> int:
        # what is beyond the window wraps into it fainter than it is at its end
        return 2 * self.half + 2

    def values(self, offset: Array) -> tuple[Array, Array]:
        """Return the taper and its derivative by the source's position."""
        length = self.stop - self.start
        t = np.clip((np.abs(offset) - self.start) / length, 0.0, 1.0)
        value = 1 - t**3 * (10 - 15 * t + 6 * t**2)
        return value, np.sign(offset) * (30 / length) * (t * (1 - t)) ** 2


def derivatives(
    optics: Optics, sources: SourceArrays, level: Array, share: float, shape: tuple[int, int]
) -> Iterator[tuple[int, Derivatives]]:
    """Images of sources of 1 cps and their derivatives, from the frame's first row on.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    sources : SourceArrays
        The scene, of n sources.
    level : ndarray, shape (n,)
        The windows reach as far as profiles are above this, per pixel...
    share : float
        ...and a point source is above this share of its peak, whichever its rate.
    shape : (int, int)
        Frame in pixels.

    Yields
    ------
    row : int
        Of the source table; sources whose windows miss the frame are left out.
    derivatives : Derivatives
        The first rows of their windows never fall.
    """
    wing = _reach(optics, share / optics.point_area)
    taper = _Taper(wing)
    tapers: dict[int, tuple[_Taper, _Taper] | None] = {}
    start = np.rint(sources.y) - taper.half
    quick = (sources.kind == "point") & optics.radial
    for i in np.flatnonzero(~quick).tolist():
        ends = _tapers(sources.take(slice(i, i + 1)), wing, float(level[i]), shape)
        tapers[i] = ends
        start[i] = 0.0 if ends is None else round(float(sources.y[i])) - ends[0].half
    order = np.argsort(np.maximum(start, 0.0), kind="stable")
    points = order[quick[order]]
    near_y = np.abs(sources.y[points] - (shape[0] - 1) / 2) < shape[0] / 2 + taper.half + 1
    near_x = np.abs(sources.x[points] - (shape[1] - 1) / 2) < shape[1] / 2 + taper.half + 1
    stars = _stars(optics, taper, sources, points[near_y & near_x], shape)
    star = next(stars, None)
    for i in order.tolist():
        part: Derivatives | None = None
        if not quick[i]:
            part = _any(optics, sources.take(slice(i, i + 1)), tapers[i], shape)
        elif star is not None and star[0] == i:
            part, star = star[1], next(stars, None)
        if part is not None:
            yield i, part


def _stars(
    optics: Optics,
    taper: _Taper,
    sources: SourceArrays,
    points: NDArray[np.intp],
    shape: tuple[int, int],
) -> Iterator[tuple[int, Derivatives | None]]:
    for first in range(0, points.size, CHUNK):
        rows = points[first : first + CHUNK]
        images = _points(optics, taper, sources.y[rows], sources.x[rows])
        for i, own in zip(rows, images, strict=True):
            yield int(i), _inside(shape, sources, i, (taper, taper), own)


def _any(
    optics: Optics,
    one: SourceArrays,
    tapers: tuple[_Taper, _Taper] | None,
    shape: tuple[int, int],
) -> Derivatives | None:
    """Return derivatives of a source of any kind; None where its window misses the frame."""
    if tapers is None:
        whole = slice(0, shape[0]), slice(0, shape[1])
        broad = _broad(optics, one, None, whole)
        return Derivatives(whole, wide_images(optics, one, shape) if broad is None else broad)
    half = tapers[0].half, tapers[1].half
    row, column = round(float(one.y[0])) - half[0], round(float(one.x[0])) - half[1]
    window = overlap(shape, row, column, (2 * half[0] + 1, 2 * half[1] + 1))
    if window is None:
        return None
    broad = _broad(optics, one, tapers, window) if max(half) > BROAD else None
    return Derivatives(window, _images(optics, one, tapers, window) if broad is None else broad)


def _broad(
    optics: Optics, one: SourceArrays, tapers: tuple[_Taper, _Taper] | None, window: Window
) -> Array | None:
    """Images of a smooth profile on a large window; None where its core is as large."""
    if not np.isfinite(one.index[0]):
        return None
    core, parts = split(one)
    wing = _reach(optics, CORE_LEVEL / optics.point_area)
    longest = core.r_half * float(core.sigma.max(initial=0.0))
    taper = _Taper(float(np.hypot(wing, 5 * longest)))
    if taper.half > LARGEST_CORE:
        return None
    y, x = float(one.y[0]), float(one.x[0])
    (ny, nx), (top, left) = zip(*((w.stop - w.start, w.start) for w in window), strict=True)
    far = min(_reach(optics, FAR_LEVEL / optics.point_area), float(max(ny, nx)))
    images = broad_images(optics, parts, y - top, x - left, (ny, nx), far)
    n = 2 * taper.half + 1
    near = overlap((ny, nx), round(y) - taper.half - top, round(x) - taper.half - left, (n, n))
    if near is not None and core.sigma.size:
        rows, columns = near
        placed = (
            slice(rows.start + top, rows.stop + top),
            slice(columns.start + left, columns.stop + left),
        )
        images[:, rows, columns] += _images(optics, one, (taper, taper), placed, core)
    if tapers is not None:
        (end_y, slope_y), (end_x, slope_x) = (
            each.values(np.arange(w.start, w.stop, dtype=np.float64) - v)
            for each, w, v in zip(tapers, window, (y, x), strict=True)
        )
        end = end_y[:, None] * end_x
        image = images[0].copy()
        images *= end
        images[1] += image * (end_y[:, None] * slope_x)
        images[2] += image * (slope_y[:, None] * end_x)
    return images


def _reach(optics: Optics, level: float) -> float:
    """Distance in pixels beyond which a point source of unit rate is below a level."""
    return point_reach(optics, level) if optics.radial else _image_reach(optics, level)


@lru_cache(maxsize=16)
def _image_reach(optics: Optics, level: float) -> float:
    # an image PSF ends somewhere, but for its ringing
    taper = _Taper(optics.extent + 20.0)
    n = 2 * taper.half + 1
    here = np.full(1, float(taper.half))
    one = replace(POINT, x=here, y=here)
    image = _images(optics, one, (taper, taper), (slice(0, n), slice(0, n)))[0]
    offset = np.arange(n) - here
    bright = np.abs(image) > level
    return float(np.hypot(offset[:, None], offset)[bright].max(initial=0.0))


def _tapers(
    one: SourceArrays, wing: float, level: float, shape: tuple[int, int]
) -> tuple[_Taper, _Taper] | None:
    """Choose where a source's window ends in y and x; None if not within the frame."""
    if one.kind[0] == "point":
        return _Taper(wing), _Taper(wing)
    half_y, half_x = profile_half_sizes(one, level)
    if one.kind[0] in ("uniform", IMAGE):
        start_y, start_x = wing + half_y, wing + half_x
    else:
        start_y, start_x = np.hypot(wing, _coarse(half_y)), np.hypot(wing, _coarse(half_x))
    y, x = float(one.y[0]), float(one.x[0])
    if start_y > max(y, shape[0] - y) or start_x > max(x, shape[1] - x):
        return None
    return _Taper(float(start_y)), _Taper(float(start_x))


def _coarse(size: float) -> float:
    """Round up in steps of a fifth, so that sources almost alike have windows alike."""
    return float(2 ** (np.ceil(4 * np.log2(size)) / 4)) if size > 0 else 0.0


# ---------------------------------------------------------------- point sources at once


def _points(optics: Optics, taper: _Taper, y: Array, x: Array) -> Array:
    """Image and derivatives by x and y of point sources, shape (n, 3, n_y, n_x)."""
    k, spectrum = _quadrant(optics, taper.period)
    value_y, slope_y = _point_series(taper, k, y - np.round(y))
    value_x, slope_x = _point_series(taper, k, x - np.round(x))
    value_x, slope_x = value_x.transpose(0, 2, 1), slope_x.transpose(0, 2, 1)
    images = np.empty((y.size, 3, value_y.shape[1], value_x.shape[2]))
    rows = stack_product(value_y, spectrum)
    stack_product(rows, value_x, images[:, 0])
    stack_product(rows, slope_x, images[:, 1])
    stack_product(stack_product(slope_y, spectrum), value_x, images[:, 2])
    return images


def _point_series(taper: _Taper, k: Array, shift: Array) -> tuple[Array, Array]:
    """Tapered cosines of the pixels around each source, and their derivatives by its position.

    Shapes (n, 2 half + 1, len(k)).
    """
    pixel = np.arange(-taper.half, taper.half + 1.0)
    omega = 2 * np.pi * k
    cos_m, sin_m = np.cos(np.outer(pixel, omega)), np.sin(np.outer(pixel, omega))
    cos_s, sin_s = (each[:, None] for each in _cos_sin(np.outer(shift, omega)))
    end, end_slope = (each[:, :, None] for each in taper.values(pixel - shift[:, None]))
    cos = cos_m * cos_s + sin_m * sin_s
    sin = sin_m * (cos_s * omega) - cos_m * (sin_s * omega)
    return end * cos, end * sin + end_slope * cos


def _cos_sin(angle: Array) -> tuple[Array, Array]:
    return np.cos(angle), np.sin(angle)


_NOTHING = np.zeros(1)
# One point at the origin.
POINT = SourceArrays(
    np.array(["point"]),
    *(_NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING, _NOTHING),
    np.array([""]),
)


@lru_cache(maxsize=16)
def _point_limit(optics: Optics) -> float:
    return highest_frequency(optics, POINT, 1.0, TAIL / optics.point_area)


@lru_cache(maxsize=16)
def _quadrant(optics: Optics, period: int) -> tuple[Array, Array]:
    """Frequencies >= 0 in cycles per pixel, and the weights of their cosines."""
    k = np.arange(int(_point_limit(optics) * period) + 1) / period
    weight = np.where(k == 0, 1.0, 2.0) / period
    spectrum: Array = optics.transfer(k, k).real * weight[:, None] * weight
    return k, spectrum


def _inside(
    shape: tuple[int, int],
    sources: SourceArrays,
    i: int,
    tapers: tuple[_Taper, _Taper],
    images: Array,
) -> Derivatives | None:
    """Cut the images of a window to the frame."""
    row = int(np.round(sources.y[i])) - tapers[0].half
    column = int(np.round(sources.x[i])) - tapers[1].half
    window = overlap(shape, row, column, images.shape[1:])
    if window is None:
        return None
    y, x = window
    return Derivatives(
        window, images[:, y.start - row : y.stop - row, x.start - column : x.stop - column]
    )


# ---------------------------------------------------------------- any source, any PSF


def _images(
    optics: Optics,
    one: SourceArrays,
    tapers: tuple[_Taper, _Taper],
    window: Window,
    core: Ellipses | None = None,
) -> Array:
    """Image and derivatives of one source on a window, shape (3 or 6, ny, nx).

    If there is a ``core``, of these Gaussians of the source alone.
    """
    limit = (
        _point_limit(optics)
        if one.kind[0] == "point"
        else highest_frequency(optics, one, 1.0, TAIL / optics.point_area)
    )
    period_y, period_x = tapers[0].period, tapers[1].period
    my, mx = int(limit * period_y), int(limit * period_x)
    ky, kx = np.arange(-my, my + 1) / period_y, np.arange(mx + 1) / period_x
    weight = np.where(kx == 0, 1.0, 2.0) / (period_y * period_x)
    spectra: list[Transfer] = [optics.transfer(ky, kx) * weight]
    if one.kind[0] != "point":
        system = spectra[0]
        own = _transforms(one, ky, kx) if core is None else core.transforms(ky, kx)
        spectra = [system * each for each in own]
    value_y, slope_y = _phases(tapers[0], ky, window[0], float(one.y[0]))
    value_x, slope_x = _phases(tapers[1], kx, window[1], float(one.x[0]))
    along_x = spectra[0] @ value_x.T
    images = [
        (value_y @ along_x).real,
        (value_y @ (spectra[0] @ slope_x.T)).real,
        (slope_y @ along_x).real,
    ]
    images += [(value_y @ (each @ value_x.T)).real for each in spectra[1:]]
    return np.stack(images)


def _phases(
    taper: _Taper, k: Array, pixels: slice, position: float
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Tapered phases of pixels, and their derivatives by the source's position."""
    offset = np.arange(pixels.start, pixels.stop) - position
    end, end_slope = (each[:, None] for each in taper.values(offset))
    phase = np.exp(2j * np.pi * np.outer(offset, k))
    return end * phase, (end_slope - end * (2j * np.pi * k)) * phase


def _transforms(one: SourceArrays, ky: Array, kx: Array) -> list[Transfer]:
    """Transform of the profile and its derivatives by r_half, ellipticity and pa (degrees).

    Of an image the size and the angle are known: the transform alone.
    """
    if one.kind[0] == IMAGE:
        return [transform(one, ky, kx)]
    steps = {
        "r_half": STEP * float(one.r_half[0]),
        "ellipticity": STEP * (1 - float(one.ellipticity[0])),
        "pa": float(np.degrees(STEP)),
    }
    result = [transform(one, ky, kx)]
    for name, step in steps.items():
        value = getattr(one, name)
        ahead = transform(replace(one, **{name: value + step}), ky, kx)
        behind = transform(replace(one, **{name: value - step}), ky, kx)
        result.append((ahead - behind) / (2 * step))
    return result

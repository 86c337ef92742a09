"""The image of one source and its derivatives by the source's parameters, on a window.

On the window the image is a Fourier series. A derivative by the position multiplies its terms
by the frequency, one by a shape parameter differentiates the profile's transform.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..sources import IMAGE, SourceArrays
from .moving import half_sizes, highest_frequency
from .optics import Optics, Transfer
from .stamps import transform
from .windows import Window, overlap

Array = NDArray[np.float64]

# steps of the central differences of the transform: relative to r_half, and of the
# ellipticity and the angle in radians; the error is about their square
STEP = 1e-4
# frequencies that add up to less than this share of the peak are left out
TAIL = 1e-7


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


def derivatives(
    optics: Optics, one: SourceArrays, level: float, shape: tuple[int, int]
) -> Derivatives | None:
    """Image of a source of 1 cps and its derivatives; None if its window misses the frame.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    one : SourceArrays
        The source, of length 1.
    level : float
        The window reaches as far as the image is above this, per pixel.
    shape : (int, int)
        Frame in pixels.
    """
    # no further than the farthest pixel of the frame, and beyond it no image is asked for
    far_y = max(abs(float(one.y[0])), abs(float(one.y[0]) - shape[0])) + 1
    far_x = max(abs(float(one.x[0])), abs(float(one.x[0]) - shape[1])) + 1
    half = half_sizes(optics, one, 1.0, level)
    half_y, half_x = min(half[0], int(far_y)), min(half[1], int(far_x))
    row, column = round(float(one.y[0])) - half_y, round(float(one.x[0])) - half_x
    window = overlap(shape, row, column, (2 * half_y + 1, 2 * half_x + 1))
    if window is None:
        return None
    limit = _limit(optics, one)
    # what lies beyond the window wraps into the margin between window and period
    period_y, period_x = 3 * half_y + 2, 3 * half_x + 2
    my, mx = int(limit * period_y), int(limit * period_x)
    ky, kx = np.arange(-my, my + 1) / period_y, np.arange(mx + 1) / period_x
    m: Array = np.arange(window[0].start, window[0].stop, dtype=np.float64)
    m -= float(one.y[0])
    n: Array = np.arange(window[1].start, window[1].stop, dtype=np.float64)
    n -= float(one.x[0])
    if one.kind[0] == "point" and optics.radial:
        return Derivatives(window, _point_images(optics, my, mx, period_y, period_x, m, n))
    weight = np.where(kx == 0, 1.0, 2.0) / (period_y * period_x)
    spectra: list[Transfer] = [optics.transfer(ky, kx) * weight]
    if one.kind[0] != "point":
        system = spectra[0]
        spectra = [system * each for each in _transforms(one, ky, kx)]
    phase_y = np.exp(2j * np.pi * np.outer(m, ky))
    phase_x = np.exp(2j * np.pi * np.outer(n, kx)).T
    along_x = spectra[0] @ phase_x
    images = [
        (phase_y @ along_x).real,
        (phase_y @ (spectra[0] @ (phase_x * (-2j * np.pi * kx)[:, None]))).real,
        ((phase_y * (-2j * np.pi * ky)) @ along_x).real,
    ]
    images += [(phase_y @ (each @ phase_x)).real for each in spectra[1:]]
    return Derivatives(window, np.stack(images))


def _limit(optics: Optics, one: SourceArrays) -> float:
    return (
        _point_limit(optics)
        if one.kind[0] == "point"
        else highest_frequency(optics, one, 1.0, TAIL / optics.point_area)
    )


@lru_cache(maxsize=16)
def _point_limit(optics: Optics) -> float:
    nothing = np.zeros(1)
    shape = (nothing, nothing, nothing, nothing)
    one = SourceArrays(np.array(["point"]), nothing, nothing, nothing, *shape, np.array([""]))
    return highest_frequency(optics, one, 1.0, TAIL / optics.point_area)


@lru_cache(maxsize=64)
def _quadrant(optics: Optics, my: int, mx: int, period_y: int, period_x: int) -> Array:
    ky, kx = np.arange(my + 1) / period_y, np.arange(mx + 1) / period_x
    weight_y = np.where(ky == 0, 1.0, 2.0) / period_y
    weight_x = np.where(kx == 0, 1.0, 2.0) / period_x
    spectrum: Array = optics.transfer(ky, kx).real * weight_y[:, None] * weight_x
    return spectrum


def _point_images(
    optics: Optics, my: int, mx: int, period_y: int, period_x: int, m: Array, n: Array
) -> Array:
    spectrum = _quadrant(optics, my, mx, period_y, period_x)
    omega_y = 2 * np.pi * np.arange(my + 1) / period_y
    omega_x = 2 * np.pi * np.arange(mx + 1) / period_x
    angle_y, angle_x = np.outer(m, omega_y), np.outer(n, omega_x)
    cos_y, cos_x = np.cos(angle_y) @ spectrum, np.cos(angle_x)
    sin_y, sin_x = (np.sin(angle_y) * omega_y) @ spectrum, np.sin(angle_x) * omega_x
    return np.stack([cos_y @ cos_x.T, cos_y @ sin_x.T, sin_y @ cos_x.T])


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

"""Images as sources: each a lattice of Gaussians (see `SourceImage`), scaled and turned."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage

from ..kept_images import kept_image
from ..source_image import SourceImage
from ..sources import IMAGE, SourceArrays
from .gaussians import Gaussians, ellipse, join
from .optics import Optics
from .painting import paint, scene_painter

Array = NDArray[np.float64]

# share of the error allowed that the samples left out may add up to
LEFT_OUT = 0.02
# A sample's Gaussian, sampled at 1 / (k + CUTOFF) of its width, is right up to the frequency k
# to 1e-12, and has nothing above CUTOFF; it is painted as far as CUT.
CUTOFF = 1.2
CUT = 7.5
# Gaussians fainter than this share of the brightest are left out of a transform
FAINTEST = 1e-14
# frequencies are rounded up to multiples of this, so that painted images are shared
LIMIT_STEP = 0.1
# samples on a side, above which the transform at few frequencies is quicker than all of them
LARGEST_PERIOD = 2500
# pixels beyond which a PSF's wings do not change the noise
PSF_REACH = 50.0


def is_image(sources: SourceArrays) -> NDArray[np.bool_]:
    """Which sources are images."""
    chosen: NDArray[np.bool_] = sources.kind == IMAGE
    return chosen


def image_of(one: SourceArrays) -> tuple[SourceImage, float]:
    """Image of a source, and the spacing of its samples in pixels; ``one`` is of length 1."""
    image = kept_image(str(one.image[0]))
    return image, float(one.r_half[0]) / image.r_half


def image_gaussians(sources: SourceArrays, rate: Array, allowed: float) -> Gaussians:
    """Gaussians of sources that are images.

    Parameters
    ----------
    sources : SourceArrays
        The images alone.
    rate : ndarray, shape (n,)
        Their count rates.
    allowed : float
        Error allowed, cps per pixel: samples are left out that are fainter than a share of it.
    """
    faintest = LEFT_OUT * allowed / len(sources)
    return join(
        [_one(sources.take(slice(i, i + 1)), float(rate[i]), faintest) for i in range(len(sources))]
    )


def _one(one: SourceArrays, rate: float, faintest: float) -> Gaussians:
    """Gaussians of one image that are brighter than a surface brightness, cps per pixel."""
    image, pitch = image_of(one)
    bright = np.abs(image.weights) * (rate / pitch**2) > faintest
    x, y = _positions(image, float(one.pa[0]))
    weight = image.weights[bright] * rate
    width = np.full(weight.shape, pitch)
    made = ellipse(
        one.x[0] + pitch * x[bright],
        one.y[0] + pitch * y[bright],
        weight,
        width,
        width,
        np.zeros_like(width),
    )
    return Gaussians(**{**made.__dict__, "pitch": width})


def _positions(image: SourceImage, pa: float) -> tuple[Array, Array]:
    """Places (x, y) of the Gaussians about the image's centre, in samples, turned."""
    ny, nx = image.weights.shape
    v, u = np.arange(ny)[:, None] - 0.5 * (ny - 1), np.arange(nx) - 0.5 * (nx - 1)
    cos, sin = _direction(pa)
    return u * cos - v * sin, u * sin + v * cos


def _direction(pa: float) -> tuple[float, float]:
    """Cosine and sine, exact at right angles."""
    turns = pa / 90.0
    if turns == round(turns):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(turns) % 4]
    return float(np.cos(np.radians(pa))), float(np.sin(np.radians(pa)))


def image_reach(sources: SourceArrays) -> Array:
    """Distance in pixels from each source beyond which an image is dark; 0 for others."""
    reach = np.zeros(len(sources))
    for i in np.flatnonzero(is_image(sources)):
        image, pitch = image_of(sources.take(slice(i, i + 1)))
        reach[i] = pitch * image.half_diagonal
    return reach


def image_excess(sources: SourceArrays) -> Array:
    """Sum of the moduli of an image's Gaussians over its flux; 1 for other sources."""
    excess = np.ones(len(sources))
    for i in np.flatnonzero(is_image(sources)):
        excess[i] = _excess(kept_image(str(sources.image[i])))
    return excess


@lru_cache(maxsize=64)
def _excess(image: SourceImage) -> float:
    return float(np.abs(image.weights).sum())


def image_peak(optics: Optics, one: SourceArrays, rate: float) -> float:
    """Estimate the highest pixel of an image alone, cps per pixel."""
    image, pitch = image_of(one)
    blur = np.sqrt(optics.point_area / (2 * np.pi)) / pitch
    return rate * min(_highest(image, float(blur)) / pitch**2, 1 / optics.point_area)


@lru_cache(maxsize=64)
def _highest(image: SourceImage, blur: float) -> float:
    """Highest share of the flux in a sample after a Gaussian blur, of a width in samples."""
    # far beyond the image, the blur spreads all of it
    width = min(blur, float(max(image.array.shape)))
    blurred = ndimage.gaussian_filter(image.array, width, mode="constant", truncate=4.0)
    return float(blurred.max() / image.array.sum())


def highest_gaussian(optics: Optics, sources: SourceArrays, rate: Array) -> float:
    """Highest pixel that a single Gaussian of the images makes, either sign, cps per pixel."""
    highest = 0.0
    for i in range(len(sources)):
        image, pitch = image_of(sources.take(slice(i, i + 1)))
        largest = float(np.abs(image.weights).max())
        highest = max(highest, largest * rate[i] / (optics.point_area + 2 * np.pi * pitch**2))
    return highest


def image_amplitude(one: SourceArrays, k: Array) -> Array:
    """Upper bound of an image's transform at frequencies ``k``, cycles per pixel.

    The samples' own is at most the sum of their moduli over their sum; the interpolation passes
    no more than it does along the diagonal or an axis.
    """
    image, pitch = image_of(one)
    share = float(np.abs(image.array).sum() / image.array.sum())
    along = _passed(k * pitch)
    across = _passed(k * (pitch / np.sqrt(2))) ** 2
    bound: Array = share * np.maximum(along, across)
    return bound


def _passed(k: Array) -> Array:
    """Transfer of the interpolation at a frequency in cycles per sample, but for 1e-8."""
    return np.asarray(1 / (1 + np.exp(np.minimum(2 * np.pi**2 * (2 * k - 1), 700.0))))


def image_transform(one: SourceArrays, ky: Array, kx: Array) -> NDArray[np.complex128]:
    """Transform of an image of unit flux, centred on the source, on the grid (ky, kx).

    Parameters
    ----------
    one : SourceArrays
        The source, of length 1.
    ky, kx : ndarray
        Frequencies in cycles per pixel.
    """
    image, pitch = image_of(one)
    return _transform(image, pitch, float(one.pa[0]), ky, kx)


def _transform(
    image: SourceImage, pitch: float, pa: float, ky: Array, kx: Array
) -> NDArray[np.complex128]:
    ky, kx = ky * pitch, kx * pitch
    highest = max(float(np.abs(ky).max(initial=0.0)), float(np.abs(kx).max(initial=0.0)))
    limit = LIMIT_STEP * float(np.ceil(min(highest, CUTOFF) / LIMIT_STEP))
    upright = pa % 90.0 == 0.0
    if upright:
        # the lattice itself is a mesh
        density, cell = np.rot90(image.weights, -round(pa / 90.0)), 1.0
    else:
        density, cell = _density(image, pa % 360.0, limit)
    y, x = ((np.arange(n) - 0.5 * (n - 1)) * cell for n in density.shape)
    low_y, low_x = np.abs(ky) <= CUTOFF, np.abs(kx) <= CUTOFF
    by_row = np.exp(-2j * np.pi * np.outer(ky[low_y], y))
    by_column = np.exp(-2j * np.pi * np.outer(x, kx[low_x]))
    transform = np.zeros((ky.size, kx.size), dtype=np.complex128)
    transform[np.ix_(low_y, low_x)] = (by_row @ density) @ by_column
    if upright:
        transform *= np.exp(-2 * (np.pi * ky) ** 2)[:, None]
        transform *= np.exp(-2 * (np.pi * kx) ** 2)
    return transform


def inverse_noise_area(optics: Optics, one: SourceArrays) -> float:
    """Integral of the squared modulus of the transform of an image as the detector sees it.

    Where the OTF is radial, of the image upright: only the square of the pixel knows its angle.
    """
    image, pitch = image_of(one)
    return _inverse_noise_area(optics, image, pitch, 0.0 if optics.radial else float(one.pa[0]))


@lru_cache(maxsize=256)
def _inverse_noise_area(optics: Optics, image: SourceImage, pitch: float, pa: float) -> float:
    # the trapezoid rule is exact for light that ends within the period, here in samples
    period = int(
        fft.next_fast_len(int(2 * image.half_diagonal + 2 * PSF_REACH / pitch) + 1, real=True)
    )
    modes = int(min(optics.band_limit(1e-5) * pitch, CUTOFF) * period)
    y, x = np.arange(-modes, modes + 1), np.arange(modes + 1)
    ky, kx = y / (period * pitch), x / (period * pitch)
    if pa == 0 and period <= LARGEST_PERIOD:
        power = np.abs(fft.fft2(image.weights, (period, period), workers=-1))[y % period]
        power = power[:, x % period]
        power *= np.exp(-2 * (np.pi * y / period) ** 2)[:, None]
        power *= np.exp(-2 * (np.pi * x / period) ** 2)
    else:
        power = np.abs(_transform(image, pitch, pa, ky, kx))
    power *= np.abs(optics.transfer(ky, kx))
    power **= 2
    power[:, 1:] *= 2
    return float(power.sum() / (period * pitch) ** 2)


@lru_cache(maxsize=8)
def _density(image: SourceImage, pa: float, limit: float) -> tuple[Array, float]:
    """Turn an image and paint it on a mesh centred on it; return light per cell, and the cell.

    Lengths are in samples.
    """
    cell = 1 / (limit + CUTOFF)
    x, y = _positions(image, pa)
    weight = image.weights
    bright = np.abs(weight) > FAINTEST * float(np.abs(weight).max())
    x, y, weight = x[bright], y[bright], weight[bright]
    width = np.ones_like(weight)
    gaussians = ellipse(x, y, weight, width, width, np.zeros_like(width))
    half = [int(np.ceil((np.abs(p).max() + CUT) / cell)) + 8 for p in (y, x)]
    mesh = np.zeros((2 * half[0] + 1, 2 * half[1] + 1))
    compiled = scene_painter(gaussians, np.full_like(weight, 0.5 * CUT**2))
    paint(mesh, (-half[0] * cell, -half[1] * cell), cell, gaussians, 0.0, CUT, compiled)
    mesh *= cell**2
    return mesh, cell

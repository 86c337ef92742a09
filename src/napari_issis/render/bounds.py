"""Upper bounds of the light that a source sends into a pixel, to leave out what is not seen."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from ..psf import RadialPSF
from ..sources import SourceArrays
from .hankel import hankel_nodes
from .images import image_excess, image_reach
from .optics import Optics
from .profiles import sersic_value

Array = NDArray[np.float64]

# radii in pixels at which a PSF is looked at; beyond, no PSF falls more slowly than r^-2
RADII = np.concatenate([np.arange(0.0, 8.0, 0.5), np.geomspace(8.0, 400.0, 100)])


def brightest_pixels(
    optics: Optics, shape: tuple[int, int], sources: SourceArrays, rate: Array
) -> Array:
    """Upper bound of the brightest pixel that each source makes in a frame, shape (n,).

    Half of a source's distance from the frame is given to its own outskirts, the other half to
    the PSF's wings.
    """
    is_point = sources.kind == "point"
    distance = np.where(is_point, 1.0, 0.5) * np.hypot(*outside(shape, sources))
    # an image ends somewhere, and half of the way from there is the PSF's too
    ended = np.maximum(distance - 0.5 * image_reach(sources), 0.0)
    bound = rate * image_excess(sources) * psf_beyond(optics, ended)
    ratio = 1 - sources.ellipticity
    for n in np.unique(sources.index[np.isfinite(sources.index)]):
        chosen = sources.index == n
        r = distance[chosen] / sources.r_half[chosen]
        area = sources.r_half[chosen] ** 2 * ratio[chosen]
        outskirts = rate[chosen] * sersic_value(r, float(n)) / area
        bound[chosen] += np.where(distance[chosen] > 0, outskirts, 0.0)
    disc = (sources.kind == "uniform") & (distance > 0)
    reached = disc & (distance <= np.sqrt(2) * sources.r_half)
    bound[reached] += rate[reached] / (2 * np.pi * sources.r_half[reached] ** 2 * ratio[reached])
    return bound


def outside(shape: tuple[int, int], sources: SourceArrays) -> tuple[Array, Array]:
    """Distances (y, x) in pixels from the frame's outermost pixels to the sources outside."""
    ny, nx = shape
    y = np.maximum(np.maximum(-sources.y, sources.y - (ny - 1)), 0.0)
    x = np.maximum(np.maximum(-sources.x, sources.x - (nx - 1)), 0.0)
    return y, x


def psf_beyond(optics: Optics, distance: Array) -> Array:
    """Brightest pixel of a point source of unit rate beyond distances in pixels."""
    if not isinstance(optics.psf, RadialPSF):
        return np.full(distance.shape, 1 / optics.point_area)
    envelope = psf_envelope(optics)
    # the envelope at the radius before is higher
    index = np.searchsorted(RADII, distance, side="right") - 1
    far: Array = np.maximum(distance / RADII[-1], 1.0) ** -2
    bound: Array = envelope[index] * far
    return bound


@lru_cache(maxsize=16)
def psf_envelope(optics: Optics) -> Array:
    """Largest brightness per pixel of a point source of unit rate beyond each of the RADII."""
    psf = optics.psf
    assert isinstance(psf, RadialPSF)
    k, measure = hankel_nodes(optics.band_limit(1e-12), RADII[-1])
    # the pixel as it acts along its own axis, averaged least
    measure *= psf.otf(k / optics.pixel_scale) / np.sqrt(1 + (np.pi * k) ** 2)
    brightness = special.j0(2 * np.pi * np.outer(RADII, k)) @ measure
    return np.maximum.accumulate(np.abs(brightness)[::-1])[::-1]


def unseen(bound: Array, allowed: float) -> NDArray[np.bool_]:
    """Which sources may be left out: the faintest, as long as they add up to ``allowed``."""
    order = np.argsort(bound)
    left_out = np.zeros(bound.shape, dtype=bool)
    left_out[order] = np.cumsum(bound[order]) <= allowed
    return left_out

"""Counts and signal-to-noise ratio of each source alone on the sky."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .exposure import dead_share
from .observation import Observation
from .render.images import inverse_noise_area
from .render.optics import Optics
from .render.profiles import disc_transform, sersic_transform
from .source_rates import sources_and_rates
from .sources import IMAGE, SourceArrays

Array = NDArray[np.float64]

FREQUENCIES = 512
ANGLES = 24


def expected_counts(sources: Table, observation: Observation) -> Array:
    """Return the counts that each source sends to the detector in all, shape (n,)."""
    _, rate = sources_and_rates(sources, observation)
    return rate * observation.exposure


def signal_to_noise(sources: Table, observation: Observation) -> Array:
    """Return the signal-to-noise ratio of each source, as if it were alone on the sky.

    Parameters
    ----------
    sources : astropy.table.Table
        The source table.
    observation : Observation
        The instrument set-up.

    Returns
    -------
    ndarray, shape (n,)
        N / sqrt(N + A B), with N the source's counts, B the sky's counts per pixel and A the
        source's noise-equivalent area; lowered by the dead time of the detector, if it has one.
        Neighbours are not counted, and of a source near the frame's edge all light is.

    Notes
    -----
    King (1983, PASP 95, 163): a fit of the source's known shape in front of a sky gets as much
    noise from the sky as A = 1 / sum(p^2) of its pixels hold, p being the share of its light
    in each. A dead time tau multiplies the variance V = N + A B by 1 + V tau / (A T), to first
    order: V / (A T) is the rate of a pixel where the source tells most.
    """
    arrays, rate = sources_and_rates(sources, observation)
    counts = rate * observation.exposure
    optics = Optics(observation.effective_psf, observation.pixel_scale)
    area = noise_areas(optics, arrays)
    sky = observation.background_rate * observation.exposure
    variance = counts + area * sky
    noise = np.sqrt(variance * (1 + variance / area * dead_share(observation)))
    return np.divide(counts, noise, out=np.zeros_like(counts), where=noise > 0)


def noise_areas(optics: Optics, sources: SourceArrays) -> Array:
    """Noise-equivalent area of each source on the detector in pixels, shape (n,).

    By Parseval's theorem 1 / A is the integral of the squared modulus of the transform of the
    image, here of profile, PSF and pixel; the profile's is averaged over directions.
    """
    k, weight = _weights(optics)
    inverse = np.full(len(sources), float(weight.sum()))
    angle = (np.arange(ANGLES) + 0.5) * (np.pi / ANGLES)
    extended = np.flatnonzero(sources.kind != "point")
    for i in extended:
        if sources.kind[i] == IMAGE:
            inverse[i] = inverse_noise_area(optics, sources.take(slice(i, i + 1)))
            continue
        axis_ratio = 1 - sources.ellipticity[i]
        radius = sources.r_half[i] * np.hypot(np.cos(angle), axis_ratio * np.sin(angle))
        q = 2 * np.pi * np.outer(radius, k)
        if sources.kind[i] == "uniform":
            profile = disc_transform(q)
        else:
            profile = sersic_transform(float(sources.index[i]), q)
        inverse[i] = np.mean(profile**2, axis=0) @ weight
    return 1 / inverse


@lru_cache(maxsize=16)
def _weights(optics: Optics) -> tuple[Array, Array]:
    """Frequencies in cycles per pixel, and the squared transfer times what they stand for.

    The transfer is averaged over the two axes of the pixel grid.
    """
    limit = optics.band_limit(1e-5)
    k = limit * np.geomspace(1e-8, 1.0, FREQUENCIES)
    zero: Array = np.zeros(1)
    squared = 0.5 * (
        np.abs(optics.transfer(zero, k)[0]) ** 2 + np.abs(optics.transfer(k, zero)[:, 0]) ** 2
    )
    weight = 2 * np.pi * k**2 * squared * np.log(k[1] / k[0])
    weight[-1] *= 0.5
    return k, weight

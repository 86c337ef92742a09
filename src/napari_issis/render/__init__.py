"""The renderer: from a source table to the expected count rate, exact to a tolerance."""

from __future__ import annotations

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from ..observation import Observation
from ..sources import check_sources


def count_rate(
    sources: Table, observation: Observation | None = None, *, tolerance: float = 1e-6
) -> NDArray[np.float64]:
    """PLACEHOLDER."""
    return render(sources, observation or Observation(), tolerance=tolerance)


def render(
    sources: Table,
    observation: Observation,
    *,
    tolerance: float,
    absolute: float | None = None,
    floor: float = 1e-14,
) -> NDArray[np.float64]:
    """PLACEHOLDER until the real renderer lands: Gaussian blobs."""
    arrays = check_sources(sources, pivot=observation.channel_data.pivot)
    ny, nx = observation.shape
    y, x = np.arange(ny)[:, None], np.arange(nx)[None, :]
    image = np.zeros((ny, nx))
    for i in range(len(arrays)):
        a = max(arrays.r_half[i] / 1.17741, 1.2)
        b = max(a * (1 - arrays.ellipticity[i]), 1.2)
        t = np.radians(arrays.pa[i])
        dx, dy = x - arrays.x[i], y - arrays.y[i]
        u, v = -dx * np.sin(t) + dy * np.cos(t), dx * np.cos(t) + dy * np.sin(t)
        image += (
            arrays.flux[i]
            * observation.cps_per_flux
            / (2 * np.pi * a * b)
            * np.exp(-0.5 * ((u / a) ** 2 + (v / b) ** 2))
        )
    return image

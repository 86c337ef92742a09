"""Which sources make pixels brighter than a detector counts linearly."""

from __future__ import annotations

from math import inf

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .observation import Observation
from .render import peaks
from .render.optics import Optics
from .source_rates import sources_and_rates

# A source is named where it gives at least this share of the light in its central pixel.
SHARE = 0.1


def bright_sources(
    sources: Table, observation: Observation, rate: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Rows of the sources in whose central pixel the local count-rate limit is broken.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation
        The instrument set-up.
    rate : ndarray, shape (ny, nx)
        Count rate of these sources, cps per pixel, filters included.

    Returns
    -------
    ndarray of int64
        Rows of the table (from 0), the brightest central pixel first. A source that merely
        lies on the light of another one is left out: each gives a tenth of the rate there, or
        more, by an estimate of its own highest pixel. Centres outside the frame are not seen.
    """
    limit = (observation.channel_data.local_limit or inf) - observation.background_rate
    if rate.size == 0 or len(sources) == 0 or rate.max() <= limit:
        return np.empty(0, dtype=np.int64)
    arrays, own_rate = sources_and_rates(sources, observation)
    ny, nx = rate.shape
    y, x = np.rint(arrays.y), np.rint(arrays.x)
    inside = (y >= 0) & (y < ny) & (x >= 0) & (x < nx)
    there = np.zeros(len(arrays))
    there[inside] = rate[y[inside].astype(np.int64), x[inside].astype(np.int64)]
    optics = Optics(observation.effective_psf, observation.pixel_scale)
    own = peaks(optics, arrays, own_rate)
    rows = np.flatnonzero((there > limit) & (own >= SHARE * there))
    return rows[np.argsort(-there[rows], kind="stable")].astype(np.int64)

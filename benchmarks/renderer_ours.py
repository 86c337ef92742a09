"""napari_issis as one of the renderers compared."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from napari_issis import Observation, count_rate
from napari_issis.render.compiled_painting import painter


def ours(observation: Observation, tolerance: float) -> Callable[[QTable], NDArray[np.float64]]:
    """Make a renderer of one tolerance."""
    return lambda table: count_rate(table, observation, tolerance=tolerance)


def load_compiled() -> float:
    """Load numba and what it has compiled; return the seconds that this takes."""
    painter.cache_clear()
    start = perf_counter()
    painter()
    return perf_counter() - start


def used_compiled() -> bool:
    """Whether an image has been painted by compiled code since."""
    return painter.cache_info().hits > 0

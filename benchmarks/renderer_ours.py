"""napari_issis as one of the renderers compared."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from napari_issis import Observation, count_rate


def ours(observation: Observation, tolerance: float) -> Callable[[QTable], NDArray[np.float64]]:
    """Make a renderer of one tolerance."""
    return lambda table: count_rate(table, observation, tolerance=tolerance)

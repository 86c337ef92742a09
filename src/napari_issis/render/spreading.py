"""Gaussians with which points are spread on a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Gaussians are not cut where they are brighter than this, a natural logarithm
FEWEST_CUT_DIGITS = 3.0


def spread_cut(digits: float | Array) -> Array:
    """Distance in standard deviations at which a spread Gaussian may be cut.

    Dividing by the spreading Gaussian's transform amplifies the cut.
    """
    return np.sqrt(2 * 1.25 * np.asarray(digits))


def spread(digits: float, band: float) -> float:
    """Width in cells of a Gaussian with which points are spread.

    Its aliases, exp(-2 pi^2 sigma^2 ((1 - band)^2 - band^2)), are below exp(-digits).
    """
    return float(np.sqrt(digits / (2 * np.pi**2 * (1 - 2 * band))))

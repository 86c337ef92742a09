"""A smooth function read from a table, some thirty times as fast as `CubicSpline`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]


class Lookup:
    """Cubic spline of a function on equal intervals.

    Parameters
    ----------
    function : callable
        Takes and returns an array.
    low, high : float
        Range tabulated; arguments beyond it are moved to its ends.
    intervals : int
        Number of intervals.
    """

    def __init__(
        self, function: Callable[[Array], Array], low: float, high: float, intervals: int
    ) -> None:
        self.low, self.high = low, high
        self.scale = intervals / (high - low)
        knots = np.linspace(0.0, intervals, intervals + 1)
        spline = CubicSpline(knots, function(low + knots / self.scale))
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

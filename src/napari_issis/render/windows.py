"""Where a small image lies in a large one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Window = tuple[slice, slice]


def overlap(shape: tuple[int, ...], row: int, column: int, size: tuple[int, ...]) -> Window | None:
    """Part of an image of a shape that another covers; None if they do not meet.

    The other has the given size, and its first pixel lies at (row, column).
    """
    top, left = max(row, 0), max(column, 0)
    bottom, right = min(row + size[0], shape[0]), min(column + size[1], shape[1])
    if top >= bottom or left >= right:
        return None
    return (slice(top, bottom), slice(left, right))


def place(image: Array, stamp: Array, row: int, column: int) -> Window | None:
    """Add the part of a stamp that lies in an image, and return where that is."""
    window = overlap(image.shape, row, column, stamp.shape)
    if window is not None:
        y, x = window
        image[window] += stamp[y.start - row : y.stop - row, x.start - column : x.stop - column]
    return window

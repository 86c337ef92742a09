"""Gaussians painted by compiled code, where numba is installed.

Each row of a Gaussian is a product of what all its rows share and a geometric series, so that it
takes two exponential functions in all; only what lies within the ellipse is painted; and Python's
lock is let go, so that other threads paint and transform beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import ceil, exp, floor, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Painter = Callable[..., None]

# points of a row that are painted together, as many as the processor's vectors hold or more
STRIDE = 8


@lru_cache(maxsize=1)
def painter() -> Painter | None:
    """Return `_paint_rows` compiled, or None without numba or a directory to keep the result in.

    Compiling takes seconds the first time, on each machine; then it is loaded from numba's cache.
    """
    try:
        from numba import float32, float64, int64, njit, void

        values = float64[::1]
        signatures = [
            void(real[:, ::1], int64, int64, *(values,) * 8) for real in (float64, float32)
        ]
        compiled: Painter = njit(signatures, nogil=True, cache=True)(_paint_rows)
    except (ImportError, RuntimeError):
        return None
    return compiled


def _paint_rows(
    mesh: Array,
    first: int,
    last: int,
    y: Array,
    x: Array,
    a: Array,
    b: Array,
    c: Array,
    log_height: Array,
    sign: Array,
    depth: Array,
) -> None:
    """Add sign exp(a dy^2 + b dy dx + c dx^2 + log_height) to rows first to last - 1 of a mesh.

    dy and dx are cells from (y, x); what is below exp(-depth) of the centre is left out.
    """
    columns = mesh.shape[1]
    shared = np.empty(columns)
    series = np.empty(columns + STRIDE)
    for i in range(y.size):
        # the exponent is along dy^2 + c (dx - tilt dy)^2
        along = a[i] - b[i] ** 2 / (4 * c[i])
        tilt = -b[i] / (2 * c[i])
        half_y = sqrt(-depth[i] / along)
        half_x = sqrt(-depth[i] / (c[i] - b[i] ** 2 / (4 * a[i])))
        top, bottom = max(first, ceil(y[i] - half_y)), min(last, floor(y[i] + half_y) + 1)
        left = max(0, floor(x[i] - half_x))
        right = min(columns, ceil(x[i] + half_x) + STRIDE)
        if top >= bottom:
            continue
        for k in range(left, right):
            shared[k] = sign[i] * exp(c[i] * (k - x[i]) ** 2)
        for row in range(top, bottom):
            dy = row - y[i]
            reach = sqrt(max((depth[i] + along * dy**2) / -c[i], 0.0))
            begin = max(left, ceil(x[i] + tilt * dy - reach))
            count = floor(x[i] + tilt * dy + reach) - begin + 1
            # whole strides are quicker than what would be left over
            count = min(STRIDE * ((count + STRIDE - 1) // STRIDE), right - begin)
            ratio = exp(b[i] * dy)
            value = exp(log_height[i] + a[i] * dy**2 + b[i] * dy * (begin - x[i]))
            for k in range(STRIDE):
                series[k] = value
                value *= ratio
            power = ratio**STRIDE
            for k in range(STRIDE, count):
                series[k] = series[k - STRIDE] * power
            line, common = mesh[row, begin : begin + count], shared[begin : begin + count]
            for k in range(count):
                line[k] += common[k] * series[k]

"""Kernels that may wrap around where nobody looks.

A pixel sees a source through the kernel at their distance along y and along x. Where neither
exceeds D, a mesh of a period P needs the kernel right for distances up to D only; between D and
P - D it may be anything. So the kernel is faded out about P / 2 along either axis, and a period
of little more than 2 D suffices, though its rings reach much further.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from .plan import Plan
from .rings import Band, cut_filter, cut_transfer, wrap_fading
from .threads import blocks, for_each

Array = NDArray[np.float64]

# lines transformed at a time
LINES = 32
# argument of the error function where a window has ended
END = 5.0


def wrapped_transfer(plan: Plan, band: Band, period_y: int, period_x: int, limit: float) -> Array:
    """Transfer function of a band for a mesh around which the kernel wraps, without the pixel.

    Parameters
    ----------
    plan : Plan
        Filters and ranges; it cuts the band's rings.
    band : Band
        Share of the frequencies.
    period_y, period_x : int
        Pixels.
    limit : float
        Highest frequency, cycles per pixel.

    Returns
    -------
    ndarray
        At the multiples of 1 / period up to the limit.
    """
    y, x = (_Line(plan, plan.ring_end(band.level), p, limit) for p in (period_y, period_x))
    cut_filter(plan, band)  # once, not in every thread
    between = np.empty((x.fine.size, y.count))

    def wrap_y(part: slice) -> None:
        between[part] = y.wrap(cut_transfer(plan, band, x.fine[part], y.fine, limit))

    for_each(wrap_y, blocks(x.fine.size, LINES))
    result = np.empty((y.count, x.count))

    def wrap_x(part: slice) -> None:
        result[part] = x.wrap(between[:, part].T)

    for_each(wrap_x, blocks(y.count, LINES))
    return result


class _Line:
    """One axis: from a kernel on a line where nothing wraps around to one that does.

    Kernel and transfer function are even, and tied by cosine transforms. ``fine`` are the
    frequencies at which the latter is wanted, ``count`` the number of those that `wrap` returns.
    """

    def __init__(self, plan: Plan, end: float, period: int, limit: float) -> None:
        width = wrap_fading(plan.optics)
        self.count = int(limit * period) + 1
        # the kernel is sampled at so many points in half a period
        self.half = int(fft.next_fast_len(self.count, real=True))
        ended = 0.5 * period + END * width
        alias_free = ended + max(end, ended)
        size = fft.next_fast_len(int(np.ceil(self.half * alias_free / period)), real=True)
        self.fine = np.arange(size + 1) * (self.half / (size * period))
        x = np.arange(size + 1) * (0.5 * period / self.half)
        self.window = 0.5 * special.erfc((x - 0.5 * period) / width) / (2 * size)

    def wrap(self, transfer: Array) -> Array:
        """Transfer function of the wrapped kernel; the last axis is this one."""
        kernel = fft.dct(transfer, type=1, axis=-1) * self.window
        wrapped = kernel[:, : self.half + 1].copy()
        beyond = kernel[:, self.half : 2 * self.half + 1]
        wrapped[:, self.half + 1 - beyond.shape[1] :] += beyond[:, ::-1]
        back: Array = fft.dct(wrapped, type=1, axis=-1)[:, : self.count]
        return back

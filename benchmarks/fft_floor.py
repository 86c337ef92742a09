"""Time of the transforms that no convolution can avoid: one pair at the padded frame's size."""

from __future__ import annotations

import statistics
from time import perf_counter

import numpy as np
from scipy import fft


def fft_pair_seconds(side: int, calls: int = 5) -> float:
    """Median time of one rfft2 and one irfft2 of a frame padded to twice its side."""
    frame = np.random.default_rng(1).random((2 * side, 2 * side))
    times = []
    for _ in range(calls + 1):
        start = perf_counter()
        fft.irfft2(fft.rfft2(frame, workers=-1), s=frame.shape, workers=-1)
        times.append(perf_counter() - start)
    return statistics.median(times[1:])

"""Spectra folded to the pixel rate: all aliases of a frequency summed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Spectrum = NDArray[np.complexfloating]


def fold_rows(upper: Spectrum, lower: Spectrum, period: int) -> Spectrum:
    """Sum the aliases along the first axis.

    Parameters
    ----------
    upper, lower : ndarray, shape (m + 1, n) and (m, n)
        Amplitudes at the frequencies 0 ... m and -m ... -1, in units of 1 / period.
    period : int
        Pixels.

    Returns
    -------
    ndarray, shape (period, n)
        In the order of `scipy.fft.fft`.
    """
    out = np.zeros((period, upper.shape[1]), dtype=upper.dtype)
    first = min(period, upper.shape[0])
    out[:first] = upper[:first]
    for start in range(period, upper.shape[0], period):
        part = upper[start : start + period]
        out[: part.shape[0]] += part
    for last in range(lower.shape[0], 0, -period):
        part = lower[max(last - period, 0) : last]
        out[period - part.shape[0] :] += part
    return out


def fold_half(spectrum: Spectrum, period: int) -> Spectrum:
    """Sum the aliases along the rows of a real image.

    Parameters
    ----------
    spectrum : ndarray, shape (ny, m + 1)
        Amplitudes of each row at the frequencies 0 ... m in units of 1 / period; those below
        zero are their conjugates.
    period : int
        Pixels.

    Returns
    -------
    ndarray, shape (ny, period // 2 + 1)
        As `scipy.fft.irfft` wants it.
    """
    modes, middle = spectrum.shape[1] - 1, period // 2
    result = np.zeros((spectrum.shape[0], middle + 1), dtype=spectrum.dtype)
    for first in range(0, modes + 1, period):
        part = spectrum[:, first : first + middle + 1]
        result[:, : part.shape[1]] += part
    # -kx = -j is an alias of (n + 1) period - j
    for n in range(modes // period + 1):
        end = (n + 1) * period
        low, high = max(end - middle, 1), min(end, modes)
        if low <= high:
            result[:, end - high : end - low + 1] += spectrum[:, low : high + 1][:, ::-1].conj()
    return result

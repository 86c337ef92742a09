"""Contrast limits that show a crowded field at first sight."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Share in percent of the brightened pixels that stay below the upper limit.
PERCENTILES = {"linear": 99.0, "sqrt": 99.0, "snr": 99.5, "asinh": 99.8, "log": 99.8}

# Pixels from which a percentile is taken, at least half as many where there are more.
ENOUGH = 300_000


def contrast_limits(
    counts: NDArray[Any], background: float, scale: str = "sqrt"
) -> tuple[float, float]:
    """Limits from the sky, or zero, to a percentile of the pixels that the sources brighten.

    Parameters
    ----------
    counts : ndarray
        Counts per pixel.
    background : float
        Expected sky counts per pixel.
    scale : str
        Brightness scale; a logarithm begins at the sky, at least at half a count.

    Returns
    -------
    (float, float)
        Lower and upper limit; the upper one is at least 1 count above the lower.
    """
    least = background + 5 * np.sqrt(background) + 1
    # a part is enough where it is large; an odd step goes through all columns
    part = counts.ravel()[:: (counts.size // (4 * ENOUGH)) | 1]
    bright = part[part > least]
    if bright.size < ENOUGH // 2 and part.size < counts.size:
        bright = counts[counts > least]
    chosen = bright if bright.size else counts.ravel()
    chosen = chosen[:: 1 + chosen.size // ENOUGH]
    upper = float(np.percentile(chosen, PERCENTILES[scale])) if chosen.size else 1.0
    lower = 0.0
    if scale == "log":
        lower = max(0.5, background)
    elif scale == "snr":
        lower = background
    return lower, max(upper, lower + 1.0)


def symmetric_limits(difference: NDArray[Any]) -> tuple[float, float]:
    """Limits about zero that hold 99 % of a difference."""
    part = difference.ravel()[:: 1 + difference.size // ENOUGH]
    widest = float(np.percentile(np.abs(part), 99.0)) if part.size else 1.0
    return -max(widest, 1.0), max(widest, 1.0)

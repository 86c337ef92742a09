"""Contrast limits that show a crowded field at first sight."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Share of the brightened pixels, in percent, that stay below the upper limit.
PERCENTILE = 99.0


def contrast_limits(counts: NDArray[Any], background: float) -> tuple[float, float]:
    """Limits from zero to a percentile of the pixels that the sources brighten.

    Parameters
    ----------
    counts : ndarray
        Counts per pixel.
    background : float
        Expected sky counts per pixel.

    Returns
    -------
    (float, float)
        Lower and upper limit; the upper one is at least 1 count.
    """
    bright = counts[counts > background + 5 * np.sqrt(background) + 1]
    chosen = bright if bright.size else counts
    upper = float(np.percentile(chosen, PERCENTILE)) if chosen.size else 1.0
    return 0.0, max(upper, 1.0)

"""Brightness scales: how counts become grey levels, without touching the counts.

The image layer always holds counts. A scale is a colormap whose colours are set at uneven
counts, so that read-outs, limits and files stay in counts.
"""

from __future__ import annotations

import numpy as np
from napari.utils.colormaps import Colormap
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SCALES = {
    "linear": "C",
    "log": "log C",
    "sqrt": "√C",
    "asinh": "asinh C",
    "snr": "SNR",
}
# The colours of a colormap are kept in a table with equal steps in the counts to the power of
# gamma. With a small power the table is fine enough for faint pixels of a range of 10^5.
FINE_GAMMA = 0.2
COLORS = 512
# counts below which a logarithm tells nothing
LEAST_COUNT = 0.5


def stretched(
    scale: str, counts: ArrayLike, limits: tuple[float, float], background: float
) -> Array:
    """Return brightnesses from 0 to 1.

    Parameters
    ----------
    scale : str
        One of `SCALES`.
    counts : array_like
        Counts per pixel.
    limits : (float, float)
        Counts that are black and white.
    background : float
        Expected sky counts per pixel.

    Notes
    -----
    SNR is (C - B) / sqrt(C), and 0 for C = 0 (paper, section 2); below the sky it is black.
    The softening of asinh is three times the noise of the sky, at least one count.
    """
    low, high = limits

    def value(c: Array) -> Array:
        level = c
        if scale == "log":
            level = np.log(np.maximum(c, LEAST_COUNT))
        elif scale == "sqrt":
            level = np.sqrt(np.maximum(c, 0.0))
        elif scale == "asinh":
            level = np.arcsinh((c - low) / max(3 * np.sqrt(background), 1.0))
        elif scale == "snr":
            lit = np.maximum(c, max(background, 1e-30))
            level = (lit - background) / np.sqrt(lit)
        return level

    ends = value(np.array([low, high], dtype=np.float64))
    span = float(ends[1] - ends[0])
    if not span > 0:
        return (np.asarray(counts) >= high).astype(np.float64)
    brightness = (value(np.asarray(counts, dtype=np.float64)) - ends[0]) / span
    clipped: Array = np.clip(brightness, 0.0, 1.0)
    return clipped


def counts_at(
    scale: str, brightness: ArrayLike, limits: tuple[float, float], background: float
) -> Array:
    """Return the counts that have brightnesses from 0 to 1: the inverse of `stretched`."""
    low, high = limits
    share = np.concatenate([[0.0], np.geomspace(1e-8, 1.0, 4001)])
    counts = low + (high - low) * share
    level = stretched(scale, counts, limits, background)
    # the last of the black counts, so that what is black ends where it should
    first = max(int(np.searchsorted(level, 0.0, side="right")) - 1, 0)
    return np.interp(np.asarray(brightness, dtype=np.float64), level[first:], counts[first:])


def scaled_colormap(
    base: Colormap, scale: str, limits: tuple[float, float], background: float
) -> tuple[Colormap, float]:
    """Return the colormap and the gamma with which napari draws a scale.

    Parameters
    ----------
    base : napari.utils.Colormap
        The colours.
    scale : str
        One of `SCALES`.
    limits : (float, float)
        Contrast limits, counts.
    background : float
        Expected sky counts per pixel.
    """
    if scale == "linear":
        return base, 1.0
    low, high = limits
    level = np.linspace(0.0, 1.0, COLORS)
    counts = counts_at(scale, level, limits, background)
    place = (np.clip((counts - low) / (high - low), 0.0, 1.0)) ** FINE_GAMMA
    place[-1] = 1.0
    if place[0] > 0:
        place, level = np.concatenate([[0.0], place]), np.concatenate([[0.0], level])
    place, first = np.unique(place, return_index=True)
    colors = base.map(level[first])
    return Colormap(colors, controls=place, name=f"{base.name} ({SCALES[scale]})"), FINE_GAMMA

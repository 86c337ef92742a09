"""Quadrature nodes for the Hankel transform of what has a highest frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def hankel_nodes(limit: float, reach: float) -> tuple[Array, Array]:
    """Frequencies up to ``limit`` and their weights 2 pi k dk, good for radii up to ``reach``.

    Gauss-Legendre on panels of less than two oscillations each.
    """
    x, w = np.polynomial.legendre.leggauss(16)
    panels = int(limit * reach) + 8
    k = ((np.arange(panels)[:, None] + 0.5 * (x + 1)) * (limit / panels)).ravel()
    return k, np.pi * (limit / panels) * np.tile(w, panels) * k

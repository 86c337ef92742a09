"""How far an image is from the reference."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXPOSURE = 100.0


def image_errors(image: Array, reference: Array, sky: float) -> dict[str, float]:
    """Errors over the whole frame.

    ``error`` is the largest over the peak, ``error_inside`` the same without a border of one
    pixel, ``flux_error`` the relative error of the sum, ``poisson_error`` the largest in units
    of the Poisson noise of 100 s, sky included.
    """
    error = np.abs(image - reference)
    peak = float(reference.max())
    noise = np.sqrt((np.maximum(reference, 0) + sky) / EXPOSURE)
    return {
        "error": float(error.max()) / peak,
        "error_inside": float(error[1:-1, 1:-1].max()) / peak,
        "flux_error": float(image.sum() / reference.sum()) - 1,
        "poisson_error": float((error / noise).max()),
    }


def pixel_error(image: Array, pixels: NDArray[np.int64], rates: Array) -> float:
    """Largest error at the (y, x) pixels, cps."""
    return float(np.abs(image[pixels[:, 0], pixels[:, 1]] - rates).max(initial=0.0))

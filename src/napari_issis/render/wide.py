"""Derivatives of the image of a source that reaches over the frame, by differences of renders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..sources import SourceArrays
from . import _render, peaks
from .optics import Optics

Array = NDArray[np.float64]

# of an image's largest possible pixel; steps divide it
TOLERANCE = 1e-9
# pixels; relative to r_half; of the ellipticity that may still be added; degrees
STEPS = {"x": 0.02, "y": 0.02, "r_half": 1e-3, "ellipticity": 1e-3, "pa": 0.05}


def wide_images(optics: Optics, one: SourceArrays, shape: tuple[int, int]) -> Array:
    """Image of an extended source of 1 cps and its derivatives, as `derivatives` has them.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    one : SourceArrays
        The source, of length 1.
    shape : (int, int)
        Frame in pixels.

    Returns
    -------
    ndarray, shape (6, ny, nx)
        On the whole frame.
    """
    rate = np.ones(1)
    peak = peaks(optics, one, rate)

    def image(source: SourceArrays) -> Array:
        return _render(optics, shape, source, rate, TOLERANCE * float(peak[0]), peak)

    scale = {"r_half": float(one.r_half[0]), "ellipticity": 1 - float(one.ellipticity[0])}
    images = [image(one)]
    for name, share in STEPS.items():
        value, step = getattr(one, name), share * scale.get(name, 1.0)
        ahead = image(replace(one, **{name: value + step}))
        images.append((ahead - image(replace(one, **{name: value - step}))) / (2 * step))
    return np.stack(images)

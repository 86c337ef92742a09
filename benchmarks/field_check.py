"""The 2048 x 2048 field against GalSim at its tightest, on a part of the frame."""

from __future__ import annotations

import galsim
import numpy as np
from numpy.typing import NDArray

from napari_issis import TelescopePSF
from renderer_galsim import galsim_psf, profiles
from speed_scenes import FIELD, load_scene

SIDE = 64
CORNER = (992, 992)
# sources whose light in the part is drawn: those within this many pixels of it
REACH = 400.0


def field_check(image: NDArray[np.float64]) -> dict[str, float]:
    """Compare the part's structure: a plane, which the sources left out make, is taken off."""
    table, observation = load_scene(FIELD)
    assert isinstance(observation.psf, TelescopePSF)
    y0, x0 = CORNER
    middle = 0.5 * (SIDE - 1)
    x, y = np.asarray(table["x"]) - x0 - middle, np.asarray(table["y"]) - y0 - middle
    near = np.maximum(np.abs(x), np.abs(y)) < 0.5 * SIDE + REACH
    psf = galsim_psf(observation.psf, "extreme")
    scale = observation.pixel_scale
    shifted = [
        profile.shift(scale * dx, scale * dy)
        for profile, dx, dy in zip(
            profiles(table[near], observation, psf.gsparams), x[near], y[near], strict=True
        )
    ]
    part = galsim.ImageD(SIDE, SIDE)
    galsim.Convolve(galsim.Add(shifted), psf).drawImage(part, scale=scale)
    difference = image[y0 : y0 + SIDE, x0 : x0 + SIDE] - part.array
    v, u = np.mgrid[-1 : 1 : SIDE * 1j, -1 : 1 : SIDE * 1j]
    plane = np.column_stack([np.ones(SIDE * SIDE), u.ravel(), v.ravel()])
    fitted = plane @ np.linalg.lstsq(plane, difference.ravel(), rcond=None)[0]
    peak = float(image.max())
    return {
        "sources": float(near.sum()),
        "error": float(np.abs(difference).max()) / peak,
        "structure": float(np.abs(difference.ravel() - fitted).max()) / peak,
    }

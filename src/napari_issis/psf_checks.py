"""Whether an image will do as a PSF, and if not, what to do about it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The core, whose centroid is the PSF's place: samples above this share of the highest.
CORE = 0.2
# Offset of that place from the middle of the array, samples.
LARGEST_OFFSET = 0.25
# Mean of the border's samples over the highest: more is a background, or a PSF cut off.
BRIGHTEST_BORDER = 0.01
# Light in negative samples over that in all: more is not noise.
MOST_NEGATIVE = 0.05
# |OTF| at the Nyquist frequency, as of a Gaussian with a FWHM of 1.6 samples.
HIGHEST_AT_NYQUIST = 0.1


def check_psf_image(array: Array) -> None:
    """Raise a ValueError if an image is not fit to be a PSF; the message says the remedy.

    Parameters
    ----------
    array : ndarray, shape (ny, nx)
        Finite samples with a positive sum.

    Notes
    -----
    What is looked at: the light is centred in the array to a quarter of a sample, dark at the
    border (1 % of the highest sample) and not negative (5 % of the light), and the OTF is
    small at the Nyquist frequency of the sampling (0.1, along the axes).
    """
    y, x = (float(c) for c in _core_centroid(array))
    ny, nx = array.shape
    for axis, at, n, low, high in (
        ("x", x, nx, "left", "right"),
        ("y", y, ny, "bottom", "top"),
    ):
        offset = at - 0.5 * (n - 1)
        if abs(offset) > LARGEST_OFFSET:
            side, lines = (low if offset > 0 else high), max(round(2 * abs(offset)), 1)
            raise ValueError(
                f"the PSF is not centred: its core lies at {axis} = {at:.2f}, the middle of the "
                f"image at {0.5 * (n - 1):g}, which would shift all sources; cut {lines} "
                f"{'columns' if axis == 'x' else 'rows'} off its {side} side."
            )
    negative = float(-array[array < 0].sum() / array.sum())
    if negative > MOST_NEGATIVE:
        raise ValueError(
            f"the PSF's negative samples hold {100 * negative:.1f} % of its light; subtract less "
            "background, or set noise far from the core to 0."
        )
    border = np.concatenate([array[0], array[-1], array[1:-1, 0], array[1:-1, -1]])
    level = float(np.abs(border.mean()) / array.max())
    if level > BRIGHTEST_BORDER:
        raise ValueError(
            f"the PSF is not dark at its border, {100 * level:.1f} % of its highest sample; "
            "subtract the background, or take a larger image of it."
        )
    edge = _at_nyquist(array)
    if edge > HIGHEST_AT_NYQUIST:
        raise ValueError(
            f"the PSF is undersampled: its OTF is {edge:.2f} at the Nyquist frequency of its "
            f"samples, above {HIGHEST_AT_NYQUIST:g}; compute it with two to four times finer "
            "samples."
        )


def _core_centroid(array: Array) -> tuple[Array, Array]:
    core = np.where(array > CORE * array.max(), array, 0.0)
    core /= core.sum()
    rows, columns = np.arange(array.shape[0]), np.arange(array.shape[1])
    return core.sum(axis=1) @ rows, core.sum(axis=0) @ columns


def _at_nyquist(array: Array) -> float:
    """Modulus of the OTF at half a cycle per sample, the larger of those along the axes."""
    moduli = []
    for line in (array.sum(axis=0), array.sum(axis=1)):
        signs = np.where(np.arange(line.size) % 2, -1.0, 1.0)
        moduli.append(abs(float(line @ signs)) / abs(float(line.sum())))
    return max(moduli)

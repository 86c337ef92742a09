"""One source on a window of its own, which can be moved at the cost of one small transform.

The image of a source is a Fourier series whose period is as large as its light is felt. Where
the source is moved, only the phases change.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..psf import RadialPSF
from ..sources import SourceArrays
from .bounds import RADII, psf_envelope
from .direct import has_sharp_edge
from .discs import disc_half_sizes
from .folding import fold_half, fold_rows
from .optics import Optics
from .profiles import disc_envelope, sersic_transform, sersic_value
from .stamps import transform

Array = NDArray[np.float64]

# terms of a Fourier series above which a window is too large to be worth it
MOST_MODES = 4_000_000
# share of the light allowed to be missing that each of three omissions may take: beyond the
# window, above the highest frequency, and wrapped around
SHARE = 0.4


class MovingSource:
    """The image of one source on a window that follows it.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    one : SourceArrays
        The source, of length 1; its position does not matter.
    rate : float
        Its count rate.
    allowed : float
        Light below this, cps per pixel, may be left out.
    """

    def __init__(self, optics: Optics, one: SourceArrays, rate: float, allowed: float) -> None:
        share = SHARE * allowed
        limit = _needed_limit(optics, one, rate, share)
        self.half = _half_sizes(optics, one, rate, share)
        self.period = tuple(int(fft.next_fast_len(2 * h + 1, real=True)) for h in self.half)
        my, mx = (int(limit * period) for period in self.period)
        self.ky = np.concatenate([np.arange(my + 1), np.arange(-my, 0)]) / self.period[0]
        self.kx = np.arange(mx + 1) / self.period[1]
        spectrum = optics.transfer(self.ky, self.kx) * rate
        if one.kind[0] != "point":
            spectrum *= transform(one, self.ky, self.kx)
        self.spectrum = spectrum

    def place(self, y: float, x: float) -> tuple[int, int, Array]:
        """Image of the source at (y, x), and the row and column of its first pixel."""
        row, column = round(y) - self.half[0], round(x) - self.half[1]
        turned = self.spectrum * np.exp(-2j * np.pi * self.ky * (y - row))[:, None]
        turned *= np.exp(-2j * np.pi * self.kx * (x - column))
        upper = self.ky.size // 2 + 1
        folded = np.empty((self.period[0], self.kx.size), dtype=np.complex128)
        fold_rows(turned[:upper], turned[upper:], self.period[0], folded)
        image = fft.irfft2(fold_half(folded, self.period[1]), self.period)
        return row, column, image[: 2 * self.half[0] + 1, : 2 * self.half[1] + 1]


def can_move(
    optics: Optics, one: SourceArrays, rate: float, allowed: float, shape: tuple[int, int]
) -> bool:
    """Whether a `MovingSource` serves: its window is no larger than twice the frame."""
    if has_sharp_edge(optics, allowed / rate, optics.extent + 50.0, 1.0):
        return False
    half = _half_sizes(optics, one, rate, SHARE * allowed)
    limit = _needed_limit(optics, one, rate, SHARE * allowed)
    modes = 8 * half[0] * half[1] * limit**2
    return modes <= MOST_MODES and half[0] <= shape[0] and half[1] <= shape[1]


def _half_sizes(optics: Optics, one: SourceArrays, rate: float, share: float) -> tuple[int, int]:
    """Half-sizes (y, x) of a window, outside of which the light is below ``share``.

    Light arrives there from the source's outskirts and, by the PSF's wings, from its inner
    part. Either falls steeply, so that the distances where they fade add like squares.
    """
    wing = _wing(optics, share / rate)
    if one.kind[0] == "point":
        return int(wing) + 2, int(wing) + 2
    if one.kind[0] == "uniform":
        half_y, half_x = disc_half_sizes(one)
        return int(half_y[0] + wing) + 2, int(half_x[0] + wing) + 2
    n, ratio = float(one.index[0]), 1 - float(one.ellipticity[0])
    r_half, pa = float(one.r_half[0]), float(np.radians(one.pa[0]))
    r = np.geomspace(1e-3, 1e4, 1200)
    bright = sersic_value(r, n) * rate / (r_half**2 * ratio) > share
    major = r_half * float(r[bright].max(initial=0.0))
    half_y = np.hypot(major * np.cos(pa), ratio * major * np.sin(pa))
    half_x = np.hypot(major * np.sin(pa), ratio * major * np.cos(pa))
    return int(np.hypot(half_y, wing)) + 2, int(np.hypot(half_x, wing)) + 2


def _wing(optics: Optics, level: float) -> float:
    """Distance in pixels beyond which a point source of unit rate stays below a level."""
    if not isinstance(optics.psf, RadialPSF):
        return optics.extent + 50.0
    envelope = psf_envelope(optics)
    above = np.flatnonzero(envelope > level)
    if not above.size:
        return 0.0
    if above[-1] + 1 < RADII.size:
        return float(RADII[above[-1] + 1])
    return float(RADII[-1] * np.sqrt(envelope[-1] / level))


def _needed_limit(optics: Optics, one: SourceArrays, rate: float, share: float) -> float:
    """Frequency beyond which a source's spectrum adds up to less than ``share``."""
    limit = optics.band_limit(1e-3 * min(share * optics.point_area / rate, 1.0))
    k: Array = (np.arange(240.0) + 0.5) * (limit / 240)
    zero: Array = np.zeros(1)
    amplitude = np.maximum(
        np.abs(optics.transfer(zero, k)[0]), np.abs(optics.transfer(k, zero)[:, 0])
    )
    if one.kind[0] != "point":
        angle = (np.arange(24) + 0.5) * (np.pi / 24) + float(np.radians(one.pa[0]))
        ratio = 1 - float(one.ellipticity[0])
        q = (
            2
            * np.pi
            * float(one.r_half[0])
            * np.outer(k, np.hypot(np.cos(angle), ratio * np.sin(angle)))
        )
        profile = (
            disc_envelope(q)
            if one.kind[0] == "uniform"
            else sersic_transform(float(one.index[0]), q)
        )
        amplitude = amplitude * profile.mean(axis=1)
    tail = np.cumsum((2 * np.pi * k * amplitude)[::-1])[::-1] * (limit / 240) * abs(rate)
    needed = np.flatnonzero(tail > share)
    return float(k[needed[-1]] + limit / 240) if needed.size else 0.0

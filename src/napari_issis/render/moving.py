"""One source on a window of its own, which can be moved at the cost of one small transform.

The image of a source is a Fourier series whose period is as large as its light is felt. Where
the source is moved, only the phases change.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from ..psf import RadialPSF
from ..sources import IMAGE, SourceArrays
from .bounds import RADII, psf_envelope
from .direct import has_sharp_edge
from .discs import disc_half_sizes
from .folding import fold_half, fold_rows
from .images import image_gaussians
from .optics import Optics, Transfer
from .profiles import sersic_value
from .stamps import needed_limit, on_axes, transform
from .windows import Window, overlap, place

Array = NDArray[np.float64]

# terms of a Fourier series above which a window is too large to be worth it
MOST_MODES = 4_000_000
# share of the light allowed to be missing that each of three omissions may take: beyond the
# window, above the highest frequency, and wrapped around
SHARE = 0.4
# Windows and highest frequencies grow in steps of this ratio, so that a source that is resized or
# turned finds the transfer function of a moment ago.
STEP = 1.07
# transfer functions of no more values than this are kept
MOST_KEPT = 250_000


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
    half : (int, int)
        Half-sizes (y, x) of the window in pixels.
    limit : float
        Highest frequency, cycles per pixel.
    """

    def __init__(
        self,
        optics: Optics,
        one: SourceArrays,
        rate: float,
        half: tuple[int, int],
        limit: float,
    ) -> None:
        self.half = half
        y, x = (int(fft.next_fast_len(2 * h + 1, real=True)) for h in half)
        self.period = y, x
        my, mx = (int(limit * period) for period in self.period)
        self.ky = np.concatenate([np.arange(my + 1), np.arange(-my, 0)]) / self.period[0]
        self.kx = np.arange(mx + 1) / self.period[1]
        make = _transfer if self.ky.size * self.kx.size <= MOST_KEPT else _transfer.__wrapped__
        spectrum = make(optics, my, mx, self.period) * rate
        if one.kind[0] != "point":
            spectrum = spectrum * transform(one, self.ky, self.kx)
        self.spectrum = spectrum

    def add(self, image: Array, y: float, x: float) -> Window | None:
        """Add the source at (y, x) to an image, and return the window in which it lies."""
        row, column = round(y) - self.half[0], round(x) - self.half[1]
        ny, nx = 2 * self.half[0] + 1, 2 * self.half[1] + 1
        if overlap(image.shape, row, column, (ny, nx)) is None:
            return None
        turned = self.spectrum * np.exp(-2j * np.pi * self.ky * (y - row))[:, None]
        turned *= np.exp(-2j * np.pi * self.kx * (x - column))
        upper = self.ky.size // 2 + 1
        columns = fft.ifft(fold_rows(turned[:upper], turned[upper:], self.period[0]), axis=0)[:ny]
        own = fft.irfft(fold_half(columns, self.period[1]), self.period[1], axis=1)[:, :nx]
        return place(image, own, row, column)


@lru_cache(maxsize=32)
def _transfer(optics: Optics, my: int, mx: int, period: tuple[int, int]) -> Transfer:
    """Transfer function at frequencies 0 to my, -my to -1, and 0 to mx, over the periods."""
    kx = np.arange(mx + 1) / period[1]
    upper = np.arange(my + 1) / period[0]
    if not optics.radial:
        return optics.transfer(np.concatenate([upper, -upper[:0:-1]]), kx)
    quadrant = optics.transfer(upper, kx)
    return np.concatenate([quadrant, quadrant[:0:-1]])


def moving_source(
    optics: Optics, one: SourceArrays, rate: float, allowed: float, shape: tuple[int, int]
) -> MovingSource | None:
    """Make a `MovingSource`, unless its window would be larger than twice the frame.

    Parameters
    ----------
    optics : Optics
        The transfer function.
    one : SourceArrays
        The source, of length 1.
    rate : float
        Its count rate.
    allowed : float
        Light below this, cps per pixel, may be left out.
    shape : (int, int)
        Frame in pixels.
    """
    if has_sharp_edge(optics, allowed / rate, optics.extent + 50.0, 1.0):
        return None
    share = SHARE * allowed
    half = half_sizes(optics, one, rate, share)
    limit = highest_frequency(optics, one, rate, share)
    modes = 8 * half[0] * half[1] * limit**2
    if modes > MOST_MODES or half[0] > shape[0] or half[1] > shape[1]:
        return None
    half = int(_step_up(half[0])), int(_step_up(half[1]))
    return MovingSource(optics, one, rate, half, _step_up(limit))


def _step_up(value: float) -> float:
    """Next power of `STEP`; zero stays zero."""
    return float(STEP ** np.ceil(np.log(value) / np.log(STEP))) if value > 0 else 0.0


def half_sizes(optics: Optics, one: SourceArrays, rate: float, share: float) -> tuple[int, int]:
    """Half-sizes (y, x) of a window, outside of which the light is below ``share``.

    Light arrives there from the source's outskirts and, by the PSF's wings, from its inner
    part. Either falls steeply, so that the distances where they fade add like squares.
    """
    wing = point_reach(optics, share / rate)
    if one.kind[0] == "point":
        return int(wing) + 2, int(wing) + 2
    half_y, half_x = profile_half_sizes(one, share / rate)
    if one.kind[0] in ("uniform", IMAGE):
        return int(half_y + wing) + 2, int(half_x + wing) + 2
    return int(np.hypot(half_y, wing)) + 2, int(np.hypot(half_x, wing)) + 2


def profile_half_sizes(one: SourceArrays, level: float) -> tuple[float, float]:
    """Half-sizes (y, x) of the box around a profile of unit rate where it is above a level."""
    if one.kind[0] == "uniform":
        disc_y, disc_x = disc_half_sizes(one)
        return float(disc_y[0]), float(disc_x[0])
    if one.kind[0] == IMAGE:
        lit = image_gaussians(one, np.ones(1), level)
        faded = 5 * lit.major.max(initial=0.0)
        far_y = np.abs(lit.y - one.y).max(initial=0.0)
        far_x = np.abs(lit.x - one.x).max(initial=0.0)
        return float(far_y + faded), float(far_x + faded)
    n, ratio = float(one.index[0]), 1 - float(one.ellipticity[0])
    r_half, pa = float(one.r_half[0]), float(np.radians(one.pa[0]))
    r = np.geomspace(1e-3, 1e4, 1200)
    bright = sersic_value(r, n) / (r_half**2 * ratio) > level
    major = r_half * float(r[bright].max(initial=0.0))
    half_y = np.hypot(major * np.cos(pa), ratio * major * np.sin(pa))
    half_x = np.hypot(major * np.sin(pa), ratio * major * np.cos(pa))
    return float(half_y), float(half_x)


def point_reach(optics: Optics, level: float) -> float:
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


def highest_frequency(optics: Optics, one: SourceArrays, rate: float, share: float) -> float:
    """Frequency beyond which a source's spectrum adds up to less than ``share``."""
    limit = optics.band_limit(1e-3 * min(share * optics.point_area / rate, 1.0))
    k: Array = (np.arange(240.0) + 0.5) * (limit / 240)
    return needed_limit(k, on_axes(optics, k), one, rate, share)

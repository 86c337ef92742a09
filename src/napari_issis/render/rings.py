"""The rings that the edges of an aperture make around a point, and where they may end.

The OTF of an obscured aperture is not smooth at the cut-off nor where the obscuration's shadow
leaves the aperture. Each edge makes rings that fall like r^-3 only. Where they are not followed
until they have faded, the kernel is cut smoothly behind the largest distance between a source
and a pixel, where nobody looks.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import fft, special

from ..psf import RadialPSF
from .hankel import hankel_nodes
from .lookup import Lookup
from .optics import Optics, Transfer
from .threads import blocks

if TYPE_CHECKING:
    from .plan import Plan

Array = NDArray[np.float64]

# the cosine transform of a filter is tabulated over so many times the distance of the cut: what
# rings beyond that leave behind is smaller than those at the cut by the 2.5th power of it
TABLE = 256
# one in so many of its values is kept
KEPT = 8


def first_edge(optics: Optics) -> float:
    """Lowest frequency, cycles per pixel, at which the OTF has an edge; inf if there is none."""
    psf = optics.psf
    return psf.first_edge() * optics.pixel_scale if isinstance(psf, RadialPSF) else np.inf


@dataclass(frozen=True)
class Band:
    """Share G_first - G_last of the frequencies that a level's kernel carries.

    ``first`` -1 stands for all frequencies, ``last`` None for nothing left to coarser levels;
    ``level`` is the mesh's, -1 for the finest.
    """

    level: int
    first: int
    last: int | None

    def share(self, plan: Plan, k: Array) -> Array:
        """Share at frequencies k in cycles per pixel."""
        share = np.ones_like(k) if self.first < 0 else plan.lowpass(k, self.first)
        return share if self.last is None else share - plan.lowpass(k, self.last)


def band_transfer(plan: Plan, band: Band, ky: Array, kx: Array, limit: float) -> Transfer:
    """Transfer function of a band on the grid (ky, kx), its rings cut if the plan says so.

    ``limit`` is the highest frequency wanted, cycles per pixel.
    """
    if plan.cuts_rings(band.level):
        return cut_transfer(plan, band, ky, kx, limit) * plan.optics.pixel(ky, kx)
    k = np.hypot(ky[:, None], kx)
    transfer: Transfer = plan.optics.transfer(ky, kx, limit) * band.share(plan, k)
    transfer[k > limit] = 0.0
    return transfer


def cut_transfer(plan: Plan, band: Band, ky: Array, kx: Array, limit: float) -> Array:
    """`band_transfer` with the rings cut and without the pixel."""
    k = np.hypot(ky[:, None], kx)
    transfer = np.zeros_like(k)
    table = cut_filter(plan, band)
    passed = k <= min(limit, table.high)
    transfer[passed] = table(k[passed])
    return transfer


@lru_cache(maxsize=32)
def cut_filter(plan: Plan, band: Band) -> Lookup:
    """Radial filter of a band, its rings cut, as a function of frequency.

    A radial kernel ends at a radius where its projection on a line ends (Abel's transform), and
    the filter is the cosine transform of that projection. The rings oscillate, so that a smooth
    end of the projection changes the kernel inside by nothing that matters.
    """
    psf = plan.optics.psf
    assert isinstance(psf, RadialPSF)
    end, width = plan.ring_end(band.level), plan.ring_width
    step = 0.5 / (TABLE * end)
    least = int(np.ceil(1.05 * plan.highest / (KEPT * step))) + 1
    k = np.arange(KEPT * int(fft.next_fast_len(least, real=True)) + 1, dtype=np.float64)
    k *= step
    x = np.arange(k.size) * 0.5 / k[-1]
    filtered = np.empty_like(k)
    for block in blocks(k.size, 2**14):  # temporary arrays stay small
        filtered[block] = psf.otf(k[block] / plan.optics.pixel_scale)
        filtered[block] *= band.share(plan, k[block])
    projection = fft.dct(filtered, type=1, overwrite_x=True)
    for block in blocks(k.size, 2**14):
        projection[block] *= 0.5 * special.erfc((x[block] - end) / width + plan.ring_fade)
    # a kernel that ends has a smooth filter
    return Lookup(fft.idct(projection, type=1, overwrite_x=True)[::KEPT].copy(), 0.0, float(k[-1]))


def fading(optics: Optics) -> float:
    """Width in pixels of the error function with which a kernel is faded out.

    Its transform is negligible at the lowest edge's frequency.
    """
    return 6.0 / first_edge(optics)


def ring_reach(plan: Plan, level: int, start: float) -> float:
    """Distance at which a kernel's rings are below the accuracy.

    They are measured out to six times ``start``, and beyond that follow their law.
    """
    r, envelope = _envelope(plan.filters, level, start)
    allowed = np.exp(-plan.ring_digits)
    below = np.flatnonzero(envelope <= allowed)
    if below.size:
        return float(r[below[0]])
    return float(r[-1] * (envelope[-16] / allowed) ** (1 / 3))


def ring_fade(plan: Plan, level: int, start: float, begin: float) -> float:
    """Argument of the error function with which a level's fading must begin at a distance.

    At every smaller distance, too, the fading must change less of the kernel than the accuracy
    allows; within ``start`` it may be as high as the peak.
    """
    r, envelope = _envelope_within(plan, level, start, begin)
    # what is lost of rings at a distance r is sqrt(k r) times as high in their centre
    lost = 10 * np.pi * np.sqrt(plan.highest * begin) * envelope
    needed = np.sqrt(np.maximum(np.log(lost) + plan.ring_digits, 0.0))
    return float(np.max(needed - (begin - r) / fading(plan.optics)))


def wrap_fade(plan: Plan, level: int, start: float, begin: float) -> float:
    """Argument of the error function with which a kernel must begin to fade along an axis.

    The window multiplies the kernel itself. At either end of both axes it takes half of
    erfc(argument) away, and what wraps around adds as much.
    """
    r, envelope = _envelope_within(plan, level, start, begin)
    allowed = np.exp(-plan.ring_digits) / (2 * envelope)
    needed = special.erfcinv(np.minimum(allowed, 1.0))
    return float(np.max(needed - (begin - r) / wrap_fading(plan.optics)))


def ring_height(plan: Plan, level: int, start: float) -> float:
    """Natural logarithm of a kernel's rings at a distance, over a point source's peak."""
    return float(np.log(_envelope(plan.filters, level, start)[1][0]))


def end_fade(plan: Plan, level: int, start: float) -> float:
    """Argument of the error function with which a kernel must have been cut.

    What is left of the rings must be below the accuracy, with room for its transform's folds.
    """
    left = np.exp(-plan.ring_digits - ring_height(plan, level, start)) / 10
    return 0.25 * float(np.ceil(4 * max(special.erfcinv(min(2 * left, 1.0)), 1.0)))


def wrap_fading(optics: Optics) -> float:
    """Width in pixels of the error function with which a kernel is faded out along an axis.

    A wider one needs a longer period, a narrower one higher frequencies.
    """
    return 4.0 / first_edge(optics)


def _envelope_within(plan: Plan, level: int, start: float, begin: float) -> tuple[Array, Array]:
    """`_envelope` out to ``begin``; within ``start`` it is as high as the peak."""
    r, envelope = _envelope(plan.filters, level, start)
    if begin > r[-1]:
        r = np.append(r, begin)
        envelope = np.append(envelope, envelope[-16] * (r[-2] / begin) ** 3)
    inside = r <= begin
    return np.append(r[inside], start), np.append(envelope[inside], 1.0)


@lru_cache(maxsize=64)
def _envelope(plan: Plan, level: int, start: float) -> tuple[Array, Array]:
    """Radii in pixels and the largest amplitude of a level's kernel beyond each.

    The amplitude is over a point source's peak; the kernel is the Hankel transform of its
    filter.
    """
    psf = plan.optics.psf
    assert isinstance(psf, RadialPSF)
    r = start * np.geomspace(1.0, 6.0, 160)
    k, measure = hankel_nodes(plan.highest, r[-1])
    measure *= psf.otf(k / plan.optics.pixel_scale)
    # for the peak, the pixel as a Gaussian of the same variance
    peak = abs(np.sum(measure * np.exp(-(np.pi**2) * k**2 / 6)))
    # a ring is averaged least in the direction of the pixel's sides: the envelope of sinc(k)
    measure /= np.sqrt(1 + (np.pi * k) ** 2)
    kernel = (
        special.j0(2 * np.pi * np.outer(r, k))
        @ (measure * Band(level, level, level + 1).share(plan, k))
        / peak
    )
    return r, np.maximum.accumulate(np.abs(kernel)[::-1])[::-1]

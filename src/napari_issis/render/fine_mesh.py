"""The fine mesh, or the two that take its place where rings cross the frame.

A fine mesh as large as the rings ask for would be in double precision and fine enough for the
PSF's core. But the rings are weak: cut out of the kernel they need fewer digits, on a mesh of
their own in single precision, and the rest of the kernel ends soon, on a mesh little larger than
the frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import DTypeLike
from scipy import fft

from .rings import ring_height, wrap_fading
from .spreading import spread, spread_cut

if TYPE_CHECKING:
    from .plan import Plan

# highest frequency used, cycles per cell: the result is only wanted at the pixels
NEAR_BAND = 0.42
# Natural logarithms of the accuracy over the rounding errors of a transform that a mesh may
# reach, in double and in single precision: taking back the spreading amplifies them.
ROUNDING, SINGLE_ROUNDING = 44.0, 24.0
# the period is a multiple of this many pixels
NEAR_UNIT = 8
# Natural logarithm of how much more accurate rings are than asked for
RING_MARGIN = 1.0


@dataclass(frozen=True)
class FineMesh:
    """A fine mesh: its cell, spreading and period.

    Parameters
    ----------
    plan : Plan
        Filters and ranges.
    digits : float
        Natural logarithm of the accuracy of what is painted.
    apart : Plan, optional
        Filters of the kernel that another mesh carries; this one carries the difference to
        that, in single precision.
    """

    plan: Plan
    digits: float
    apart: Plan | None = None

    @property
    def dtype(self) -> DTypeLike:
        """Type of the points."""
        return np.float64 if self.apart is None else np.float32

    @property
    def highest(self) -> float:
        """Frequency in cycles per pixel above which nothing is painted or passes."""
        apart = 0.0 if self.apart is None else self.apart.highest
        return max(self.plan.highest, apart)

    @property
    def cell(self) -> float:
        """Cell in pixels: a multiple of it is a pixel, and FFTs are quick."""
        # at the highest frequency rounding grows by exp(digits band^2 / (1 - 2 band))
        room = (ROUNDING if self.apart is None else SINGLE_ROUNDING) / self.digits - 1
        band = min(NEAR_BAND, np.sqrt(room**2 + room) - room)
        least = int(np.ceil(NEAR_UNIT * self.highest / band))
        return NEAR_UNIT / int(fft.next_fast_len(least, real=True))

    @property
    def spread(self) -> float:
        """Width in pixels of the Gaussian with which points are spread."""
        return self.cell * spread(self.digits, self.cell * self.highest)

    @property
    def cut(self) -> float:
        """`spread_cut` for the mesh's accuracy."""
        return float(spread_cut(self.digits))

    @property
    def filters(self) -> FineMesh:
        """The mesh as far as filters depend on it."""
        apart = None if self.apart is None else self.apart.filters
        return FineMesh(self.plan.filters, self.digits, apart)

    def period(self, axis: int, pixels: int, low: float, high: float) -> float:
        """Least period along an axis of some pixels, painted from low to high."""
        plan = self.plan
        room, least = plan.reach(-1), 0.0
        if plan.wraps:
            room = plan.without_rings(-1)
            least = 2 * (plan.seen[axis] + plan.wrap_fade * wrap_fading(plan.optics))
        return max(high - low, pixels - 1 + room - low, high + room, least) + 1


def fine_meshes(plan: Plan) -> list[FineMesh]:
    """Fine meshes of a plan, whose results add up."""
    if not plan.wraps:
        return [FineMesh(plan, plan.digits)]
    compact = plan.compact
    digits = plan.ring_digits + RING_MARGIN + ring_height(plan, -1, plan.without_rings(-1))
    digits = 0.5 * float(np.ceil(2 * max(digits, 3.0)))
    return [FineMesh(compact, plan.digits), FineMesh(plan, digits, compact)]

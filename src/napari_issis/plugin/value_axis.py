"""The axis of counts of a trace: brightness scale, limits and ticks."""

from __future__ import annotations

from collections.abc import Callable
from math import asinh, ceil, floor, log10, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The logarithmic scale begins at the power of ten below the faintest expected counts, but spans
# no more decades than these: a sky of next to nothing would leave no room for the sources.
DECADES = 5
# Upper limits, times powers of ten: few, so that the axis stands still while the noise changes.
ROUND = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0)

_FUNCTIONS: dict[str, tuple[Callable[[Any], Any], Callable[[float], float]]] = {
    "linear": (np.asarray, float),
    "snr": (np.asarray, float),
    "sqrt": (lambda values: np.sqrt(np.maximum(values, 0.0)), lambda v: sqrt(max(v, 0.0))),
    "log": (np.log10, log10),
    "asinh": (np.arcsinh, asinh),
}


class ValueAxis:
    """Maps counts, or their signal-to-noise ratio, to fractions of the axis.

    Parameters
    ----------
    scale : {"linear", "log", "sqrt", "asinh", "snr"}
        Brightness scale.
    counts, expected : ndarray
        What has to find room on the axis.
    background : float
        Expected counts of the sky.
    """

    def __init__(self, scale: str, counts: Any, expected: Any, background: float) -> None:
        self.scale, self.background = scale, background
        self._stretch, stretch_one = _FUNCTIONS[scale]
        shown = [self._values(np.asarray(part, dtype=np.float64)) for part in (counts, expected)]
        highest = max((float(part.max(initial=0.0)) for part in shown), default=0.0)
        self.high = round_up(max(highest, 1.0))
        self.low = 0.0
        if scale == "log":
            positive = shown[1][shown[1] > 0]
            faintest = float(positive.min()) if positive.size else 1.0
            # A single count stands out from none.
            lowest = floor(log10(min(faintest, 0.5)))
            self.low = 10.0 ** max(lowest, ceil(log10(self.high)) - DECADES)
        elif scale == "snr":
            lowest_snr = min(float(part.min(initial=0.0)) for part in shown)
            self.low = -round_up(-lowest_snr) if lowest_snr < 0 else 0.0
        self._low, self._high = stretch_one(self.low), stretch_one(self.high)

    @property
    def unit(self) -> str:
        """What the ticks count."""
        return "SNR" if self.scale == "snr" else "counts"

    def fractions(self, counts: Any) -> Array:
        """Return where counts lie on the axis: 0 at its lower end, 1 at its upper one."""
        values = np.maximum(self._values(np.asarray(counts, dtype=np.float64)), self.low)
        fractions = (self._stretch(values) - self._low) / (self._high - self._low)
        inside: Array = np.clip(fractions, 0.0, 1.0)
        return inside

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Return at most some ``most`` ticks: fraction of the axis, and text."""
        linear = self.scale in ("linear", "snr")
        if linear:
            wanted = linear_ticks(self.low, self.high, most)
        else:
            wanted = _spread_ticks(self.low, self.high)
        ticks: list[tuple[float, str]] = []
        for value in wanted:
            place = float((self._stretch(value) - self._low) / (self._high - self._low))
            if linear or all(abs(place - other) >= 0.9 / max(most, 1) for other, _ in ticks):
                ticks.append((place, tick_text(value)))
        return sorted(ticks)

    def _values(self, counts: Array) -> Array:
        if self.scale != "snr":
            return counts
        noise = np.sqrt(np.maximum(counts, 0.0))
        return np.divide(
            counts - self.background, noise, out=np.zeros_like(counts), where=noise > 0
        )


def round_up(value: float) -> float:
    """Return the least round number that is not below a positive value."""
    power = 10.0 ** floor(log10(value))
    for factor in ROUND:
        if factor * power >= value * (1 - 1e-12):
            return factor * power
    return 10 * power


def linear_ticks(low: float, high: float, most: int) -> list[float]:
    """Return multiples of 1, 2 or 5 times a power of ten from low to high, at most ``most``."""
    if high <= low:
        return [low]
    least = (high - low) / max(most, 1)
    power = 10.0 ** floor(log10(least))
    step = next(f * power for f in (1, 2, 5, 10) if f * power >= least * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [n * step for n in range(first, last + 1)]


def tick_text(value: float) -> str:
    """Short text of a tick."""
    return f"{value:.0e}".replace("e+0", "e") if abs(value) >= 1e5 else f"{value:.6g}"


def _spread_ticks(low: float, high: float) -> list[float]:
    """Return candidates for a scale that is not linear, the more important ones first."""
    ends = [high] if low > 0 else [0.0, high]
    top = floor(log10(high))
    bottom = floor(log10(low)) if low > 0 else top - DECADES
    powers = [10.0**n for n in range(top, bottom - 1, -1)]
    between = [f * power for f in (5.0, 2.0) for power in powers]
    candidates = ends + [v for v in powers + between if low <= v <= high]
    return list(dict.fromkeys(candidates))

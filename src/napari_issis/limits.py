"""Count rates at which a photon-counting detector stops being linear."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .instrument import LIMITS


class CountRateWarning(UserWarning):
    """The scene is brighter than a photon-counting detector counts linearly."""


def count_rate_warnings(rate: NDArray[np.float64], sky_rate: float) -> list[str]:
    """Sentences for each limit that the scene breaks, the last with the cure; none if none.

    Parameters
    ----------
    rate : ndarray, shape (ny, nx)
        Count rate of the sources, cps per pixel.
    sky_rate : float
        Sky, cps per pixel.

    Notes
    -----
    The limits are those of HST ACS/SBC, the nearest analogue (see `instrument`): none has
    been published for ISSIS. The frame stands for the detector; light outside it is not seen.
    """
    if rate.size == 0:
        return []
    messages = []
    total = float(rate.sum() + sky_rate * rate.size)
    if total > LIMITS.total:
        messages.append(
            f"The frame receives {total:.3g} cps; a detector such as HST's SBC is linear up to "
            f"{LIMITS.total:.0e} cps."
        )
    local = rate + sky_rate
    peak = float(local.max())
    if peak > LIMITS.local:
        y, x = np.unravel_index(int(local.argmax()), local.shape)
        count = int(np.count_nonzero(local > LIMITS.local))
        pixels = "1 pixel receives" if count == 1 else f"{count} pixels receive"
        messages.append(
            f"{pixels} more than {LIMITS.local:g} cps, at most {peak:.3g} cps at x = {x}, "
            f"y = {y}; a detector such as HST's SBC counts linearly below that."
        )
    if messages:
        messages[-1] += f" {_cure(max(total / LIMITS.total, peak / LIMITS.local))}"
    return messages


def _cure(excess: float) -> str:
    for name, factor in (("NF1", 10), ("NF2", 100), ("NF1 and NF2", 1000), ("NF2 twice", 10000)):
        if excess <= factor:
            return f"The neutral filter {name} would cure it."
    return "No neutral filter cures it."

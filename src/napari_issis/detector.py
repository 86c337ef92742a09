"""What a photon-counting detector does to the light: coincidence loss and 16-bit rollover."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .instruments import ISSIS
from .psf import positive

Array = NDArray[np.float64]

# numbers that a pixel's 16-bit memory can hold
WORD = 65536


@dataclass(frozen=True)
class Detector:
    """Effects of a photon-counting detector; none by default, as in the paper.

    Parameters
    ----------
    dead_time : float
        Time in s for which a pixel is blind after each count; 0 for none.
    rollover : bool
        Whether a pixel's memory has 16 bits: it holds the counts modulo 65536, as the
        accumulated images of HST ACS/SBC do (ACS Instrument Handbook, section 4.5).

    Raises
    ------
    ValueError
        If the dead time is negative or not finite, or ``rollover`` is not true or false.

    Notes
    -----
    A dead time that further photons do not prolong (non-paralyzable) makes the detected rate
    m = n / (1 + n tau) of the true rate n: the mean time from one count to the next is that to
    the next photon, 1 / n, and tau. The counts are drawn from their exact distribution, which is
    narrower than Poisson's, see `napari_issis.dead_time`: the variance is about
    m T / (1 + n tau)^2. The expected counts are m T, which the exact mean exceeds by less than
    half a count in exposures much longer than tau and 1 / n.

    Each pixel loses by itself. A loss in electronics that all pixels share is not modelled: it
    depends on the rate N of the whole detector, of which the frame is a part. It is one factor
    for all pixels, that of an exposure shortened to T / (1 + N tau); who knows N and tau can
    give that time.
    """

    dead_time: float = 0.0
    rollover: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "dead_time", positive("dead_time", self.dead_time, "seconds", zero=True)
        )
        if not isinstance(self.rollover, bool | np.bool_):
            raise ValueError(f"rollover is {self.rollover!r}; it must be True or False.")
        object.__setattr__(self, "rollover", bool(self.rollover))

    @classmethod
    def losing(
        cls, loss: float = 0.01, *, rate: float | None = None, rollover: bool = False
    ) -> Detector:
        """Return a detector that loses a given share of the light at a given rate.

        Parameters
        ----------
        loss : float
            Share of the photons that is lost there, between 0 and 1.
        rate : float, optional
            True rate in cps per pixel; by default the local limit of ISSIS, 22, where HST
            ACS/SBC loses 1 % (ACS Instrument Handbook, section 4.5).
        rollover : bool
            As for the class.

        Raises
        ------
        ValueError
            If the loss does not lie between 0 and 1, or the rate is not positive.
        """
        loss = positive("loss", loss, "1 (a share)", zero=True)
        if loss >= 1:
            raise ValueError(f"loss is {loss}; it must be a share from 0 to below 1.")
        limit = ISSIS.channels[ISSIS.default_channel].local_limit if rate is None else rate
        rate = positive("rate", limit, "cps per pixel")
        return cls(loss / ((1 - loss) * rate), rollover)

    def detected(self, rate: Array) -> Array:
        """Return the rate that is counted of a true rate, cps per pixel, any shape."""
        return rate / (1 + rate * self.dead_time) if self.dead_time else rate

    def received(self, rate: Array) -> Array:
        """Return the true rate of which a rate is counted, cps per pixel, any shape.

        Infinite from one count per dead time on.
        """
        seeing = 1 - rate * self.dead_time
        return np.divide(rate, seeing, out=np.full_like(rate, np.inf), where=seeing > 0)

    def variance(self, rate: Array) -> Array:
        """Return the variance, for 1 s, of the best estimate of a true rate, any shape.

        Parameters
        ----------
        rate : ndarray
            True rate in cps per pixel.

        Notes
        -----
        n (1 + n tau): that of the detected counts, m T / (1 + n tau)^2, over the square of what
        they grow by with n T, 1 / (1 + n tau)^2. It is 1 / (information on n of the waiting
        times, of which m T are seen, each with the information 1 / n^2), for exposures much
        longer than tau and 1 / n.
        """
        return rate * (1 + rate * self.dead_time) if self.dead_time else rate

    def stored(self, counts: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the numbers that the memory holds after these counts, any shape."""
        return counts % WORD if self.rollover else counts


IDEAL = Detector()


def checked_detector(value: Any) -> Detector:
    """Return a detector, or raise a ValueError that names what was given."""
    if not isinstance(value, Detector):
        raise ValueError(f"detector is {value!r}; give a Detector, such as Detector(4.6e-4).")
    return value

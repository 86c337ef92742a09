"""From a source table to detected counts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .counts import checked_seed, poisson_counts
from .limits import warn_of_count_rates
from .observation import Observation
from .render import render


@dataclass(frozen=True, eq=False)
class Exposure:
    """A simulated exposure.

    Attributes
    ----------
    counts : ndarray of int64, shape (ny, nx)
        Detected counts, as the detector stores them; row 0 is drawn at the bottom.
    expected : ndarray of float64, shape (ny, nx)
        Expected counts: sources, sky and dark rate, less those that a dead time loses.
    sources : astropy.table.QTable
        The source table.
    observation : Observation
        The instrument set-up.
    seed : int
        Seed of the noise.
    clipped : float
        Largest negative ripple, in counts, that was set to zero before the counts were drawn.
    """

    counts: NDArray[np.int64]
    expected: NDArray[np.float64]
    sources: QTable
    observation: Observation
    seed: int
    clipped: float = 0.0

    @property
    def background(self) -> float:
        """Expected counts per pixel without sources, B = beta T; sky and dark rate."""
        return float(expected_of_rate(np.zeros(()), self.observation))

    @property
    def snr(self) -> NDArray[np.float64]:
        """(C - B) / sqrt(C) per pixel (paper, section 2); 0 where no count was detected."""
        counts = self.counts.astype(np.float64)
        return np.divide(
            counts - self.background,
            np.sqrt(counts),
            out=np.zeros_like(counts),
            where=counts > 0,
        )

    def write(
        self,
        path: str | Path,
        *,
        overwrite: bool = False,
        compress: bool = False,
        image: str = "counts",
        dtype: str | None = None,
        whole: bool = True,
    ) -> None:
        """Write the exposure to a FITS file; see `napari_issis.fits_io.write_exposure`."""
        from .fits_io import write_exposure

        write_exposure(
            self,
            path,
            overwrite=overwrite,
            compress=compress,
            image=image,
            dtype=dtype,
            whole=whole,
        )

    @classmethod
    def read(cls, path: str | Path) -> Exposure:
        """Read an exposure from a FITS file; see `napari_issis.fits_io.read_exposure`."""
        from .fits_io import read_exposure

        return read_exposure(path)

    def __eq__(self, other: Any) -> bool:
        return (
            isinstance(other, Exposure)
            and self.observation == other.observation
            and self.seed == other.seed
            and self.clipped == other.clipped
            and np.array_equal(self.counts, other.counts)
            and np.array_equal(self.expected, other.expected)
            and same_table(self.sources, other.sources)
        )

    __hash__ = None  # type: ignore[assignment]


def simulate(
    sources: Table,
    observation: Observation | None = None,
    *,
    seed: int = 0,
    tolerance: float | None = None,
) -> Exposure:
    """Simulate an exposure of a scene.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation, optional
        The instrument set-up, by default the paper's (NUV, open-open, 100 s, 512 x 512).
    seed : int
        Seed of the Poisson noise, 0 or more. The same seed gives the same uniform number to
        the same pixel, whatever the scene.
    tolerance : float, optional
        Largest error of any pixel's rate over the image's peak, as for `count_rate`. By
        default that of `accuracy_for_counts`: the error is at most 1e-6 of the peak and 1 %
        of the sky in every pixel, but not asked to be below 1e-12 of the peak.

    Returns
    -------
    Exposure

    Warns
    -----
    CountRateWarning
        If the scene breaks a count-rate limit of a photon-counting detector.
    """
    observation = Observation() if observation is None else observation
    seed = checked_seed(seed)
    rate, clipped = noise_ready_rate(sources, observation, tolerance=tolerance)
    warn_of_count_rates(rate, sources, observation)
    return expose(rate, sources, observation, seed=seed, clipped=clipped)


def noise_ready_rate(
    sources: Table, observation: Observation, *, tolerance: float | None = None
) -> tuple[NDArray[np.float64], float]:
    """Count rate of the sources with ripple below zero removed, and the largest one removed.

    Accurate enough for drawing counts, see `simulate`. Independent of the exposure time; the
    neutral filters scale the rate without them and render nothing.
    """
    transmittance = observation.neutral_transmittance
    absolute = None
    if tolerance is None:
        tolerance, absolute = accuracy_for_counts(observation)
    rate = render(
        sources, observation.without_neutral_filters(), tolerance=tolerance, absolute=absolute
    )
    lowest = float(rate.min(initial=0.0))
    return np.maximum(rate, 0.0) * transmittance, abs(min(lowest, 0.0)) * transmittance


def accuracy_for_counts(observation: Observation) -> tuple[float, float | None]:
    """Error of the rate without neutral filters with which counts may be drawn.

    Returns
    -------
    tolerance : float
        Largest error over the image's peak: 1e-6, and 1e-8 without a sky.
    absolute : float or None
        Largest error in cps per pixel: 1 % of the sky, rounded down to a power of ten, so that
        skies that differ a little share a render.
    """
    sky = observation.without_neutral_filters().sky_rate
    if sky <= 0:
        return 1e-8, None
    return 1e-6, float(10.0 ** np.floor(np.log10(0.01 * sky)))


def expose(
    rate: NDArray[np.float64],
    sources: Table,
    observation: Observation,
    *,
    seed: int = 0,
    clipped: float = 0.0,
) -> Exposure:
    """Add sky and dark rate, expose, draw the counts and store them; renders nothing.

    Parameters
    ----------
    rate : ndarray, shape (ny, nx)
        Count rate of the sources, cps per pixel, none negative.
    sources : astropy.table.QTable
        The source table that the rate belongs to; a copy is kept.
    observation : Observation
        The instrument set-up.
    seed : int
        Seed of the noise.
    clipped : float
        Largest negative ripple removed from the rate, cps per pixel.
    """
    expected = expected_of_rate(rate, observation)
    return Exposure(
        counts=observation.detector.stored(
            poisson_counts(expected, seed, dead_share=dead_share(observation))
        ),
        expected=expected,
        sources=QTable(sources, copy=True),
        observation=observation,
        seed=int(seed),
        clipped=clipped * observation.exposure,
    )


def expected_of_rate(rate: NDArray[np.float64], observation: Observation) -> NDArray[np.float64]:
    """Return the expected counts of a count rate of the sources in cps per pixel, any shape."""
    rate = observation.detector.detected(rate + observation.background_rate)
    return np.asarray(rate * observation.exposure)


def dead_share(observation: Observation) -> float:
    """Return the detector's dead time over the exposure time."""
    return observation.detector.dead_time / observation.exposure


def same_table(first: Table, second: Table) -> bool:
    """Whether two source tables hold the same columns, units and values.

    NaN equals NaN, and a masked number is one: that is what a file keeps of it.
    """
    if first.colnames != second.colnames or len(first) != len(second):
        return False
    for name in first.colnames:
        a, b = first[name], second[name]
        if getattr(a, "unit", None) != getattr(b, "unit", None):
            return False
        a, b = (_values(v) for v in (a, b))
        if a.dtype.kind in "fc" and b.dtype.kind in "fc":
            if not np.array_equal(a, b, equal_nan=True):
                return False
        elif not np.array_equal(a, b):
            return False
    return True


def _values(column: Any) -> NDArray[Any]:
    values = np.asarray(getattr(column, "value", column))
    mask = getattr(column, "mask", None)
    if mask is None or values.dtype.kind != "f":
        return values
    return np.where(mask, np.nan, values)

"""The count rate of a scene while some of its sources are moved or edited."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from astropy.table import Table
from numpy.typing import ArrayLike, NDArray

from .observation import Observation
from .render import arrays_and_rates, count_rate, peaks
from .render.moving import MovingSource, moving_source
from .render.optics import Optics
from .render.windows import Window
from .sources import SourceArrays

Array = NDArray[np.float64]

# sources moved at once, above which they are rendered together
MOST_SOURCES = 24


class Drag:
    """The count rate of a scene while some of its sources are moved or edited.

    The others are rendered once. A moved source is drawn on a window as large as the tolerance
    asks for; nothing is done to the rest of the frame.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation, optional
        The instrument set-up, by default the paper's.
    rows : sequence of int
        Rows of the sources that will move.
    tolerance : float
        Largest error of any pixel over the image's largest pixel.
    negligible : float
        Error in cps per pixel that may be made even if it is above the tolerance.
    rest : ndarray, shape (ny, nx), optional
        Count rate of the other sources, where it is known; it is rendered if not given.

    Attributes
    ----------
    rate : ndarray of float64, shape (ny, nx)
        Expected count rate in cps per pixel, as `count_rate` gives it, after the latest `move`.
        It depends on the rest and the moved sources as they are now, not on the way there.

    Raises
    ------
    ValueError
        If the table, the rows or the tolerance are not valid.
    """

    def __init__(
        self,
        sources: Table,
        observation: Observation | None = None,
        rows: Sequence[int] | NDArray[np.intp] = (),
        *,
        tolerance: float = 1e-5,
        negligible: float = 0.0,
        rest: ArrayLike | None = None,
    ) -> None:
        self.observation = observation or Observation()
        self.tolerance = tolerance
        self.negligible = negligible
        chosen = np.asarray(rows, dtype=np.intp)
        for row in chosen[(chosen < 0) | (chosen >= len(sources))]:
            raise ValueError(f"there is no row {row}; the table has {len(sources)} rows, from 0.")
        moving = np.zeros(len(sources), dtype=bool)
        moving[chosen] = True
        if rest is None:
            rest = count_rate(sources[~moving], self.observation, tolerance=tolerance)
        self.rest = np.array(rest, dtype=np.float64)
        if self.rest.shape != self.observation.shape:
            raise ValueError(
                f"rest has the shape {self.rest.shape}; it must be the frame's, "
                f"{self.observation.shape}."
            )
        self.rate = self.rest.copy()
        self._peak = float(self.rest.max())
        self._optics = Optics(self.observation.effective_psf, self.observation.pixel_scale)
        self._windows: list[Window] = []
        self._kept: dict[tuple[object, ...], MovingSource | None] = {}
        self.move(sources[moving])

    def move(self, moved: Table) -> list[Window]:
        """Put the moving sources where and as a table says.

        Parameters
        ----------
        moved : astropy.table.QTable
            The moving sources as they are now; any number of rows.

        Returns
        -------
        list of (slice, slice)
            Windows of the frame outside of which `rate` has not changed.
        """
        arrays, rates = arrays_and_rates(moved, self.observation)
        windows = self._windows
        for window in windows:
            self.rate[window] = self.rest[window]
        self._windows = []
        if not rates.size:
            return windows
        own = peaks(self._optics, arrays, rates)
        allowed = max(self.tolerance * max(self._peak, float(own.max())), self.negligible)
        if len(arrays) > MOST_SOURCES:
            self._render(moved)
            return [_whole(self.observation.shape)]
        # positions change, shapes rarely: their spectra are kept
        kept: dict[tuple[object, ...], MovingSource | None] = {}
        for i in range(len(arrays)):
            one = arrays.take(slice(i, i + 1))
            key = (*_shape_of(one), float(rates[i]), allowed)
            if key in self._kept:
                kept[key] = self._kept[key]
            elif key not in kept:
                kept[key] = moving_source(
                    self._optics, one, rates[i], allowed, self.observation.shape
                )
            mover = kept[key]
            if mover is None:
                self._kept = {}
                for window in self._windows:
                    self.rate[window] = self.rest[window]
                self._render(moved)
                return [_whole(self.observation.shape)]
            drawn = mover.add(self.rate, float(one.y[0]), float(one.x[0]))
            if drawn is not None:
                self._windows.append(drawn)
        self._kept = kept
        return windows + self._windows

    def _render(self, moved: Table) -> None:
        self.rate += count_rate(moved, self.observation, tolerance=self.tolerance)
        self._windows = [_whole(self.observation.shape)]


def _shape_of(one: SourceArrays) -> tuple[object, ...]:
    """All but the position; a point's structure values do not count."""
    if one.kind[0] == "point":
        return ("point",)
    return (
        str(one.kind[0]),
        str(one.image[0]),
        float(one.index[0]) if np.isfinite(one.index[0]) else None,
        float(one.r_half[0]),
        float(one.ellipticity[0]),
        float(one.pa[0]),
    )


def _whole(shape: tuple[int, int]) -> Window:
    return (slice(0, shape[0]), slice(0, shape[1]))

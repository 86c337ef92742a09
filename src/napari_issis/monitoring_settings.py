"""A monitoring by a few numbers: regular epochs, a dither pattern, one light curve with delays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from astropy.table import Table

from .light_curves import LightCurve, damped_random_walk, sinusoid
from .monitoring import Epoch, Monitoring, monitor
from .observation import Observation
from .sources import check_sources

CURVES = ("constant", "sinusoid", "damped random walk")
# Degrees between a dither and the next: no two of a few come to lie on a line (Vogel 1979).
GOLDEN_ANGLE = 137.50776405


@dataclass(frozen=True)
class MonitoringSettings:
    """A regular monitoring of a scene whose point sources vary alike.

    Parameters
    ----------
    epochs : int
        Number of epochs, from time 0 on.
    cadence : float
        Days between them.
    exposures : int
        Exposures at each epoch.
    dither : float
        Pixels from the first pointing of an epoch to the others, which go around it.
    roll : float
        By how many degrees the roll grows from an epoch to the next.
    curve : {"constant", "sinusoid", "damped random walk"}
        How the point sources vary; extended ones are constant.
    amplitude : float
        Magnitudes, see `sinusoid` and `damped_random_walk`.
    time_scale : float
        Period, or time after which the walk forgets, days.
    delays : tuple of float
        Days by which each point source lags, in their order; empty for none.
    seed : int
        Of the walk, and of the exposures' noise.
    """

    epochs: int = 20
    cadence: float = 5.0
    exposures: int = 3
    dither: float = 5.0
    roll: float = 0.0
    curve: str = "damped random walk"
    amplitude: float = 0.2
    time_scale: float = 200.0
    delays: tuple[float, ...] = ()
    seed: int = 0

    def plan(self, sources: Table, observation: Observation) -> Monitoring:
        """Plan the exposures.

        Raises
        ------
        ValueError
            If a value is out of range, or there are other delays than point sources.
        """
        points = np.flatnonzero(check_sources(sources, pivot=observation.pivot).kind == "point")
        if self.delays and len(self.delays) != len(points):
            raise ValueError(
                f"there are {len(self.delays)} delays and {len(points)} point sources; give as "
                "many, or none."
            )
        curve = self._light_curve()
        rows = [] if curve is None else [int(row) for row in points]
        return monitor(
            sources,
            observation,
            [Epoch(k * self.cadence, roll=k * self.roll) for k in range(self.epochs)],
            light_curves={row: curve for row in rows if curve is not None},
            delays=dict(zip(rows, self.delays, strict=False)),
            exposures=self.exposures,
            dithers=dithers(self.exposures, self.dither),
            seed=self.seed,
        )

    def _light_curve(self) -> LightCurve | None:
        if self.curve == "sinusoid":
            return sinusoid(self.amplitude, self.time_scale)
        if self.curve == "damped random walk":
            return damped_random_walk(self.amplitude, self.time_scale, seed=self.seed)
        if self.curve == "constant":
            return None
        raise ValueError(f"curve is {self.curve!r}; known: {', '.join(CURVES)}.")


def dithers(exposures: int, size: float) -> list[tuple[float, float]]:
    """Offsets (x, y) in pixels: none, then on a circle about it."""
    angles = np.radians(GOLDEN_ANGLE * np.arange(1, exposures))
    around = zip(size * np.cos(angles), size * np.sin(angles), strict=True)
    return [(0.0, 0.0), *((float(x), float(y)) for x, y in around)]

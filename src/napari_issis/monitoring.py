"""A sequence of exposures of one scene: epochs, light curves, time delays, roll and dithers."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .counts import checked_seed
from .exposure import Exposure, simulate
from .light_curves import LightCurve, flux_factors
from .monitoring_tasks import add_shifted, run, stack
from .moved_frame import move_frame
from .observation import Observation
from .source_image import SourceImage, kept_images
from .source_rates import sources_and_rates
from .sources import FLUX_UNIT, check_sources

Offset = tuple[float, float]


@dataclass(frozen=True)
class Epoch:
    """When, and how the telescope then stands.

    Parameters
    ----------
    time : float
        In the unit of the light curves and delays, such as days.
    roll : float
        Added to the observation's roll, degrees.
    offset : (float, float)
        By which the pointing is off, pixels along the frame's +x and +y.
    changes : mapping
        What else differs in the observation, such as ``{"psf": ni.GaussianPSF(0.12)}`` or
        ``{"exposure": 600}``.
    """

    time: float
    roll: float = 0.0
    offset: Offset = (0.0, 0.0)
    changes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class PlannedExposure:
    """One exposure of a sequence: all that `simulate` needs, and where it belongs."""

    epoch: int
    number: int
    time: float
    dither: Offset
    sources: QTable = field(repr=False)
    observation: Observation
    seed: int
    # Exposures with the same number share a render.
    render: int
    # Those that sources are, for workers in other processes.
    images: tuple[SourceImage, ...] = field(default=(), repr=False)

    @property
    def file_name(self) -> str:
        """Name of its file in an output folder."""
        return f"epoch{self.epoch:04d}_exposure{self.number:02d}.fits"

    @property
    def shift(self) -> tuple[int, int]:
        """Whole pixels (x, y) by which it is moved before it is co-added."""
        return round(self.dither[0]), round(self.dither[1])


@dataclass(frozen=True, eq=False)
class Monitoring:
    """A planned sequence of exposures; nothing is computed before it is asked for.

    Attributes
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation
        The instrument set-up.
    epochs : tuple of Epoch
        The epochs.
    factors : ndarray, shape (epochs, sources)
        Flux of each source at each epoch over that of the source table.
    exposures : tuple of PlannedExposure
        All exposures, epoch by epoch.
    seed : int
        Seed of the sequence, from which those of the exposures are drawn.
    tolerance : float, optional
        As for `simulate`.
    """

    sources: QTable
    observation: Observation
    epochs: tuple[Epoch, ...]
    factors: NDArray[np.float64]
    exposures: tuple[PlannedExposure, ...]
    seed: int
    tolerance: float | None
    # Names the tasks of this plan among all that a cluster may hold.
    token: str = field(default_factory=lambda: uuid4().hex, repr=False)

    def simulate(self, index: int) -> Exposure:
        """Simulate one exposure of the sequence, by its place in `exposures`."""
        one = self.exposures[index]
        return simulate(one.sources, one.observation, seed=one.seed, tolerance=self.tolerance)

    def stack(self, image: str = "counts", *, coadd: bool = True) -> Any:
        """Make a lazily computed stack of images.

        Parameters
        ----------
        image : {"counts", "expected"}
            Detected or expected counts.
        coadd : bool
            Whether the exposures of an epoch are added, each first moved back by its dither
            rounded to whole pixels; no count is divided, and what falls outside the frame is
            left out (see `exposure_map`).

        Returns
        -------
        dask.array.Array, shape (epochs or exposures, ny, nx)
            One chunk a frame. Frames that are computed together share their renders; the
            scheduler is the one in use, a `dask.distributed.Client` for instance.

        Raises
        ------
        ImportError
            If dask is not installed: ``pip install "napari-issis[monitor]"``.
        """
        return stack(self, image, coadd)

    def exposure_map(self, epoch: int) -> NDArray[np.float64]:
        """Exposure time of each pixel of a co-added epoch, seconds, shape (ny, nx)."""
        ones = [self.exposures[index] for index in self.members()[epoch]]
        times = [np.full(self.observation.shape, one.observation.exposure) for one in ones]
        return add_shifted(times, [one.shift for one in ones])

    def run(
        self,
        folder: str | os.PathLike[str],
        *,
        progress: Callable[[int, int], None] | None = None,
    ) -> list[Path]:
        """Simulate all exposures into a folder, one FITS file each; finished ones are kept.

        Parameters
        ----------
        folder : path-like
            Created if it is missing. Workers of a cluster write into it, so that they must see
            it under the same path.
        progress : callable, optional
            Called with the numbers of finished and of all exposures.

        Returns
        -------
        list of Path
            The files, in the order of `exposures`.

        Raises
        ------
        ValueError
            If a file of that name holds another exposure, or is damaged; nothing is computed
            then.
        OSError
            If a file cannot be written; those finished before stay.
        ImportError
            If dask is not installed.
        """
        return run(self, Path(folder).resolve(), progress)

    def write_cube(
        self,
        path: str | os.PathLike[str],
        image: str = "counts",
        *,
        coadd: bool = True,
        overwrite: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        """Write the stack as a FITS cube; see `napari_issis.fits_cube.write_cube`."""
        from .fits_cube import write_cube

        write_cube(self, path, image, coadd=coadd, overwrite=overwrite, progress=progress)

    def show(self, viewer: Any = None, *, image: str = "counts", coadd: bool = True) -> Any:
        """Show the stack in napari, with its slider over the epochs; returns the layer."""
        from .plugin.monitoring_layer import show_monitoring

        return show_monitoring(self, viewer, image=image, coadd=coadd)

    def members(self) -> list[list[int]]:
        """Places in `exposures` of those of each epoch."""
        members: list[list[int]] = [[] for _ in self.epochs]
        for index, one in enumerate(self.exposures):
            members[one.epoch].append(index)
        return members


def monitor(
    sources: Table,
    observation: Observation | None = None,
    epochs: Sequence[float | Epoch] = (0.0,),
    *,
    light_curves: Mapping[int, LightCurve] | None = None,
    delays: Mapping[int, float] | None = None,
    exposures: int = 1,
    dithers: Sequence[Offset] | None = None,
    seed: int = 0,
    tolerance: float | None = None,
) -> Monitoring:
    """Plan a sequence of exposures.

    Parameters
    ----------
    sources : astropy.table.Table
        The source table, in the frame of ``observation``.
    observation : Observation, optional
        The instrument set-up; the exposure time is that of each single exposure.
    epochs : sequence of float or Epoch
        Times, or epochs with roll, pointing offset and other changes.
    light_curves : mapping of int to callable or (times, factors), optional
        By row of the source table: its flux over that of the table, as a function of time or
        as a table that is interpolated linearly.
    delays : mapping of int to float, optional
        By row: its light curve arrives so much later.
    exposures : int
        Exposures at each epoch.
    dithers : sequence of (float, float), optional
        Offsets of the pointing of the exposures at an epoch, pixels along the frame's +x and
        +y, one for each exposure.
    seed : int
        Seed of the sequence. Each exposure has a seed of its own, a function of this one, the
        epoch's number and the exposure's.
    tolerance : float, optional
        As for `simulate`.

    Returns
    -------
    Monitoring

    Raises
    ------
    ValueError
        If a value is out of range; the message names it.
    """
    observation = Observation() if observation is None else observation
    arrays = check_sources(sources, pivot=observation.pivot, pixel_scale=observation.pixel_scale)
    seed = checked_seed(seed)
    whole = tuple(one if isinstance(one, Epoch) else Epoch(_time(one)) for one in epochs)
    if not whole:
        raise ValueError("epochs is empty; give at least one time.")
    if isinstance(exposures, bool) or not hasattr(exposures, "__index__") or exposures < 1:
        raise ValueError(f"exposures is {exposures!r}; it is a whole number of 1 or more.")
    steps = [(0.0, 0.0)] * exposures if dithers is None else [_offset(d) for d in dithers]
    if len(steps) != exposures:
        raise ValueError(f"there are {len(steps)} dithers and {exposures} exposures; give as many.")
    times = np.array([_time(one.time) for one in whole])
    factors = flux_factors(light_curves, delays, times, len(arrays))
    images = tuple(kept_images(sources).values())
    planned: list[PlannedExposure] = []
    renders: dict[Any, int] = {}
    for number, epoch in enumerate(whole):
        table = QTable(sources, copy=True)
        changed = _changed(observation, epoch, number)
        if not np.all(factors[number] == 1):
            flux = sources_and_rates(sources, changed)[0].flux
            table["flux"] = flux * factors[number] * FLUX_UNIT
        off = _offset(epoch.offset)
        for k, step in enumerate(steps):
            total = (off[0] + step[0], off[1] + step[1])
            seen, frame = move_frame(table, changed, roll=float(epoch.roll), offset=total)
            render = renders.setdefault(_scene_key(seen, frame), len(renders))
            own = np.random.SeedSequence(seed, spawn_key=(number, k)).generate_state(1, np.uint64)
            planned.append(
                PlannedExposure(
                    number, k, float(times[number]), step, seen, frame, int(own[0]), render, images
                )
            )
    return Monitoring(
        QTable(sources, copy=True), observation, whole, factors, tuple(planned), seed, tolerance
    )


def _scene_key(sources: QTable, observation: Observation) -> Any:
    """Return what the count rate depends on."""
    arrays = check_sources(sources, pivot=observation.pivot, pixel_scale=observation.pixel_scale)
    values = tuple(getattr(arrays, name).tobytes() for name in arrays.__dataclass_fields__)
    return observation.replace(exposure=1.0), values


def _changed(observation: Observation, epoch: Epoch, number: int) -> Observation:
    for name in ("shape", "pointing", "roll"):
        if name in epoch.changes:
            raise ValueError(
                f"epoch {number} changes the {name}; use roll= and offset= of the Epoch, and one "
                "shape for all."
            )
    try:
        return observation.replace(**epoch.changes)
    except TypeError as error:
        raise ValueError(f"epoch {number} changes what an observation has not: {error}.") from None


def _time(time: Any) -> float:
    try:
        value = float(time)
    except (TypeError, ValueError):
        raise ValueError(f"the time of an epoch is {time!r}; it must be a number.") from None
    if not np.isfinite(value):
        raise ValueError(f"the time of an epoch is {value}; it must be finite.")
    return value


def _offset(offset: Any) -> Offset:
    try:
        x, y = (float(value) for value in offset)
    except (TypeError, ValueError):
        raise ValueError(f"an offset is {offset!r}; give (x, y) in pixels.") from None
    if not (np.isfinite(x) and np.isfinite(y)):
        raise ValueError(f"an offset is ({x}, {y}); it must be finite.")
    return x, y

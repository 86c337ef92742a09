"""Light curves recovered from a sequence of exposures, by a fit of all fluxes at each epoch."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from .detector import IDEAL
from .flux_fit import fit_fluxes, flux_errors
from .monitoring_tasks import exposed, rate_of, read_finished
from .observation import Observation
from .render import count_rate
from .source_rates import rates_per_flux, sources_and_rates
from .sources import FLUX_UNIT, SourceArrays

if TYPE_CHECKING:
    from .monitoring import Monitoring, PlannedExposure

Array = NDArray[np.float64]

# Flux in erg s-1 cm-2 A-1 at which templates are rendered; they are scaled afterwards.
TEMPLATE_FLUX = 1e-15
# Frames whose templates or rates are kept: those of the dithers of an epoch, mostly.
KEPT = 16
# Bytes that the templates of an epoch may take.
MOST_BYTES = 2e9


def fit_light_curves(
    monitoring: Monitoring,
    counts: Any = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> QTable:
    """Fit the flux of every source at every epoch, with positions, shapes, PSF and sky known.

    Parameters
    ----------
    monitoring : Monitoring
        The sequence; its sources, roll, offsets and dithers say where everything lies.
    counts : path-like or array_like, optional
        The folder of `Monitoring.run`, or detected counts of shape (exposures, ny, nx) in the
        order of ``monitoring.exposures``. By default the sequence is simulated.
    progress : callable, optional
        Called with the numbers of fitted and of all epochs.

    Returns
    -------
    astropy.table.QTable
        One row for each source at each epoch: ``epoch``, ``time``, ``source`` (row of the
        source table), ``flux``, ``error`` and ``truth``, the planned flux. Where an epoch
        does not determine a flux (outside the frame, two sources at one place), the flux is
        NaN and its error infinite.

    Raises
    ------
    ValueError
        If the counts do not belong to the sequence, its detector is not linear, or the fit
        needs too much memory.
    FileNotFoundError
        If an exposure is missing in the folder.

    Notes
    -----
    The exposures of an epoch are fitted together, each at its own dither, not co-added. The
    fluxes are those of largest Poisson likelihood (`napari_issis.flux_fit`). The errors are
    forecasts, from the Fisher information at the planned fluxes: what a proposal promises, and
    independent of the noise. Unlike those of `forecast` they are those of fluxes whose
    positions are known.
    """
    tell = progress or (lambda done, total: None)
    members, n = monitoring.members(), len(monitoring.sources)
    _check_possible(monitoring, members)
    counts_of = _reader(monitoring, counts)
    kept: dict[Hashable, Array] = {}
    flux, error, truth = (np.full((len(members), n), np.nan) for _ in range(3))
    tell(0, len(members))
    for epoch, indices in enumerate(members):
        templates, sky = [], []
        for index in indices:
            one = monitoring.exposures[index]
            arrays, _ = sources_and_rates(one.sources, one.observation)
            per_flux = np.broadcast_to(rates_per_flux(one.sources, one.observation), n)
            seconds = one.observation.exposure
            templates.append(_templates(one, arrays, kept) * (seconds * per_flux)[:, None])
            sky.append(np.full(templates[-1].shape[1], one.observation.background_rate * seconds))
            truth[epoch] = arrays.flux
        images, background = np.concatenate(templates, axis=1), np.concatenate(sky)
        seen = np.concatenate([counts_of(index).ravel() for index in indices])
        error[epoch] = flux_errors(images, truth[epoch] @ images + background)
        fitted = fit_fluxes(seen, images, background)
        flux[epoch] = np.where(np.isfinite(error[epoch]), fitted, np.nan)
        tell(epoch + 1, len(members))
    times = [monitoring.exposures[indices[0]].time for indices in members]
    return QTable(
        {
            "epoch": np.repeat(np.arange(len(members)), n),
            "time": np.repeat(times, n),
            "source": np.tile(np.arange(n), len(members)),
            "flux": flux.ravel() * FLUX_UNIT,
            "error": error.ravel() * FLUX_UNIT,
            "truth": truth.ravel() * FLUX_UNIT,
        }
    )


def _check_possible(monitoring: Monitoring, members: list[list[int]]) -> None:
    for one in monitoring.exposures:
        if one.observation.detector != IDEAL:
            raise ValueError(
                f"epoch {one.epoch} has {one.observation.detector}; fluxes are fitted for a "
                "linear detector only."
            )
    if not len(monitoring.sources):
        raise ValueError("the sequence has no sources whose flux could be fitted.")
    ny, nx = monitoring.observation.shape
    size = 8.0 * ny * nx * len(monitoring.sources) * max(map(len, members))
    if size > MOST_BYTES:
        raise ValueError(
            f"the fit of {len(monitoring.sources)} sources in frames of {ny} x {nx} pixels needs "
            f"{size / 1e9:.1f} GB at each epoch, more than {MOST_BYTES / 1e9:g}; choose a smaller "
            "frame or fewer sources."
        )


def _reader(monitoring: Monitoring, counts: Any) -> Callable[[int], NDArray[np.int64]]:
    """Return what gives the counts of an exposure by its place."""
    if counts is None:
        return _simulator(monitoring)
    if isinstance(counts, str | os.PathLike):
        folder, ones = Path(counts), monitoring.exposures
        return lambda index: read_finished(folder / ones[index].file_name, ones[index]).counts
    shape = (len(monitoring.exposures), *monitoring.observation.shape)
    if np.shape(counts) != shape:
        raise ValueError(
            f"counts have the shape {np.shape(counts)}; the sequence has {shape}, one frame for "
            "each exposure."
        )

    def given(index: int) -> NDArray[np.int64]:
        frame = np.asarray(counts[index])
        if frame.dtype.kind not in "iu" or frame.min() < 0:
            raise ValueError(
                f"counts of exposure {index} are {frame.dtype.name}, {frame.min():g} or more; "
                "give whole numbers, 0 or more."
            )
        return frame

    return given


def _simulator(monitoring: Monitoring) -> Callable[[int], NDArray[np.int64]]:
    rates: dict[int, Any] = {}

    def simulated(index: int) -> NDArray[np.int64]:
        one = monitoring.exposures[index]
        if one.render not in rates:
            if len(rates) >= KEPT:
                rates.clear()
            rates[one.render] = rate_of(
                one.sources, one.observation, monitoring.tolerance, one.images
            )
        return exposed(rates[one.render], one).counts

    return simulated


def _templates(one: PlannedExposure, arrays: SourceArrays, kept: dict[Hashable, Array]) -> Array:
    """Share of the light of each source in each pixel, shape (sources, pixels)."""
    names = (name for name in arrays.__dataclass_fields__ if name != "flux")
    frame = Observation(shape=one.observation.shape, psf=one.observation.effective_psf)
    key = (frame, *(getattr(arrays, name).tobytes() for name in names))
    if key not in kept:
        if len(kept) >= KEPT:
            kept.clear()
        table = QTable(one.sources, copy=True)
        table["flux"] = np.full(len(table), TEMPLATE_FLUX) * FLUX_UNIT
        # the share does not depend on the spectrum
        if "spectrum" in table.colnames:
            table.remove_column("spectrum")
        light = TEMPLATE_FLUX * frame.cps_per_flux
        rates = [count_rate(table[i : i + 1], frame).ravel() for i in range(len(table))]
        kept[key] = np.maximum(rates, 0.0) / light
    return kept[key]

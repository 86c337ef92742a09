"""Plots of recovered light curves."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np
from astropy.table import QTable

from .sources import FLUX_UNIT

# Widths and heights in inches.
WIDTH, PANEL, MARGIN = 7.5, 1.5, 0.6


def plot_light_curves(
    table: QTable,
    path: str | os.PathLike[str] | BinaryIO | None = None,
    *,
    names: Sequence[str] | None = None,
    title: str = "",
    time_label: str = "time",
) -> Any:
    """Plot recovered fluxes with their errors over the planned ones, a panel for each source.

    Parameters
    ----------
    table : astropy.table.QTable
        What `fit_light_curves` returned.
    path : path-like or binary file, optional
        Where to save the picture as well; the ending says how (``.png``, ``.pdf``, ``.svg``),
        a file without one gets a PNG.
    names : sequence of str, optional
        Names of the sources, in the order of the source table.
    title : str
        Stands above the panels.
    time_label : str
        Stands below them; the unit of the times is the plan's, such as ``time, days``.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ImportError
        If matplotlib is not installed: ``pip install "napari-issis[monitor]"``.
    ValueError
        If there are not as many names as sources.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError(
            'plots of light curves need matplotlib: pip install "napari-issis[monitor]"'
        ) from None
    rows = np.unique(table["source"])
    labels = [f"source {row}" for row in rows] if names is None else list(names)
    if len(labels) != len(rows):
        raise ValueError(f"there are {len(labels)} names and {len(rows)} sources; give as many.")
    figure = Figure(figsize=(WIDTH, MARGIN + PANEL * len(rows)), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
    for row, label, panel in zip(rows, labels, panels, strict=True):
        own = table[table["source"] == row]
        own.sort("time")
        time = np.asarray(own["time"])
        flux, error, truth = (own[name].to_value(FLUX_UNIT) for name in ("flux", "error", "truth"))
        seen = np.isfinite(flux)
        panel.plot(time, truth, color="tab:orange", linewidth=1.2, label="planned")
        panel.errorbar(
            time[seen],
            flux[seen],
            error[seen],
            fmt=".",
            color="tab:blue",
            markersize=4,
            elinewidth=0.8,
            label="recovered",
        )
        panel.set_ylabel(label)
        panel.grid(alpha=0.3)
    panels[0].legend(loc="upper right", fontsize=8, ncols=2)
    panels[-1].set_xlabel(time_label)
    figure.suptitle(title, fontsize=11)
    figure.supylabel("flux, erg s$^{-1}$ cm$^{-2}$ Å$^{-1}$", fontsize=10)
    if path is not None:
        figure.savefig(path, dpi=110)
    return figure

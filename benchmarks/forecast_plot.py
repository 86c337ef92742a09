"""Scatter of fits over the forecast, against separation and S/N."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from forecast_monte_carlo import Outcome

mpl.use("Agg")


def plot(outcomes: Sequence[Outcome], path: Path) -> None:
    """Draw pairs against their separation to the left, the other scenes against S/N."""
    figure = Figure(figsize=(11, 7), layout="constrained")
    axes = figure.subplots(2, 2, sharey=True)
    pairs = [one for one in outcomes if one.scene == "pair"]
    for axis, what in zip(axes[:, 0], ("flux", "position"), strict=True):
        for number, snr in enumerate(sorted({one.snr for one in pairs})):
            some = [one for one in pairs if one.snr == snr]
            x = np.array([one.separation for one in some]) * (1 + 0.02 * (number - 2))
            _points(axis, x, [getattr(one, what) for one in some], f"S/N {snr:g}")
        axis.set_title(f"two equal stars: {what}", fontsize=10)
        _log_ticks(axis, sorted({one.separation for one in pairs}))
    axes[1, 0].set_xlabel("separation, FWHM")
    for axis, what in zip(axes[:, 1], ("flux", "position"), strict=True):
        for number, scene in enumerate(("isolated", "quad")):
            some = [one for one in outcomes if one.scene == scene]
            x = np.array([one.snr for one in some]) * (1 + 0.03 * (2 * number - 1))
            label = "isolated star" if scene == "isolated" else "Q2237+0305, images"
            _points(axis, x, [getattr(one, what) for one in some], label)
        quads = [one for one in outcomes if one.scene == "quad"]
        if what == "position" and quads:
            x = np.array([one.snr for one in quads]) * 1.1
            _points(axis, x, [one.galaxy for one in quads], "Q2237+0305, lens galaxy")
        axis.set_title(f"one star; a quad on its lens galaxy: {what}", fontsize=10)
        _log_ticks(axis, sorted({one.snr for one in outcomes}))
    axes[1, 1].set_xlabel("S/N in the crowd (of the faintest image)")
    for axis in axes[:, 0]:
        axis.set_ylabel("scatter of fits / forecast")
    for axis in axes.ravel():
        axis.axhline(1, color="black", linewidth=0.8)
        axis.grid(alpha=0.3)
        axis.legend(fontsize=8)
    figure.savefig(path, dpi=100)


def _points(axis: Axes, x: np.ndarray, ratios: list[tuple[float, float]], label: str) -> None:
    value, error = np.array(ratios).T
    axis.errorbar(x, value, error, fmt="o-", markersize=3, linewidth=0.8, capsize=2, label=label)


def _log_ticks(axis: Axes, values: list[float]) -> None:
    axis.set_xscale("log")
    axis.set_xticks(values, [f"{value:g}" for value in values])
    axis.minorticks_off()

"""Run time against error, one panel a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

mpl.use("Agg")

COLOURS = {
    "galsim": "tab:orange",
    "galsim_sum": "tab:red",
    "photutils": "tab:green",
    "pixel_grid": "tab:purple",
}
# where the label stands: offset in points, horizontal alignment
LABELS = {
    "galsim": ((0, 6), "center"),
    "galsim_sum": ((-6, -3), "right"),
    "photutils": ((6, -3), "left"),
    "pixel_grid": ((0, 6), "center"),
}


def plot(results: dict[str, Any], path: Path) -> None:
    """Draw all scenes on common axes, ours as a line, the others as labelled points."""
    scenes = results["scenes"]
    columns = min(3, len(scenes))
    lines = -(-len(scenes) // columns)
    figure = Figure(figsize=(4.6 * columns, 3.7 * lines), layout="constrained")
    axes = figure.subplots(lines, columns, sharex=True, squeeze=False)
    for axis in axes.ravel()[len(scenes) :]:
        axis.set_visible(False)
    for axis, (scene, rows) in zip(axes.ravel(), scenes.items(), strict=False):
        _panel(axis, [row for row in rows if row.get("error")])
        axis.set_title(scene, fontsize=10)
    for axis in axes[-1]:
        axis.set_xlabel("largest error over the peak")
    for axis in axes[:, 0]:
        axis.set_ylabel("run time, s")
    figure.savefig(path, dpi=110)


def _panel(axis: Axes, rows: list[dict[str, Any]]) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlim(2e-13, 30)
    axis.set_xticks([10.0**-d for d in range(0, 13, 3)])
    axis.grid(alpha=0.3)
    ours = [row for row in rows if row["renderer"] == "ours"]
    axis.plot(
        [row["error"] for row in ours],
        [row["time_s"] for row in ours],
        "o-",
        color="tab:blue",
        markersize=4,
        label="napari-issis",
    )
    if ours:
        axis.annotate(
            "napari-issis",
            (ours[-1]["error"], ours[-1]["time_s"]),
            textcoords="offset points",
            xytext=(0, 7),
            ha="left",
            fontsize=8,
            color="tab:blue",
        )
    times = [row["time_s"] for row in rows]
    if times:
        axis.set_ylim(0.4 * min(times), 4 * max(times))
    for row in rows:
        if row["renderer"] == "ours":
            continue
        colour = COLOURS[row["renderer"]]
        axis.plot(row["error"], row["time_s"], "s", color=colour, markersize=5)
        offset, align = LABELS[row["renderer"]]
        axis.annotate(
            row["label"],
            (row["error"], row["time_s"]),
            textcoords="offset points",
            xytext=offset,
            ha=align,
            fontsize=7.5,
            color=colour,
        )

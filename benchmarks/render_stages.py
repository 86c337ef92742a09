"""CPU time of the renderer's stages on one core, beside that of bare transforms.

``python render_stages.py [scene ...]`` prints a table. *Bare* is what the fine meshes' transforms
take on lines that lie in memory one after the other, with nothing copied, filtered or folded: no
program that convolves on these meshes with this FFT can be faster.
"""

from __future__ import annotations

import os
import sys
from collections import defaultdict
from collections.abc import Callable
from functools import wraps
from time import process_time
from typing import Any

import numpy as np
from scipy import fft

from napari_issis import count_rate
from napari_issis.render import meshes, near, stamps
from napari_issis.render.near import Axis
from speed_scenes import REFERENCE_SCENES, load_scene, moved

TOLERANCES = (1e-3, 1e-6, 1e-10)
STAGES = {
    "stamps": ((stamps, "_add_points"), (stamps, "_add_extended")),
    "painting": (
        (near, "paint"),
        (near, "paint_discs"),
        (meshes, "paint"),
        (meshes, "paint_discs"),
    ),
    "fine meshes": ((near, "_at_pixels"),),
    "coarse meshes": (
        (meshes._Mesh, "transform"),
        (meshes._Mesh, "rate"),
        (meshes._Mesh, "pass_on"),
        (meshes, "add_up"),
    ),
}
CALLS = 8
LINES = 16


def main(scenes: list[str]) -> None:
    """Print the table; each row is the quickest of several calls."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    spent: dict[str, float] = defaultdict(float)
    axes: list[tuple[Axis, Axis, np.dtype[Any]]] = []
    for stage, functions in STAGES.items():
        for owner, name in functions:
            setattr(owner, name, _timed(getattr(owner, name), stage, spent))
    keep = near._at_pixels

    def at_pixels(rows: Any, y: Axis, x: Axis, *rest: Any) -> Any:
        axes.append((y, x, rows.dtype))
        return keep(rows, y, x, *rest)

    near._at_pixels = at_pixels  # type: ignore[assignment]
    print("| scene | tolerance | total ms |", " | ".join(STAGES), "| bare |")
    print("|---" * (len(STAGES) + 4) + "|")
    for scene in scenes:
        table, observation = load_scene(scene)
        for tolerance in TOLERANCES:
            count_rate(table, observation, tolerance=tolerance)
            best, least, bare = {}, np.inf, np.inf
            for call in range(CALLS):
                spent.clear()
                axes.clear()
                sources = moved(table, 1e-3 * (call + 1))
                start = process_time()
                count_rate(sources, observation, tolerance=tolerance)
                total = process_time() - start
                if total < least:
                    best, least = dict(spent), total
                bare = min(bare, sum(_bare(*one, observation.shape) for one in axes))
            row = [least, *(best.get(stage, 0.0) for stage in STAGES), bare]
            print(f"| {scene} | {tolerance:.0e} |", " | ".join(f"{1e3 * s:.1f}" for s in row), "|")


def _timed(function: Callable[..., Any], stage: str, spent: dict[str, float]) -> Callable[..., Any]:
    @wraps(function)
    def timed(*args: Any, **kwargs: Any) -> Any:
        start = process_time()
        result = function(*args, **kwargs)
        spent[stage] += process_time() - start
        return result

    return timed


def _bare(y: Axis, x: Axis, dtype: np.dtype[Any], shape: tuple[int, int]) -> float:
    """Seconds for the lines that a fine mesh transforms, from a few of them."""
    real = np.ones((LINES, x.count), dtype)
    column = np.ones((LINES, y.count), np.result_type(dtype, np.complex64))
    folded = np.ones((LINES, y.period), column.dtype)
    row = np.ones((LINES, x.period // 2 + 1), column.dtype)
    seconds = 0.0
    transforms: tuple[tuple[int, Callable[[], Any]], ...] = (
        (y.painted, lambda: fft.rfft(real)),
        (x.modes + 1, lambda: fft.fft(column, overwrite_x=True)),
        (x.modes + 1, lambda: fft.ifft(folded, overwrite_x=True)),
        (shape[0], lambda: fft.irfft(row, x.period)),
    )
    for lines, transform in transforms:
        times = []
        for _ in range(3):
            start = process_time()
            transform()
            times.append(process_time() - start)
        seconds += min(times) * lines / LINES
    return seconds


if __name__ == "__main__":
    main(sys.argv[1:] or list(REFERENCE_SCENES))

"""Run time against the number of stars: ``python scaling.py [--quick]`` prints JSON."""

from __future__ import annotations

import json
import statistics
import sys
from time import perf_counter
from typing import Any

from napari_issis import Observation, count_rate, random_sources
from speed_scenes import load_scene, moved

TOLERANCE = 1e-6


def main(quick: bool) -> list[dict[str, Any]]:
    """Time random stars in both frames."""
    _, observation = load_scene("stars500")
    rows = []
    # same densities in both frames: 16 times as many stars in 16 times the area
    counts = (10, 100, 625) if quick else (10, 100, 625, 1000, 6250, 10_000, 100_000)
    for side in (512, 2048):
        for count in counts:
            rows.append(_time(count, observation.replace(shape=(side, side))))
        if quick:
            rows.append(_time(10_000, observation.replace(shape=(side, side))))
    return rows


def _time(count: int, observation: Observation) -> dict[str, Any]:
    table = random_sources("point", count, shape=observation.shape, seed=count)
    times = []
    for call in range(4):
        shifted = moved(table, 1e-3 * call)
        start = perf_counter()
        count_rate(shifted, observation, tolerance=TOLERANCE)
        times.append(perf_counter() - start)
    return {
        "side": observation.shape[0],
        "stars": count,
        "time_s": statistics.median(times[1:]),
    }


if __name__ == "__main__":
    print(json.dumps(main("--quick" in sys.argv)))

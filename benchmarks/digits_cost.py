"""What seven more digits cost: ``python digits_cost.py SCENE [--quick]`` prints one line of JSON.

Calls at 1e-3 and at 1e-10 take turns in one process: between two processes a shared machine
may be half as fast again.
"""

from __future__ import annotations

import json
import statistics
import sys
from time import perf_counter

from napari_issis import count_rate
from speed_scenes import FIELD, load_scene, moved

COARSE, FINE = 1e-3, 1e-10


def main(scene: str, *, quick: bool) -> dict[str, float]:
    """Median seconds of calls at either tolerance, each with a table of its own."""
    table, observation = load_scene(scene)
    rounds = 1 if quick else 5 if scene == FIELD else 15
    times: dict[float, list[float]] = {COARSE: [], FINE: []}
    for number in range(rounds + 1):
        for tolerance, taken in times.items():
            sources = moved(table, 1e-3 * number)
            start = perf_counter()
            count_rate(sources, observation, tolerance=tolerance)
            if number:  # the first one makes what is kept
                taken.append(perf_counter() - start)
    return {
        "coarse_s": statistics.median(times[COARSE]),
        "fine_s": statistics.median(times[FINE]),
    }


if __name__ == "__main__":
    print(json.dumps(main(sys.argv[1], quick="--quick" in sys.argv)))

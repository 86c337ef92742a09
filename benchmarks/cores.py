"""Run time on one core and on several, without numba and with it, each in its own process (Linux).

``python cores.py [scene ...]`` prints a table. A process is bound to so many cores before it
imports anything, so that all libraries in it know of no more.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
from time import perf_counter

TOLERANCES = (1e-3, 1e-6, 1e-10)
CALLS = 9
SCENES = ("stars500", "exponential100", "devaucouleurs100", "uniform100", "gaussian100")


def main(scenes: list[str]) -> None:
    """Print the table, times as medians over calls that each see a new table."""
    available = len(os.sched_getaffinity(0))
    counts = sorted({1, min(2, available), min(8, available)})
    cases = [(n, numba) for n in counts for numba in ("without", "with")]
    heads = (f"{n} core{'s' * (n > 1)}, {numba} numba: ms" for n, numba in cases)
    print("| scene | tolerance |", " | ".join(heads), "|")
    print("|---" * (len(cases) + 2) + "|")
    for scene in scenes:
        columns = [_times(scene, *case) for case in cases]
        for tolerance, *row in zip(TOLERANCES, *columns, strict=True):
            cells = " | ".join(f"{1e3 * seconds:.0f}" for seconds in row)
            print(f"| {scene} | {tolerance:.0e} | {cells} |")


def _times(scene: str, cores: int, numba: str) -> list[float]:
    command = [sys.executable, "-W", "ignore", __file__, "--one", scene, str(cores), numba]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [float(line) for line in printed.split()]


def one(scene: str, cores: int, numba: str) -> None:
    """Print the seconds at each tolerance on some cores."""
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:cores])
    if numba == "without":
        sys.modules["numba"] = None  # type: ignore[assignment]  # as if it were not installed
    from napari_issis import count_rate
    from speed_scenes import load_scene, moved

    table, observation = load_scene(scene)
    for tolerance in TOLERANCES:
        count_rate(table, observation, tolerance=tolerance)
        times = []
        for call in range(CALLS):
            sources = moved(table, 1e-3 * (call + 1))
            start = perf_counter()
            count_rate(sources, observation, tolerance=tolerance)
            times.append(perf_counter() - start)
        print(statistics.median(times))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        one(sys.argv[2], int(sys.argv[3]), sys.argv[4])
    else:
        main(sys.argv[1:] or list(SCENES))

"""How long a forecast takes: ``python benchmarks/forecast_time.py [STARS ...]``.

Wall-clock and processor time for fields of stars of 512 x 512 pixels and for ten galaxies, median
of three tables that were not seen before; what depends on the observation alone is kept.
"""

from __future__ import annotations

import sys
from time import perf_counter, process_time

import numpy as np

import napari_issis as ni
from machine import machine


def main() -> None:
    print(machine())
    observation = ni.Observation(exposure=1000)
    fields = [("point", int(count)) for count in sys.argv[1:] or (100, 500, 2000)]
    for kind, count in (*fields, ("exponential", 10), ("devaucouleurs", 10)):
        ni.forecast(ni.random_sources("point", 3, seed=9), observation)
        times = []
        for seed in range(3):
            table = ni.random_sources(kind, count, seed=seed)
            wall, processor = perf_counter(), process_time()
            ni.forecast(table, observation)
            times.append((perf_counter() - wall, process_time() - processor))
        wall, processor = np.median(times, axis=0)
        print(f"{count} {kind}: {wall:.2f} s, {processor:.2f} s of the processor", flush=True)


if __name__ == "__main__":
    main()

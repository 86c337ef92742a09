"""How long aperture photometry takes: ``python benchmarks/photometry_time.py [STARS]``.

Wall-clock and processor time for one field of stars, 10,000 by default, with each kind of sky.
"""

from __future__ import annotations

import sys
from time import perf_counter, process_time

import napari_issis as ni
from machine import machine


def main() -> None:
    print(machine())
    count = int(sys.argv[1]) if sys.argv[1:] else 10_000
    stars = ni.random_sources("point", count, seed=0)
    exposure = ni.simulate(stars, ni.Observation(exposure=1000), seed=1)
    ni.aperture_photometry(exposure, rows=0)
    for sky in ("known", "mean", "median"):
        wall, processor = perf_counter(), process_time()
        ni.aperture_photometry(exposure, sky=sky)
        wall, processor = perf_counter() - wall, process_time() - processor
        print(f"{count} stars, sky {sky}: {wall:.2f} s, {processor:.2f} s of the processor")


if __name__ == "__main__":
    main()

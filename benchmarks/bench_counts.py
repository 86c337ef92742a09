"""Time the Poisson counts against numpy's generator, side by side.

Run with ``python benchmarks/bench_counts.py``. Each figure is the best of several
single-threaded runs, the two taken in turn; the uniform numbers are cached, as they are
whenever a scene is edited, and their cost is given apart.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter

import numpy as np

from napari_issis import counts as counts_module
from napari_issis.counts import pixel_uniforms, poisson_counts

RUNS = 9


def best(*functions: Callable[[], object], runs: int = RUNS) -> list[float]:
    times = [[_time(f) for f in functions] for _ in range(runs + 1)][1:]
    return [1e3 * min(column) for column in zip(*times, strict=True)]


def _time(function: Callable[[], object]) -> float:
    start = perf_counter()
    function()
    return perf_counter() - start


def main() -> None:
    rng = np.random.default_rng(1)
    print(f"{'frame':>6} {'lambda':>12} {'counts/ms':>10} {'numpy/ms':>9} {'ratio':>6}")
    for n, lam in [(512, v) for v in (0.03, 1.0, 3.0, 9.9, 10.0, 30.0, 1e3, 1e6)] + [(2048, 10.0)]:
        _row(n, f"{lam:g}", np.full((n, n), lam), rng)
    _row(512, "0.01..1e4", 10 ** rng.uniform(-2, 4, (512, 512)), rng)

    before = np.full((512, 512), 10.0)
    after = before.copy()
    after[200:230, 300:330] += 1
    previous = before, poisson_counts(before, 0)
    whole, part = best(
        lambda: poisson_counts(after, 0), lambda: poisson_counts(after, 0, previous=previous)
    )
    print(f"30 x 30 pixels of 512 x 512 changed: {part:.2f} ms, all of them again {whole:.2f} ms")
    bright = np.full((512, 512), 1e3)
    ideal, dead = best(
        lambda: poisson_counts(bright, 0), lambda: poisson_counts(bright, 0, dead_share=4.6e-6)
    )
    print(f"a dead time of 4.6e-6 exposures at 1000 counts: {dead:.1f} ms, none {ideal:.1f} ms")
    for n in (512, 2048):
        (fresh,) = best(partial(_fresh_uniforms, n), runs=2)
        print(f"uniforms and normals of a new seed, {n} x {n}: {fresh:.1f} ms")


def _fresh_uniforms(n: int) -> None:
    counts_module._uniforms_and_normals.cache_clear()
    pixel_uniforms(0, (n, n))


def _row(n: int, name: str, expected: np.ndarray, rng: np.random.Generator) -> None:
    ours, numpys = best(
        lambda: poisson_counts(expected, 0),
        lambda: rng.poisson(expected),
        runs=RUNS if n < 1000 else 3,
    )
    print(f"{n:>6} {name:>12} {ours:>10.2f} {numpys:>9.2f} {ours / numpys:>6.2f}")


if __name__ == "__main__":
    main()

"""Time moves and edits of a single source.

``python drag_times.py [--quick]`` prints one line of JSON.
"""

from __future__ import annotations

import json
import sys
from time import perf_counter
from typing import Any

import galsim
import numpy as np
from astropy.table import QTable, vstack

from napari_issis import Drag, Observation, TelescopePSF, count_rate, source
from renderer_galsim import convolved, galsim_psf, profiles
from speed_scenes import EXTENDED, FIELD, field, load_scene

MOVES = 200
TOLERANCE = 1e-5
FINAL_TOLERANCE = 1e-8


def main(quick: bool) -> list[dict[str, Any]]:
    """Drag a star and a galaxy of each kind through both frames."""
    rows = []
    small = load_scene("stars500")
    _, wide = load_scene(FIELD)
    scenes = [small] if quick else [small, (field(10_000, 0, 2048), wide)]
    for others, observation in scenes:
        for kind in ("point", *EXTENDED):
            moves = 20 if quick else MOVES
            rows.append(_drag(kind, others, observation, moves))
    return rows


def _drag(kind: str, others: QTable, observation: Observation, moves: int) -> dict[str, Any]:
    side = observation.shape[0]
    path = np.linspace(0.3 * side, 0.7 * side, moves)
    result: dict[str, Any] = {"kind": kind, "side": side, "others": len(others), "moves": moves}
    result |= _galsim_ms(source(kind, path[0], path[0], r_half=30.0), observation)
    moving = [source(kind, x, 0.5 * side + 0.1 * (x - path[0]), r_half=30.0) for x in path]
    start = perf_counter()
    drag = Drag(vstack([others, moving[0]]), observation, [len(others)], tolerance=TOLERANCE)
    result["start_ms"] = 1e3 * (perf_counter() - start)
    times = _times(drag, moving)
    rate = drag.rate.copy()
    full = count_rate(vstack([others, moving[-1]]), observation, tolerance=FINAL_TOLERANCE)
    error = float(np.abs(rate - full).max() / full.max())
    if kind != "point":
        sizes, angles = np.linspace(10.0, 30.0, moves), np.linspace(0.0, 90.0, moves)
        edited = [
            source(kind, path[0], 0.5 * side, r_half=r, ellipticity=0.3, pa=pa)
            for r, pa in zip(sizes, angles, strict=True)
        ]
        result["edited_ms"] = float(np.median(_times(drag, edited)))
    return result | {
        "median_ms": float(np.median(times)),
        "max_ms": float(np.max(times)),
        "error": error,
    }


def _times(drag: Drag, tables: list[QTable]) -> list[float]:
    """Milliseconds that each of some moves takes."""
    times = []
    for table in tables:
        start = perf_counter()
        drag.move(table)
        times.append(1e3 * (perf_counter() - start))
    return times


def _galsim_ms(table: QTable, observation: Observation) -> dict[str, float]:
    """Median time for GalSim to draw the source again elsewhere, its profile unchanged."""
    assert isinstance(observation.psf, TelescopePSF)
    psf = galsim_psf(observation.psf)
    drawn = convolved(profiles(table, observation, psf.gsparams)[0], psf)
    times = []
    for move in range(6):
        start = perf_counter()
        center = galsim.PositionD(200 + 1.1 * move, 200.0)
        drawn.drawImage(center=center, scale=observation.pixel_scale, dtype=float)
        times.append(1e3 * (perf_counter() - start))
    return {"galsim_ms": float(np.median(times[1:]))}


if __name__ == "__main__":
    print(json.dumps(main("--quick" in sys.argv)))

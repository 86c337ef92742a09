"""Time one renderer on one scene in a process of its own; called by run_time.py.

``python one_point.py '{"scene": ..., "renderer": ..., "options": {...}}' image.npy`` prints
one line of JSON and writes the image of the first call.
"""

from __future__ import annotations

import importlib
import json
import resource
import statistics
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

MODULES = {
    "ours": ("renderer_ours", "ours"),
    "galsim": ("renderer_galsim", "stamps"),
    "galsim_sum": ("renderer_galsim", "one_sum"),
    "photutils": ("renderer_photutils", "stamps"),
    "pixel_grid": ("renderer_pixel_grid", "pixel_grid"),
}
# seconds of a first call from which on it is the only one, for other programs
SLOW = 20.0
FAST = 1.0


def main(request: dict[str, Any], image_path: Path) -> dict[str, Any]:
    """Time the calls; every call has a table of its own, a thousandth of a pixel further."""
    start = perf_counter()
    import napari_issis  # noqa: F401

    result: dict[str, Any] = {"import_s": perf_counter() - start}
    import numpy as np

    import renderer_ours
    from speed_scenes import load_scene, moved

    module, function = MODULES[request["renderer"]]
    make = getattr(importlib.import_module(module), function)
    table, observation = load_scene(request["scene"])
    ours = request["renderer"] == "ours"
    bare = peak_memory()
    loaded = renderer_ours.load_compiled() if ours else 0.0
    before = peak_memory()
    draw = make(observation, **request["options"])
    start = perf_counter()
    try:
        image = draw(table)
    except (ValueError, RuntimeError) as error:
        return result | {"refused": f"{type(error).__name__}: {error}"}
    first = perf_counter() - start
    if ours:
        result |= {"compiled_s": loaded, "compiled_mb": before - bare}
        first += loaded if renderer_ours.used_compiled() else 0.0
    calls = request["calls"] or (5 if first < FAST else 3)
    times = []
    for call in range(0 if first > SLOW and not ours else calls):
        next_table = moved(table, 1e-3 * (call + 1))
        start = perf_counter()
        draw(next_table)
        times.append(perf_counter() - start)
    result |= {"first_s": first, "times_s": times, "time_s": statistics.median(times or [first])}
    result["memory_mb"] = peak_memory() - before
    np.save(image_path, image)
    return result


def peak_memory() -> float:
    """Largest resident memory of this process so far, MB."""
    status = Path("/proc/self/status")
    if status.exists():  # ru_maxrss would start from the parent's memory on Linux
        for line in status.read_text(encoding="ascii").splitlines():
            if line.startswith("VmHWM"):
                return float(line.split()[1]) / 1024
    unit = 1024**2 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


if __name__ == "__main__":
    print(json.dumps(main(json.loads(sys.argv[1]), Path(sys.argv[2]))))

"""Run time against error, beside other programs; writes docs/speed.md and its picture.

Run it by ``python benchmarks/run_time.py``; it needs the extra ``bench``. ``--quick`` takes a
few points only, ``--scene`` one scene, ``--full`` also the points of several minutes;
``--page`` writes the page again from the figures kept in benchmarks/results.json.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from exact_pixels import load_exact
from fft_floor import fft_pair_seconds
from image_errors import image_errors, pixel_error
from machine import machine
from points import Point, points
from speed_page import write_page
from speed_plot import plot
from speed_scenes import FIELD, SCENES, load_scene, reference_image
from subprocess_json import run_json

ROOT = Path(__file__).parents[1]
RESULTS = Path(__file__).parent / "results.json"
# a reference image serves for errors this many times its own, which pixels integrated exactly
# tell; smaller errors are those at these pixels
REFERENCE_MARGIN = 10


def main() -> None:
    """Measure what is asked for and write page, picture and figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", choices=SCENES)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--page", action="store_true")
    options = parser.parse_args()
    if options.page:
        results = json.loads(RESULTS.read_text(encoding="utf-8"))
    else:
        results = measure(options.scene, quick=options.quick, full=options.full)
        RESULTS.write_text(json.dumps(results, indent=1), encoding="utf-8")
    plot(results, ROOT / "docs" / "pictures" / "speed.png")
    print(write_page(results, ROOT / "docs" / "speed.md"))


def measure(chosen: str | None, *, quick: bool, full: bool) -> dict[str, Any]:
    """Measure everything and return the figures."""
    results: dict[str, Any] = {
        "date": date.today().isoformat(),
        "machine": machine(),
        "quick": quick,
        "scenes": {},
        "checks": {},
        "digits": {},
    }
    flags = ("--quick",) if quick else ()
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES if chosen is None else (chosen,):
            rows = measure_scene(points(scene, quick=quick, full=full), Path(folder))
            results["checks"][scene] = compare(scene, rows)
            for row in rows:
                row.pop("image", None)
            results["scenes"][scene] = rows
            results["digits"][scene] = run_json("digits_cost.py", scene, *flags)
    results["floor"] = {str(side): fft_pair_seconds(side) for side in (512, 2048)}
    if chosen is None:
        print("drags", flush=True)
        results["drags"] = run_json("drag_times.py", *flags)
        print("scaling", flush=True)
        results["scaling"] = run_json("scaling.py", *flags)
    return results


def measure_scene(to_measure: list[Point], folder: Path) -> list[dict[str, Any]]:
    """Time every point of a scene; ``image`` in a row is the file of what it drew."""
    rows = []
    for number, point in enumerate(to_measure):
        path = folder / f"{point.scene}-{number}.npy"
        row = run_json("one_point.py", json.dumps(point.request()), str(path))
        row |= {"label": point.label, "renderer": point.renderer, "tolerance": point.tolerance}
        comparable = point.whole and "refused" not in row
        rows.append(row | {"image": str(path)} if comparable else row)
        print(point.scene, point.label, row.get("refused") or f"{row['time_s']:.3g} s", flush=True)
    return rows


def compare(scene: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Add the errors to a scene's rows; return the reference's own error at the exact pixels.

    The reference of the large field is our image of the smallest tolerance.
    """
    drawn = [row for row in rows if "image" in row]
    ours = [row for row in drawn if row["tolerance"]]
    if scene != FIELD:
        reference = reference_image(scene)
    elif ours:
        reference = np.load(min(ours, key=lambda row: float(row["tolerance"]))["image"])
    else:
        return {}
    sky = load_scene(scene)[1].sky_rate
    peak = float(reference.max())
    pixels, rates = load_exact(scene)
    own_error = pixel_error(reference, pixels, rates) / peak
    for row in drawn:
        image = np.load(row["image"])
        errors = image_errors(image, reference, sky)
        if len(pixels) and errors["error"] < REFERENCE_MARGIN * own_error:
            row |= {"error": pixel_error(image, pixels, rates) / peak, "sampled": True}
        elif errors["error"]:
            row |= errors
    return {"exact_pixels": len(pixels), "reference_error": own_error}


if __name__ == "__main__":
    main()

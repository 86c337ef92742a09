"""Errors and run times on the reference images, written to docs/accuracy.md.

Run it by ``python benchmarks/reference_images.py``.
"""

import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

import napari_issis as ni  # noqa: E402
from test_reference_images import NAMES, load  # noqa: E402

TOLERANCES = (1e-3, 1e-6, 1e-8)
HEAD = """# Accuracy

Largest error of any pixel over the image's peak, and run time in seconds, on scenes whose exact
images were made by an independent program (`tests/data`). Two shared cores; the time is that of
the second call, with all sources moved by a thousandth of a pixel. Made by
`python benchmarks/reference_images.py`.

The 512 x 512 scenes are seen through a monochromatic, hardly blurred telescope PSF with sharp
diffraction rings, which is harder than the averaged PSFs of the two channels.

"""


def main() -> None:
    """Render every scene at every tolerance and write the table."""
    lines = ["| scene | " + " | ".join(f"tolerance {t:.0e} | s" for t in TOLERANCES) + " |"]
    lines.append("|---" * (1 + 2 * len(TOLERANCES)) + "|")
    for name in NAMES:
        table, observation, expected = load(name)
        cells = []
        for tolerance in TOLERANCES:
            image = ni.count_rate(table, observation, tolerance=tolerance)
            error = float(np.abs(image - expected).max() / expected.max())
            moved = table.copy()
            moved["x"] += 1e-3
            start = time.perf_counter()
            ni.count_rate(moved, observation, tolerance=tolerance)
            cells.append(f"{error:.1e} | {time.perf_counter() - start:.2f}")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    (ROOT / "docs" / "accuracy.md").write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

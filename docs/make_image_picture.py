"""Make the picture of ``images.md``: its first example, run as it stands there.

Run it by ``python docs/make_image_picture.py``.
"""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import napari_issis as ni

DOCS = Path(__file__).parent
SIDE = 360
# pixels of the frame that are shown about its centre
HALF = 60


def panel(values: Any) -> Image.Image:
    """Draw an array on a square-root scale, row 0 at the bottom."""
    scaled = np.sqrt(np.clip(values / np.percentile(values, 99.9), 0, 1))
    drawn = Image.fromarray(np.uint8(np.rint(255 * scaled[::-1])))
    return drawn.resize((SIDE, SIDE), Image.Resampling.NEAREST)


def main() -> None:
    """Write ``pictures/images.png``."""
    text = (DOCS / "images.md").read_text(encoding="utf-8")
    match = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert match is not None
    names: dict[str, Any] = {}
    warnings.simplefilter("ignore", ni.CountRateWarning)
    exec(compile(match[1], "images.md", "exec"), names)
    exposure = names["exposure"]
    shown = (slice(256 - HALF, 256 + HALF + 1),) * 2
    panels = [names["arcs"], exposure.expected[shown], exposure.counts[shown]]
    picture = Image.new("L", (len(panels) * (SIDE + 10) - 10, SIDE), 255)
    for place, values in enumerate(panels):
        picture.paste(panel(values), (place * (SIDE + 10), 0))
    picture.save(DOCS / "pictures" / "images.png")


if __name__ == "__main__":
    main()

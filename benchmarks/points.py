"""The points measured: a renderer with its options on a scene."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from speed_scenes import FIELD, SCENES

TOLERANCES = tuple(10.0**-d for d in range(2, 11))
FIELD_TOLERANCES = (1e-3, 1e-6, 1e-8, 1e-10)
# GalSim takes some hundred times longer for these than for other galaxies
WITHOUT = "GalSim, no de Vaucouleurs"
QUICK_TOLERANCES = (1e-3, 1e-6)
QUICK_FIELD_TOLERANCES = (1e-3, 1e-6)


@dataclass(frozen=True)
class Point:
    """One renderer on one scene; ``calls`` is 0 where the number of calls follows the time."""

    scene: str
    renderer: str
    label: str
    options: dict[str, Any] = field(default_factory=dict)
    calls: int = 0

    @property
    def whole(self) -> bool:
        """Whether all sources are drawn, so that the image can be compared."""
        return "without" not in self.options

    @property
    def tolerance(self) -> float | None:
        """Tolerance asked for, None for peers."""
        value = self.options.get("tolerance")
        return None if value is None else float(value)

    def request(self) -> dict[str, Any]:
        """Return the point as `one_point.py` takes it."""
        return asdict(self)


def points(chosen: str | None, *, quick: bool, full: bool) -> list[Point]:
    """Points of all scenes or of the chosen one, ours first."""
    found = []
    for scene in SCENES:
        if chosen in (None, scene):
            found += _ours(scene, quick)
            found += _quick_peers(scene) if quick else _peers(scene, full)
    return found


def _ours(scene: str, quick: bool) -> list[Point]:
    tolerances: tuple[float, ...]
    if scene == FIELD:
        tolerances = QUICK_FIELD_TOLERANCES if quick else FIELD_TOLERANCES
    else:
        tolerances = QUICK_TOLERANCES if quick else TOLERANCES
    calls = 1 if quick else 0
    return [
        Point(scene, "ours", f"napari-issis {t:.0e}", {"tolerance": t}, calls) for t in tolerances
    ]


def _quick_peers(scene: str) -> list[Point]:
    found = []
    if scene != "devaucouleurs100":
        found.append(Point(scene, "galsim", "GalSim", calls=1))
    if scene == FIELD:
        found = [Point(scene, "galsim", WITHOUT, {"without": "devaucouleurs"}, calls=1)]
    else:
        found.append(Point(scene, "pixel_grid", "paper's way", calls=1))
    return found


def _peers(scene: str, full: bool) -> list[Point]:
    found = [
        Point(scene, "galsim", "GalSim"),
        Point(scene, "pixel_grid", "paper's way"),
    ]
    if full or scene != FIELD:
        found.append(Point(scene, "pixel_grid", "paper's way, 3x", {"oversampling": 3}))
        found.append(Point(scene, "galsim_sum", "GalSim, one sum"))
    if full or scene not in (FIELD, "devaucouleurs100"):
        tight = {"setting": "tight"}
        found.append(Point(scene, "galsim_sum", "GalSim tight, one sum", tight))
        found.append(Point(scene, "galsim", "GalSim tight", tight))
    if scene == FIELD:
        found.append(Point(scene, "galsim", WITHOUT, {"without": "devaucouleurs"}))
    if scene == "stars500":
        for size in (25, 101):
            found.append(Point(scene, "photutils", f"photutils {size} px", {"size": size}))
    return found

"""What the run times and memory are held against."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from points import WITHOUT

# scene: fraction of GalSim's default time that a tolerance of 1e-6 may take
GALSIM_FRACTION = {
    "stars500": 1 / 10,
    "exponential100": 1 / 2,
    "devaucouleurs100": 1 / 100,
    "uniform100": 1 / 2,
    "gaussian100": 1 / 2,
    "field2048": 1 / 10,
}
PAPER_FACTOR = 3.0
DIGITS_FACTOR = 4.0
MEMORY_MB = {512: 200.0, 2048: 2000.0}


@dataclass(frozen=True)
class Target:
    """A figure and the most it may be; ``value`` is None where it could not be measured."""

    scene: str
    what: str
    value: float | None
    limit: float
    unit: str

    @property
    def verdict(self) -> str:
        """Met or missed, and by which factor."""
        if self.value is None:
            return "missed: no result"
        ratio = self.value / self.limit
        return f"met, {ratio:.2f} of it" if ratio <= 1 else f"missed by {ratio:.2f} times"


def targets(
    scenes: dict[str, list[dict[str, Any]]], digits: dict[str, dict[str, float]]
) -> list[Target]:
    """Every target whose two sides were asked for; ``digits`` are those of `digits_cost`."""
    found = []
    for scene, rows in scenes.items():
        ours = {row["tolerance"]: row for row in rows if row.get("renderer") == "ours"}
        peers = {row["label"]: row.get("time_s") for row in rows}
        galsim, paper = peers.get("GalSim"), peers.get("paper's way")

        def time_at(tolerance: float, ours: dict[float, dict[str, Any]] = ours) -> float | None:
            return ours[tolerance].get("time_s") if tolerance in ours else None

        if galsim:
            fraction = GALSIM_FRACTION[scene]
            what = f"1e-6, against 1/{1 / fraction:.0f} of GalSim default"
            found.append(Target(scene, what, time_at(1e-6), fraction * galsim, "s"))
        strict = peers.get(WITHOUT)
        if strict:
            what = "1e-6, against 1/10 of GalSim, which leaves out de Vaucouleurs"
            found.append(Target(scene, what, time_at(1e-6), 0.1 * strict, "s"))
        if paper:
            what = f"1e-3, against {PAPER_FACTOR:.0f} x the paper's way"
            found.append(Target(scene, what, time_at(1e-3), PAPER_FACTOR * paper, "s"))
        if scene in digits:
            cost = digits[scene]
            what = f"1e-10, against {DIGITS_FACTOR:.0f} x the time at 1e-3, by turns"
            found.append(Target(scene, what, cost["fine_s"], DIGITS_FACTOR * cost["coarse_s"], "s"))
        side = 2048 if scene == "field2048" else 512
        memory = [row["memory_mb"] for row in ours.values() if "memory_mb" in row]
        if memory:
            what = "memory, the most of all tolerances"
            found.append(Target(scene, what, max(memory), MEMORY_MB[side], "MB"))
    return found

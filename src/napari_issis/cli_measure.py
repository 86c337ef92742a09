"""The shell commands that measure a scene: a proposal sheet, aperture photometry."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .apertures import SKIES as SKY_LEVELS
from .apertures import aperture_photometry
from .cli_scene import PROGRAM, Parser, add_scene_options, expose_and_tell, read_scene
from .exposure_goal import checked_rows
from .result_table import SUFFIXES as TABLE_SUFFIXES
from .result_table import write_table
from .safe_write import check_target
from .sheet import GOALS, proposal_sheet
from .sheet import SUFFIXES as SHEET_SUFFIXES


def sheet(words: list[str]) -> None:
    """Write a proposal sheet."""
    parser = Parser(
        prog=f"{PROGRAM} sheet",
        description="Write a proposal sheet on a scene in both channels: one HTML page with "
        "pictures, settings, forecasts, exposure times, warnings and commands.",
    )
    add_scene_options(parser)
    parser.add_argument("--output", required=True, metavar="X.html", help="page to write")
    parser.add_argument(
        "--goal",
        nargs="+",
        action="append",
        default=[],
        metavar=("NAME", "VALUE ROW"),
        help=f"exposure time for a goal: {', '.join(GOALS)}, its value and the rows of the "
        "sources, such as --goal snr 20 3, --goal flux_ratio 0.01 0 1; can be repeated",
    )
    parser.add_argument(
        "--rows", type=int, nargs="+", help="rows whose forecast is shown; default: the brightest"
    )
    parser.add_argument("--title", default="", help="heading of the page")
    parser.add_argument("--notes", default="", help="text below the heading")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    options = parser.parse_args(words)
    goals = [_goal(words) for words in options.goal]
    check_target(options.output, SHEET_SUFFIXES, overwrite=options.overwrite)
    sources, observation = read_scene(options)
    for goal, words in zip(goals, options.goal, strict=True):
        _check_rows(goal, words, len(sources))
    proposal_sheet(
        sources,
        observation,
        options.output,
        seed=options.seed,
        goals=goals,
        rows=options.rows,
        title=options.title or options.scene,
        notes=options.notes,
        overwrite=options.overwrite,
    )
    print(f"wrote {options.output}")


def photometry(words: list[str]) -> None:
    """Simulate an exposure and measure its sources in apertures."""
    parser = Parser(
        prog=f"{PROGRAM} photometry",
        description="Simulate an exposure, measure its sources in apertures and write a table "
        "that compares them with the truth; needs photutils.",
    )
    add_scene_options(parser)
    parser.add_argument("--output", required=True, metavar="X.ecsv", help="table to write")
    parser.add_argument(
        "--radius", type=float, default=5.0, help="radius of a star's aperture, pixels; default: 5"
    )
    parser.add_argument(
        "--scale",
        type=float,
        default=2.0,
        help="apertures of extended sources over their half-light ellipse; default: 2",
    )
    parser.add_argument(
        "--level", choices=SKY_LEVELS, default="known", help="sky to subtract; default: known"
    )
    parser.add_argument(
        "--annulus",
        type=float,
        nargs=2,
        default=(2.0, 3.0),
        metavar=("IN", "OUT"),
        help="edges of the sky annulus over that of the aperture; default: 2 3",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    options = parser.parse_args(words)
    check_target(options.output, TABLE_SUFFIXES, overwrite=options.overwrite)
    exposure = expose_and_tell(*read_scene(options), options.seed, None)
    table = aperture_photometry(
        exposure,
        radius=options.radius,
        scale=options.scale,
        sky=options.level,
        annulus=tuple(options.annulus),
    )
    write_table(table, options.output, overwrite=options.overwrite)
    print(f"wrote {options.output}")


def _check_rows(goal: Mapping[str, Any], words: list[str], count: int) -> None:
    try:
        checked_rows(words[0], goal["rows"], count)
    except ValueError as error:
        raise ValueError(f"--goal is {' '.join(words)!r}: {error}") from error


def _goal(words: list[str]) -> Mapping[str, Any]:
    name, *rest = words
    try:
        value, rows = float(rest[0]), [int(row) for row in rest[1:]]
    except (ValueError, IndexError):
        rows = []
    if name not in GOALS or not rows:
        raise ValueError(
            f"--goal is {' '.join(words)!r}; give {', '.join(GOALS[:-1])} or {GOALS[-1]}, a number "
            "and the rows of the sources, such as --goal snr 20 3."
        )
    return {"rows": rows if len(rows) > 1 else rows[0], name: value}

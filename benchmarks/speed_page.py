"""The page docs/speed.md from the measured figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from targets import targets

HEAD = """# Run time against error

How long it takes from a source table to an image, and how far that image is from the truth, for
this package at several tolerances and for other programs in the same run. Made by
`python benchmarks/run_time.py` on {date}{quick}.

**Machine.** {machine}.
Threads are each program's default.

![Run time against error](pictures/speed.png)

**Scenes.** `stars500` and the four of 100 galaxies are the 512 x 512 reference images of
`tests/data`; `field2048` is 2048 x 2048 with 10,000 stars and 250 galaxies of each of four
kinds. All are seen through a monochromatic, hardly blurred telescope PSF with sharp diffraction
rings and an undersampled core, which is harder than the averaged PSFs of the two channels.

**Programs.** *GalSim* draws each source on a stamp of the size it finds good and adds it to the
frame, with its default accuracy; *one sum* draws the sum of all sources at once; *tight* has
smaller thresholds (folding 1e-3, maxk 1e-5, k and x values 1e-7). *photutils* adds stamps of a PSF
image oversampled 5 times. *The paper's way* paints stars on their nearest pixel and galaxies at
pixel centres and convolves by FFT with the PSF's transform kept, padded to twice the frame; *3x*
does so on a grid three times finer.

**Columns.**

* *time*: median of three calls or more (of other programs one, if it takes over 20 s), each
  with all sources moved by a thousandth of a pixel, so that no call sees a table a second time.
  Everything from table to image is timed; what depends on the observation alone may be kept
  from the first call.
* *first call*: the first one in a fresh interpreter, without imports (but with numba's, where it
  paints) and, for other programs, without the making of the PSF.
* *error*: largest of all pixels over the image's peak; *inside*: without a border of one pixel.
  The reference images were checked at 20 pixels by a quadrature that shares nothing with this
  package (`benchmarks/exact_pixels.py`; the difference stands below each table). Errors of less
  than ten times that difference, marked *, are those at the 20 pixels.
* *flux*: relative error of the frame's sum. *noise*: largest error in units of the Poisson noise
  of 100 s, sky included.
* *memory*: peak of the process beyond what it took after imports, numba's among them, which is
  loaded for large scenes only.
"""
FIELD_NOTE = """
*No de Vaucouleurs*: GalSim draws 250 galaxies less than this package does, those that it is slowest
with.

The reference of `field2048` is this package's image at the smallest tolerance drawn. Exact pixels
lie in the middle of the frame; all 11,000 sources are counted in them.
"""


def write_page(results: dict[str, Any], path: Path) -> str:
    """Write the page; return its targets table for the screen."""
    target_lines = _targets(results)
    sections = [
        HEAD.format(
            date=results["date"],
            machine=results["machine"],
            quick=" (quick: few points, single calls)" if results["quick"] else "",
        ),
        "## Targets\n",
        "*By turns*: calls at either tolerance alternate in one process (`digits_cost.py`), since "
        "the machine\nis not equally fast in two.\n",
        "\n".join(target_lines) + "\n",
    ]
    for scene, rows in results["scenes"].items():
        sections.append(f"## {scene}\n")
        sections.append("\n".join(_scene(rows, scene, results)) + "\n")
    if "drags" in results:
        sections += ["## One source moved\n", _drags(results["drags"])]
    if "scaling" in results:
        sections += ["## Number of stars\n", _scaling(results["scaling"])]
    path.write_text("\n".join(sections), encoding="utf-8")
    return "\n".join(target_lines)


def _targets(results: dict[str, Any]) -> list[str]:
    lines = ["| scene | what | measured | at most | |", "|---|---|---|---|---|"]
    for target in targets(results["scenes"], results["digits"]):
        value = "-" if target.value is None else f"{target.value:.3g} {target.unit}"
        limit = f"{target.limit:.3g} {target.unit}"
        lines.append(f"| {target.scene} | {target.what} | {value} | {limit} | {target.verdict} |")
    return lines


def _scene(rows: list[dict[str, Any]], scene: str, results: dict[str, Any]) -> list[str]:
    lines = [
        "| program | time s | first call s | error | inside | flux | noise | memory MB |",
        "|---" * 8 + "|",
    ]
    notes = []
    for row in rows:
        if "refused" in row:
            lines.append(f"| {row['label']} | refused | | | | | | |")
            notes.append(f"{row['label']}: {row['refused']}")
        else:
            mark = "*" if row.get("sampled") else ""
            if row["tolerance"] and row.get("error", 0.0) > row["tolerance"]:
                mark += " above tolerance"
            cells = [
                row["label"],
                f"{row['time_s']:.3g}",
                f"{row['first_s']:.3g}",
                _cell(row, "error", ".1e") + mark,
                _cell(row, "error_inside", ".1e"),
                _cell(row, "flux_error", "+.0e"),
                _cell(row, "poisson_error", ".1g"),
                f"{row['memory_mb']:.0f}",
            ]
            lines.append("| " + " | ".join(cells) + " |")
    side = "2048" if scene == "field2048" else "512"
    floor = results["floor"][side]
    lines.append(f"| one pair of FFTs, padded to twice the frame | {floor:.2g} | | | | | | |")
    imports = [row["import_s"] for row in rows if row.get("renderer") == "ours"]
    if imports:
        notes.append(f"Import of the package: {min(imports):.2g} s.")
    compiled = [row for row in rows if "compiled_s" in row]
    if compiled:
        seconds = min(row["compiled_s"] for row in compiled)
        memory = max(row["compiled_mb"] for row in compiled)
        notes.append(f"numba with what it has compiled: {seconds:.2g} s and {memory:.0f} MB more.")
    if side == "2048":
        notes.append(FIELD_NOTE.strip())
    notes += _checks(results["checks"][scene])
    return lines + [line for note in notes for line in ("", note)]


def _cell(row: dict[str, Any], name: str, how: str) -> str:
    return format(row[name], how) if name in row else ""


def _checks(check: dict[str, Any]) -> list[str]:
    if not check.get("exact_pixels"):
        return ["No pixels integrated exactly are kept for this scene: the reference is unchecked."]
    return [
        f"Reference image against {check['exact_pixels']} pixels integrated exactly: "
        f"{check['reference_error']:.1e} of the peak."
    ]


def _drags(rows: list[dict[str, Any]]) -> str:
    lines = [
        "A source of half-light radius 30 pixels is moved step by step among stars; the error is\n"
        "that of the last image against a full render at 1e-8.\n"
        "*Edited* is the median where it grows from 10 to 30 pixels and turns instead.\n"
        "Start renders the others, at 1e-5; the first of all finds nothing kept. GalSim draws the "
        "one source again, its profile unchanged.\n",
        "| source | frame | others | moves | start ms | median ms | most ms | edited ms | error "
        "| GalSim ms |",
        "|---" * 10 + "|",
    ]
    for row in rows:
        cells = [row["kind"], str(row["side"]), f"{row['others']}", f"{row['moves']}"]
        cells.append(_cell(row, "start_ms", ".0f"))
        cells += [_cell(row, name, ".2g") for name in ("median_ms", "max_ms", "edited_ms")]
        cells += [_cell(row, "error", ".1e"), f"{row['galsim_ms']:.2g}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _scaling(rows: list[dict[str, Any]]) -> str:
    times = {(row["side"], row["stars"]): row["time_s"] for row in rows}
    lines = [
        "Stars alone, tolerance 1e-6. The last column compares with 16 times as many stars in\n"
        "2048 x 2048, where the density is the same: 16 is proportional to the area.\n",
        "| stars | 512: s | us a star | 2048: s | us a star | 2048 over 512, same density |",
        "|---" * 6 + "|",
    ]
    for count in sorted({count for _, count in times}):
        cells = [str(count)]
        for side in (512, 2048):
            time = times.get((side, count))
            cells += ["", ""] if time is None else [f"{time:.3g}", f"{1e6 * time / count:.3g}"]
        pair = times.get((512, count)), times.get((2048, 16 * count))
        cells.append(f"{pair[1] / pair[0]:.1f}" if pair[0] and pair[1] else "")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"

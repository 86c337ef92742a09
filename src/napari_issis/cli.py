"""The shell command ``napari-issis``."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import count
from pathlib import Path

from . import __version__
from .cli_measure import photometry, sheet
from .cli_scene import PROGRAM, SCENE_HELP, Parser, add_scene_options, expose_and_tell, read_scene
from .fits_io import DTYPES, IMAGES
from .fits_io import SUFFIXES as FITS_SUFFIXES
from .png import SCALES, check_zoom, write_png, write_source_png
from .png import SUFFIXES as PNG_SUFFIXES
from .rgba import write_rgba
from .safe_write import check_target
from .scenes import SCENES, example_scene, load_scene

# Qt platforms that draw without an X or Wayland server.
SCREENLESS_QT = ("offscreen", "minimal", "minimalegl", "vnc", "eglfs", "linuxfb")
QT_BINDINGS = ("PyQt6", "PySide6", "PyQt5", "PySide2")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        What follows the program's name; by default that of the running process.

    Returns
    -------
    int
        Exit code, 0.

    Raises
    ------
    SystemExit
        With code 2 after bad input, which one line on stderr names.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    commands = {
        "simulate": _simulate,
        "sheet": sheet,
        "photometry": photometry,
        "scenes": _list_scenes,
    }
    command = commands.get(words[0]) if words else None
    try:
        if command is not None:
            command(words[1:])
        else:
            _open(words)
    except FileExistsError as error:
        Parser().error(str(error).replace("overwrite=True", "--overwrite"))
    except (ValueError, OSError, ImportError) as error:
        asked = "give the observation a pointing"
        Parser().error(str(error).replace(asked, "give the frame's with --pointing"))
    except MemoryError:
        Parser().error("there is not enough memory; choose a smaller frame.")
    except KeyboardInterrupt:
        Parser().exit(130, f"{PROGRAM}: interrupted\n")
    return 0


def _simulate(words: list[str]) -> None:
    parser = Parser(
        prog=f"{PROGRAM} simulate",
        description="Simulate an exposure and write it to a FITS file; needs no screen.",
    )
    parser.add_argument("--output", required=True, metavar="X.fits", help="FITS file to write")
    parser.add_argument("--png", metavar="X.png", help="picture of the counts to write as well")
    parser.add_argument(
        "--scale", choices=SCALES, default="linear", help="brightness scale of the picture"
    )
    add_scene_options(parser)
    parser.add_argument(
        "--tolerance", type=float, help="largest error of a pixel's rate over the image's peak"
    )
    parser.add_argument("--compress", action="store_true", help="compress the counts, losslessly")
    parser.add_argument(
        "--image",
        choices=IMAGES,
        default="counts",
        help="image that stands first in the FITS file; default: counts",
    )
    parser.add_argument("--dtype", choices=DTYPES, help="numbers of that image")
    parser.add_argument(
        "--image-only",
        action="store_true",
        help="write that image alone, as other programs expect it; not a scene to open again",
    )
    parser.add_argument("--rgba", metavar="X.png", help="counts as red + 256 green + 65536 blue")
    parser.add_argument("--model", metavar="X.png", help="picture of the sources to write as well")
    parser.add_argument("--zoom", type=int, default=1, help="magnification of both pictures")
    parser.add_argument("--overwrite", action="store_true", help="replace existing files")
    options = parser.parse_args(words)

    overwrite = options.overwrite
    check_target(options.output, FITS_SUFFIXES, overwrite=overwrite)
    for picture in (options.png, options.rgba, options.model):
        if picture is not None:
            check_target(picture, PNG_SUFFIXES, overwrite=overwrite)
    sources, observation = read_scene(options)
    check_zoom(options.zoom, observation.shape)
    exposure = expose_and_tell(sources, observation, options.seed, options.tolerance)
    exposure.write(
        options.output,
        overwrite=overwrite,
        compress=options.compress,
        image=options.image,
        dtype=options.dtype,
        whole=not options.image_only,
    )
    print(f"wrote {options.output}")
    counts, shape = exposure.counts, observation.shape
    if options.png is not None:
        write_png(options.png, counts, scale=options.scale, zoom=options.zoom, overwrite=overwrite)
        print(f"wrote {options.png}")
    if options.model is not None:
        write_source_png(
            options.model,
            exposure.sources,
            shape,
            zoom=options.zoom,
            overwrite=overwrite,
            pixel_scale=observation.pixel_scale,
        )
        print(f"wrote {options.model}")
    if options.rgba is not None:
        write_rgba(options.rgba, counts, overwrite=overwrite)
        print(f"wrote {options.rgba}")


def _list_scenes(words: list[str]) -> None:
    parser = Parser(prog=f"{PROGRAM} scenes", description="List the built-in scenes.")
    parser.parse_args(words)
    for name in SCENES:
        scene = example_scene(name)
        print(f"{name:12} {scene.title}\n{'':12} {scene.note}")


def _open(words: list[str]) -> None:
    parser = Parser(
        prog=PROGRAM,
        description="Open napari with the simulator docked. Without a screen, write the scene "
        "to a FITS and a PNG file in the current folder instead.",
        epilog=f"Also, without a screen: '{PROGRAM} simulate SCENE --output X.fits' simulates, "
        f"'{PROGRAM} sheet SCENE --output X.html' writes a proposal sheet, '{PROGRAM} photometry "
        f"SCENE --output X.ecsv' measures in apertures, '{PROGRAM} scenes' lists the built-in "
        "scenes. Each has its own --help.",
    )
    parser.add_argument("scene", metavar="SCENE", nargs="?", help=SCENE_HELP)
    parser.add_argument("--version", action="version", version=f"{PROGRAM} {__version__}")
    options = parser.parse_args(words)

    obstacle = _obstacle()
    if obstacle is not None:
        _write_instead(options.scene or "blend", obstacle)
        return
    sources, observation = (None, None) if options.scene is None else load_scene(options.scene)
    import napari

    from . import show

    show(sources, observation)
    napari.run()


def _obstacle() -> str | None:
    """Say why napari cannot open a window here, or None if it can."""
    if find_spec("napari") is None or not any(find_spec(name) for name in QT_BINDINGS):
        return 'napari or Qt is not installed (pip install "napari-issis[all]")'
    if sys.platform in ("win32", "darwin"):
        return None
    if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"):
        return None
    if os.environ.get("QT_QPA_PLATFORM", "").split(":")[0] in SCREENLESS_QT:
        return None
    return "there is no screen (neither DISPLAY nor WAYLAND_DISPLAY is set)"


def _write_instead(scene: str, obstacle: str) -> None:
    sources, observation = load_scene(scene)
    stem = _free_stem(Path(scene).stem)
    print(
        f"{PROGRAM}: {obstacle}; writing the scene to {stem}.fits and {stem}.png instead.",
        file=sys.stderr,
    )
    exposure = expose_and_tell(sources, observation, seed=0, tolerance=None)
    exposure.write(f"{stem}.fits")
    print(f"wrote {stem}.fits")
    write_png(f"{stem}.png", exposure.counts, scale="log")
    print(f"wrote {stem}.png")


def _free_stem(stem: str) -> str:
    """Return the stem, numbered if need be, of which no FITS or PNG file exists here."""
    names = (stem if i == 1 else f"{stem}-{i}" for i in count(1))
    return next(
        name
        for name in names
        if not any(os.path.lexists(f"{name}{ending}") for ending in (".fits", ".png"))
    )

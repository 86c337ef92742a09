"""The shell command ``napari-issis``."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import NoReturn

from astropy.table import QTable

from . import __version__
from .catalogue import read_catalogue
from .exposure import Exposure, simulate
from .filter_set import FILTER_NAMES, ILLUSTRATIVE_FILTERS
from .fits_header import psf_description
from .fits_io import DTYPES, IMAGES
from .fits_io import SUFFIXES as FITS_SUFFIXES
from .frame_coordinates import read_position
from .image_psf import ImagePSF
from .instrument import CHANNELS, FILTERS
from .observation import Observation
from .png import SCALES, write_png, write_source_png
from .png import SUFFIXES as PNG_SUFFIXES
from .rgba import write_rgba
from .safe_write import check_target
from .scenes import SCENES, example_scene, load_scene, load_scene_with_notes
from .sky import SKIES

PROGRAM = "napari-issis"
SCENE_HELP = (
    "a built-in scene or a file: a catalogue (ECSV, CSV, FITS, VOTable, DS9 regions) or a saved "
    "exposure"
)
# Qt platforms that draw without an X or Wayland server.
SCREENLESS_QT = ("offscreen", "minimal", "minimalegl", "vnc", "eglfs", "linuxfb")
QT_BINDINGS = ("PyQt6", "PySide6", "PyQt5", "PySide2")


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{PROGRAM}: error: {' '.join(message.split())}\n")


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
    commands = {"simulate": _simulate, "scenes": _list_scenes}
    command = commands.get(words[0]) if words else None
    try:
        if command is not None:
            command(words[1:])
        else:
            _open(words)
    except FileExistsError as error:
        _Parser().error(str(error).replace("overwrite=True", "--overwrite"))
    except (ValueError, OSError) as error:
        asked = "give the observation a pointing"
        _Parser().error(str(error).replace(asked, "give the frame's with --pointing"))
    except MemoryError:
        _Parser().error("there is not enough memory; choose a smaller frame.")
    except KeyboardInterrupt:
        _Parser().exit(130, f"{PROGRAM}: interrupted\n")
    return 0


def _simulate(words: list[str]) -> None:
    parser = _Parser(
        prog=f"{PROGRAM} simulate",
        description="Simulate an exposure and write it to a FITS file; needs no screen.",
    )
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument("--output", required=True, metavar="X.fits", help="FITS file to write")
    parser.add_argument("--png", metavar="X.png", help="picture of the counts to write as well")
    parser.add_argument(
        "--scale", choices=SCALES, default="linear", help="brightness scale of the picture"
    )
    parser.add_argument("--channel", choices=CHANNELS, help="default: the scene's, or NUV")
    parser.add_argument(
        "--filters",
        nargs=2,
        choices=FILTER_NAMES,
        metavar=("WHEEL1", "WHEEL2"),
        help=f"filter in each wheel: {', '.join(FILTERS)}, or illustrative "
        f"{', '.join(ILLUSTRATIVE_FILTERS)}; default: the scene's, or open open",
    )
    parser.add_argument("--psf", metavar="X.fits", help="PSF: the first image of this FITS file")
    parser.add_argument(
        "--psf-scale",
        type=float,
        metavar="ARCSEC",
        help="spacing of that image's samples; default: what its header says",
    )
    parser.add_argument("--sky", choices=SKIES, help="default: the scene's, or CIS")
    parser.add_argument(
        "--exposure", type=float, metavar="SECONDS", help="default: the scene's, or 100"
    )
    parser.add_argument(
        "--frame",
        type=int,
        nargs="+",
        metavar="N",
        help="pixels: one number for a square, or NY NX; default: the scene's, or 512",
    )
    parser.add_argument(
        "--pointing",
        metavar='"RA DEC"',
        help="position of the frame's centre on the sky (ICRS), for catalogues with ra and dec",
    )
    parser.add_argument(
        "--roll", type=float, metavar="DEGREES", help="position angle of the frame's +y axis"
    )
    parser.add_argument(
        "--catalogue",
        metavar="FILE",
        help="take the sources from this catalogue, and only the frame from SCENE",
    )
    parser.add_argument("--seed", type=int, default=0, help="seed of the noise; default: 0")
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
    changes: dict[str, object] = {}
    for name in ("channel", "filters", "exposure", "roll"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    if options.sky is not None:
        changes["sky"] = SKIES[options.sky]
    if options.psf is not None:
        changes["psf"] = ImagePSF.from_fits(options.psf, pixel_scale=options.psf_scale)
    elif options.psf_scale is not None:
        raise ValueError("--psf-scale is that of a PSF's image; give --psf too.")
    if options.frame is not None:
        frame = options.frame
        changes["shape"] = (frame[0], frame[0]) if len(frame) == 1 else tuple(frame)
    if options.pointing is not None:
        changes["pointing"] = read_position(options.pointing)
    sources, observation, notes = load_scene_with_notes(options.scene, **changes)
    if options.catalogue is not None:
        catalogue = read_catalogue(options.catalogue, observation)
        sources, notes = catalogue.sources, catalogue.notes
    for note in notes:
        print(note)
    exposure = _expose(sources, observation, options.seed, options.tolerance)
    exposure.write(
        options.output,
        overwrite=overwrite,
        compress=options.compress,
        image=options.image,
        dtype=options.dtype,
    )
    print(f"wrote {options.output}")
    counts, shape = exposure.counts, observation.shape
    if options.png is not None:
        write_png(options.png, counts, scale=options.scale, zoom=options.zoom, overwrite=overwrite)
        print(f"wrote {options.png}")
    if options.model is not None:
        write_source_png(
            options.model, exposure.sources, shape, zoom=options.zoom, overwrite=overwrite
        )
        print(f"wrote {options.model}")
    if options.rgba is not None:
        write_rgba(options.rgba, counts, overwrite=overwrite)
        print(f"wrote {options.rgba}")


def _list_scenes(words: list[str]) -> None:
    parser = _Parser(prog=f"{PROGRAM} scenes", description="List the built-in scenes.")
    parser.parse_args(words)
    for name in SCENES:
        scene = example_scene(name)
        print(f"{name:12} {scene.title}\n{'':12} {scene.note}")


def _open(words: list[str]) -> None:
    parser = _Parser(
        prog=PROGRAM,
        description="Open napari with the simulator docked. Without a screen, write the scene "
        "to a FITS and a PNG file in the current folder instead.",
        epilog=f"Also: '{PROGRAM} simulate SCENE --output X.fits' simulates without a screen, "
        f"'{PROGRAM} scenes' lists the built-in scenes; each has its own --help.",
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
    exposure = _expose(sources, observation, seed=0, tolerance=None)
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


def _expose(
    sources: QTable, observation: Observation, seed: int, tolerance: float | None
) -> Exposure:
    """Simulate, print the warnings as lines on stderr and the headline numbers on stdout."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        exposure = simulate(sources, observation, seed=seed, tolerance=tolerance)
    for warning in caught:
        print(f"{PROGRAM}: warning: {warning.message}", file=sys.stderr)
    observation = exposure.observation
    ny, nx = observation.shape
    sky = ny * nx * exposure.background
    light = max(exposure.expected.sum() - sky, 0.0) / observation.exposure
    print(
        f"{len(exposure.sources)} sources, {ny} x {nx} pixels, {observation.channel}, "
        f"{'-'.join(observation.filter_names)}, {observation.exposure:g} s, seed {exposure.seed}"
    )
    print(
        f"sources {light:.4g} cps in the frame, brightest pixel {exposure.counts.max()} counts, "
        f"sky {exposure.background:.3g} counts per pixel"
    )
    assumed = "assumed, none is published" if observation.psf_assumed else "as given"
    print(f"PSF ({assumed}): {psf_description(observation.effective_psf)}")
    return exposure

"""What the shell commands share: the options of a scene, and how one is simulated."""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path
from typing import NoReturn

from astropy.table import QTable

from .catalogue import read_catalogue
from .exposure import Exposure, simulate
from .fits_header import psf_description
from .frame_coordinates import read_position
from .instrument import Instrument
from .instruments import INSTRUMENTS, ISSIS, instrument_named
from .observation import Observation
from .scenes import load_scene_with_notes
from .sky import SKIES

PROGRAM = "napari-issis"
SCENE_HELP = (
    "a built-in scene or a file: a catalogue (ECSV, CSV, FITS, VOTable, DS9 regions) or a saved "
    "exposure"
)


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """End the program with one line on stderr."""
        self.exit(2, f"{PROGRAM}: error: {' '.join(message.split())}\n")


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """Add the scene, and what can be changed in it."""
    parser.add_argument("scene", metavar="SCENE", help=SCENE_HELP)
    parser.add_argument(
        "--instrument",
        metavar="FILE",
        help=f"camera: {', '.join(INSTRUMENTS)} or a TOML file; default: the scene's, or ISSIS",
    )
    parser.add_argument(
        "--channel",
        help=f"of ISSIS {', '.join(ISSIS.channels)}; default: the scene's, or the camera's first",
    )
    parser.add_argument(
        "--filters",
        nargs=2,
        metavar=("WHEEL1", "WHEEL2"),
        help=f"filter in each wheel, of ISSIS {', '.join(ISSIS.neutral_filters)}, or illustrative "
        f"{', '.join(ISSIS.filter_curves)}; default: the scene's, or open open",
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


def read_scene(options: argparse.Namespace) -> tuple[QTable, Observation]:
    """Load the scene that the options name, and print what was understood of a catalogue."""
    changes: dict[str, object] = {}
    for name in ("channel", "filters", "exposure", "roll"):
        if getattr(options, name) is not None:
            changes[name] = getattr(options, name)
    if options.sky is not None:
        changes["sky"] = SKIES[options.sky]
    if options.frame is not None:
        frame = options.frame
        changes["shape"] = (frame[0], frame[0]) if len(frame) == 1 else tuple(frame)
    if options.pointing is not None:
        changes["pointing"] = read_position(options.pointing)
    if options.instrument is not None:
        changes["instrument"] = _camera(options.instrument)
    sources, observation, notes = load_scene_with_notes(options.scene, **changes)
    if options.catalogue is not None:
        catalogue = read_catalogue(options.catalogue, observation)
        sources, notes = catalogue.sources, catalogue.notes
    for note in notes:
        print(note)
    return sources, observation


def expose_and_tell(
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


def _camera(name_or_path: str) -> Instrument:
    """Return a camera by its name, or from a file."""
    if name_or_path in INSTRUMENTS or not Path(name_or_path).exists():
        return instrument_named(name_or_path)
    return Instrument.read(name_or_path)

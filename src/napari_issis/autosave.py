"""Scenes that outlive a crash: each process keeps its own in a small file, until it ends well."""

from __future__ import annotations

import os
import platform
import secrets
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from astropy.io import fits
from astropy.table import QTable, Table

from .fits_io import read_scene, scene_hdus
from .fits_table import open_fits, table_hdu
from .observation import Observation
from .safe_write import replacing

ENDING = ".autosave.fits"
# Clocks are set while a program runs; process numbers are not used again as soon.
CLOCK_SECONDS = 60.0
DAY = 86400.0


def autosave_folder() -> Path:
    """Folder of the autosaved scenes in the user's own state folder; made if it is missing."""
    from platformdirs import user_state_path

    folder = user_state_path("napari-issis", appauthor=False) / "autosave"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


class Autosave:
    """The autosaved scene of this process; several processes do not disturb each other.

    Parameters
    ----------
    folder : path-like, optional
        Where to keep it, by default `autosave_folder`.
    """

    def __init__(self, folder: str | os.PathLike[str] | None = None) -> None:
        self.folder = autosave_folder() if folder is None else Path(folder)
        self.path = self.folder / f"{os.getpid()}-{secrets.token_hex(4)}{ENDING}"
        for part in self.folder.glob(".napari-issis-*.part"):
            # Left by a process that was killed while it wrote.
            if time.time() - part.stat().st_mtime > DAY:
                part.unlink(missing_ok=True)

    def write(self, sources: Table, observation: Observation, seed: int = 0) -> None:
        """Save the scene in place of the one saved before; columns of objects are left out.

        Parameters
        ----------
        sources : astropy.table.QTable
            The source table.
        observation : Observation
            The instrument set-up.
        seed : int
            Seed of the noise.

        Raises
        ------
        ValueError
            If the PSF cannot be stored.
        OSError
            If the file cannot be written; the scene saved before is kept.
        """
        import psutil

        kept = sources[[name for name in sources.colnames if _storable(sources, name)]]
        header = fits.Header()
        header["PROCESS"] = (os.getpid(), "number of the process that wrote this")
        header["STARTED"] = (psutil.Process().create_time(), "[s] Unix time at which it started")
        header["HOST"] = (platform.node()[:60], "computer on which it ran")
        header["DATE"] = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S")
        hdus = [fits.PrimaryHDU(header=header), *scene_hdus(kept, observation, seed)]
        with replacing(self.path, (ENDING,), overwrite=True) as file:
            fits.HDUList(hdus).writeto(file, output_verify="exception", checksum=True)

    def remove(self) -> None:
        """Forget the scene, as when the session ends well or the scene was saved."""
        self.path.unlink(missing_ok=True)


@dataclass(frozen=True)
class CrashedScene:
    """A scene whose process is no more.

    Attributes
    ----------
    path : pathlib.Path
        Its file.
    saved : datetime.datetime
        When it was saved last, UTC.
    """

    path: Path
    saved: datetime

    def read(self) -> tuple[QTable, Observation, int]:
        """Read sources, observation and seed.

        Raises
        ------
        ValueError
            If the file is damaged.
        OSError
            If it cannot be opened.
        """
        with open_fits(self.path) as hdus:
            return read_scene(hdus)[:3]

    def remove(self) -> None:
        """Remove the file."""
        self.path.unlink(missing_ok=True)


def crashed_scenes(folder: str | os.PathLike[str] | None = None) -> list[CrashedScene]:
    """List the scenes that processes of this computer left behind, the newest first.

    Parameters
    ----------
    folder : path-like, optional
        Where to look, by default in `autosave_folder`.

    Returns
    -------
    list of CrashedScene
        Files that cannot be read are among them: `CrashedScene.read` says what is wrong.
    """
    place = autosave_folder() if folder is None else Path(folder)
    found = []
    for path in place.glob(f"*{ENDING}"):
        try:
            saved = datetime.fromtimestamp(path.stat().st_mtime, UTC)
        except FileNotFoundError:
            # Removed by its process meanwhile.
            continue
        if not _alive(path):
            found.append(CrashedScene(path, saved))
    return sorted(found, key=lambda scene: scene.saved, reverse=True)


def _alive(path: Path) -> bool:
    """Whether the process that wrote a file runs, or may run on another computer."""
    import psutil

    try:
        with open_fits(path) as hdus:
            header = hdus[0].header
            process, started = int(header["PROCESS"]), float(header["STARTED"])
            host = str(header["HOST"])
    except (ValueError, OSError):
        return False
    if host != platform.node()[:60].rstrip():
        return True
    try:
        return bool(abs(psutil.Process(process).create_time() - started) < CLOCK_SECONDS)
    except psutil.AccessDenied:
        return True
    except (psutil.Error, ValueError, OverflowError):
        return False


def _storable(table: Table, name: str) -> bool:
    try:
        table_hdu(table[[name]], "COLUMN")
    except (ValueError, TypeError):
        return False
    return True

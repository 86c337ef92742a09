"""Sequences of exposures as FITS cubes."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from astropy.io import fits
from astropy.table import Table

from .fits_header import wcs_header
from .fits_io import IMAGES, SUFFIXES, scene_hdus
from .fits_table import table_hdu
from .monitoring_tasks import BATCH
from .safe_write import check_target, replacing

if TYPE_CHECKING:
    from .monitoring import Monitoring


def write_cube(
    monitoring: Monitoring,
    path: str | os.PathLike[str],
    image: str = "counts",
    *,
    coadd: bool = True,
    overwrite: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write a sequence of exposures as a FITS cube; the whole cube is held in memory.

    The primary HDU has one plane an epoch (or an exposure), in order. ``PLANES`` tells of each
    plane its epoch, time, exposure time, roll, and offset and seed of its (first) exposure;
    ``FACTORS`` the flux of each source at each epoch over that in ``SOURCES``; ``SOURCES`` and
    ``OBSERVATION`` are those that the sequence was made of.

    Parameters
    ----------
    monitoring : Monitoring
        The sequence.
    path : path-like
        The file; its name ends in ``.fits`` (or ``.fit``, ``.fts``).
    image : {"counts", "expected"}
        Detected counts (64-bit integers) or expected ones (64-bit floats).
    coadd : bool
        Whether the exposures of an epoch are added; see `Monitoring.stack`.
    overwrite : bool
        Whether an existing file may be replaced.
    progress : callable, optional
        Called with the numbers of finished and of all planes. These are then computed sixteen
        at a time, and what more of them share is rendered again.

    Raises
    ------
    ValueError
        If the name does not end as above, or something cannot be stored.
    OSError
        If the file cannot be written; `FileExistsError` if it exists. Nothing is computed then.
    """
    from . import __version__

    check_target(path, SUFFIXES, overwrite=overwrite)
    stack = monitoring.stack(image, coadd=coadd)
    ones = [one for one in monitoring.exposures if not coadd or one.number == 0]
    header = fits.Header()
    header["BUNIT"] = IMAGES[image]
    header["OBSTYPE"] = ("SIMULATION", "no real observation")
    header["COADD"] = (coadd, "T: the exposures of an epoch are added")
    header["SEED"] = (monitoring.seed, "seed of the sequence")
    header["CREATOR"] = (f"napari-issis {__version__}", "program and version")
    rolls = {epoch.roll for epoch in monitoring.epochs}
    still = coadd or all(one.dither == (0, 0) for one in monitoring.exposures)
    if still and len(rolls) == 1 and all(tuple(e.offset) == (0, 0) for e in monitoring.epochs):
        # All planes show the same part of the sky.
        frame = monitoring.observation
        header.update(wcs_header(frame.replace(roll=frame.roll + rolls.pop())))
    per_plane = len(monitoring.exposures) // len(monitoring.epochs) if coadd else 1
    planes = Table(
        {
            "EPOCH": [one.epoch for one in ones],
            "NUMBER": [one.number for one in ones],
            "TIME": [one.time for one in ones],
            "EXPOSURE": [one.observation.exposure * per_plane for one in ones],
            "ROLL": [one.observation.roll for one in ones],
            "OFFSET_X": [monitoring.epochs[one.epoch].offset[0] + one.dither[0] for one in ones],
            "OFFSET_Y": [monitoring.epochs[one.epoch].offset[1] + one.dither[1] for one in ones],
            "SEED": [str(one.seed) for one in ones],
        }
    )
    cube = np.empty(stack.shape, stack.dtype)
    tell = progress or (lambda done, total: None)
    tell(0, len(cube))
    # All at once renders nothing twice.
    step = BATCH if progress else len(cube)
    for start in range(0, len(cube), step):
        cube[start : start + step] = stack[start : start + step].compute()
        tell(min(start + step, len(cube)), len(cube))
    hdus = [
        fits.PrimaryHDU(cube, header),
        table_hdu(planes, "PLANES"),
        fits.ImageHDU(monitoring.factors, name="FACTORS"),
        *scene_hdus(monitoring.sources, monitoring.observation, monitoring.seed),
    ]
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        fits.HDUList(hdus).writeto(file, output_verify="exception", checksum=True)

"""What the pointer tells in words: the pixel under it, and the source."""

from __future__ import annotations

import os
from functools import lru_cache

import numpy as np
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.table import Row
from astropy.wcs import WCS

from ..exposure import Exposure
from ..fits_header import wcs_header
from ..observation import Observation
from ..source_counts import expected_counts, signal_to_noise
from ..source_rates import flux_pivot
from ..sources import IMAGE, check_sources, spectrum_texts
from .units import Units


def pixel_text(exposure: Exposure, x: float, y: float) -> str:
    """Describe the pixel at a position: place, counts, count rate and S/N.

    Parameters
    ----------
    exposure : Exposure
        What is shown.
    x, y : float
        Position in pixels; empty text beyond the frame.
    """
    ny, nx = exposure.counts.shape
    column, row = round(x), round(y)
    if not (0 <= column < nx and 0 <= row < ny):
        return ""
    observation = exposure.observation
    east, north = sky_offset(observation, x, y)
    parts = [f"x {column}  y {row}", f"E {east:+.2f}″  N {north:+.2f}″"]
    if observation.pointing is not None:
        parts.append(_sky_position(observation, x, y))
    counts = int(exposure.counts[row, column])
    parts += [
        f"C {counts}",
        f"{counts / observation.exposure:.4g} cps",
        f"SNR {_snr(counts, exposure.background):.2f}",
    ]
    return "   ".join(parts)


def sky_offset(observation: Observation, x: float, y: float) -> tuple[float, float]:
    """Offset of a position from the frame's centre towards east and north, arcsec.

    The frame's +y axis lies at position angle ``roll``.
    """
    ny, nx = observation.shape
    right = (x - 0.5 * (nx - 1)) * observation.pixel_scale
    up = (y - 0.5 * (ny - 1)) * observation.pixel_scale
    roll = np.radians(observation.roll)
    east = up * np.sin(roll) - right * np.cos(roll)
    north = up * np.cos(roll) + right * np.sin(roll)
    return float(east), float(north)


def source_text(row: Row, observation: Observation, units: Units) -> str:
    """Describe a source: a line for each parameter, its counts and S/N alone.

    Parameters
    ----------
    row : astropy.table.Row
        Row of a source table.
    observation : Observation
        The instrument set-up.
    units : Units
        What fluxes and radii are shown in.
    """
    table = row.table[[row.index]]
    texts = spectrum_texts(table)
    spectrum = "" if texts is None else str(texts[0])
    pivot = flux_pivot(spectrum, observation)
    one = check_sources(table, pivot=pivot, pixel_scale=observation.pixel_scale)
    kind = str(one.kind[0])
    lines = [
        kind,
        f"x {one.x[0]:.2f}   y {one.y[0]:.2f}",
        f"F {units.flux_text(float(one.flux[0]), pivot)} {units.flux_label}",
    ]
    if kind != "point":
        radius = units.length_text(float(one.r_half[0]), observation.pixel_scale)
        lines.append(f"R½ {radius} {units.length_label}")
        # an image has a top
        turn = 360 if kind == IMAGE else 180
        lines.append(f"ε {one.ellipticity[0]:.3g}   PA {one.pa[0] % turn:.1f}°")
    if kind == "sersic":
        lines.append(f"n {one.index[0]:.3g}")
    if kind == IMAGE:
        lines.append(os.path.basename(str(one.image[0])))
    if spectrum not in ("", "flat"):
        lines.append(spectrum)
    counts, ratio = expected_counts(table, observation), signal_to_noise(table, observation)
    lines.append(f"{counts[0]:.4g} counts   S/N {ratio[0]:.3g}")
    return "\n".join(lines)


def _snr(counts: int, background: float) -> float:
    return (counts - background) / counts**0.5 if counts else 0.0


def _sky_position(observation: Observation, x: float, y: float) -> str:
    ra, dec = _wcs(observation).wcs_pix2world([[x, y]], 0)[0]
    text: str = SkyCoord(ra * u.deg, dec * u.deg).to_string("hmsdms", sep=":", precision=3)
    return text


@lru_cache(maxsize=4)
def _wcs(observation: Observation) -> WCS:
    return WCS(wcs_header(observation))

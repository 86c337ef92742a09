"""A scene as it is seen after the telescope has been turned or moved."""

from __future__ import annotations

from math import cos, radians, sin

import astropy.units as u
import numpy as np
from astropy.coordinates import SkyCoord
from astropy.table import QTable, Table

from .frame_coordinates import frame_to_sky, sky_to_frame
from .observation import Observation
from .sources import check_sources


def move_frame(
    sources: Table, observation: Observation, *, roll: float, offset: tuple[float, float]
) -> tuple[QTable, Observation]:
    """Return sources and observation after a change of roll and pointing.

    Parameters
    ----------
    sources : astropy.table.Table
        The source table in the frame of ``observation``.
    observation : Observation
        The frame before.
    roll : float
        Added to the roll, degrees: the frame's +y axis turns from north through east about the
        frame's centre, and the sky in the frame turns clockwise.
    offset : (float, float)
        Then the pointing moves by so many pixels along +x and +y of the turned frame, and the
        sky in it by as many the other way.

    Notes
    -----
    Where the observation has a pointing the sources go over the sky, so that they and the
    world coordinates of the new frame agree; otherwise the sky is flat. Without a change both
    are returned as they are.
    """
    table = QTable(sources, copy=True)
    if roll == 0 and tuple(offset) == (0, 0):
        return table, observation
    arrays = check_sources(sources, pivot=observation.pivot, pixel_scale=observation.pixel_scale)
    ny, nx = observation.shape
    x_0, y_0 = (nx - 1) / 2, (ny - 1) / 2
    c, s = cos(radians(roll)), sin(radians(roll))
    moved = observation.replace(roll=observation.roll + roll)
    if observation.pointing is None:
        dx, dy = arrays.x - x_0, arrays.y - y_0
        x = x_0 + dx * c + dy * s - offset[0]
        y = y_0 - dx * s + dy * c - offset[1]
        turn = np.full(len(arrays), -roll)
    else:
        # The new centre in the frame before.
        x_1 = x_0 + offset[0] * c - offset[1] * s
        y_1 = y_0 + offset[0] * s + offset[1] * c
        ra_1, dec_1 = frame_to_sky(x_1, y_1, observation)
        moved = moved.replace(pointing=SkyCoord(float(ra_1), float(dec_1), unit="deg"))
        ra, dec = frame_to_sky(arrays.x, arrays.y, observation)
        before = sky_to_frame(ra, dec, observation)[2]
        x, y, after = sky_to_frame(ra, dec, moved)
        turn = after - before
    table["x"], table["y"] = x, y
    if "pa" in table.colnames:
        table["pa"] = ((arrays.pa + turn) % 360) * u.deg
    return table, moved

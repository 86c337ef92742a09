"""The frame on the sky, by astropy alone."""

import numpy as np
from astropy.wcs import WCS


def independent_wcs(observation):
    """The frame on the sky from four numbers, by none of the program's own code."""
    ny, nx = observation.shape
    turn = np.radians(observation.roll)
    wcs = WCS(naxis=2)
    wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
    wcs.wcs.crval = [observation.pointing.ra.deg, observation.pointing.dec.deg]
    wcs.wcs.crpix = [(nx + 1) / 2, (ny + 1) / 2]
    scale = 0.036 / 3600
    wcs.wcs.cd = scale * np.array([[-np.cos(turn), np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    return wcs

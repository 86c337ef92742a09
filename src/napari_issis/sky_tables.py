"""Surface brightness of the ultraviolet sky, from tables.

Sources
-------
[STIS]  STIS Instrument Handbook, section 6.5 and 6.6 (v20), Tables 6.4 and 6.5.
[COS]   COS Instrument Handbook, section 7.4: the levels of earthshine.
[M]     Murthy 2014, ApJS 213, 32: diffuse light in the two bands of GALEX.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# angstrom
WAVELENGTH = np.arange(1000.0, 3300.0, 100.0)
# "High" earthshine, 38 degrees from the bright limb, erg s-1 cm-2 A-1 arcsec-2 [STIS, 6.4]
EARTHSHINE_HIGH = np.array(
    [
        *(2.41e-23, 4.38e-22, 4.01e-23, 7.41e-25, 4.29e-25, 4.16e-25, 2.55e-25, 7.89e-25),
        *(9.33e-23, 4.39e-22, 1.01e-21, 1.60e-21, 7.49e-22, 3.32e-22, 2.50e-22, 2.39e-22),
        *(5.62e-22, 6.77e-21, 2.03e-21, 4.32e-20, 9.34e-20, 2.07e-19, 3.60e-19),
    ]
)
# "High" zodiacal light, 22.1 mag arcsec-2 in V, in the same unit [STIS, 6.4]
ZODIACAL_HIGH = np.array(
    [
        *(9.69e-29, 1.04e-26, 1.08e-25, 6.59e-25, 2.55e-24, 9.73e-24, 2.35e-22, 7.21e-21),
        *(1.53e-20, 2.25e-20, 3.58e-20, 1.23e-19, 2.21e-19, 1.81e-19, 1.83e-19, 2.53e-19),
        *(3.06e-19, 1.01e-18, 2.88e-19, 2.08e-18, 1.25e-18, 1.50e-18, 2.30e-18),
    ]
)
for _table in (WAVELENGTH, EARTHSHINE_HIGH, ZODIACAL_HIGH):
    _table.setflags(write=False)


def _seen_solid_angle(orbit: float) -> float:
    """Solid angle of the Earth from an orbit's radius in km, over 2 pi."""
    return 1 - cos(np.arcsin(6378.0 / orbit))


# Share of the high earthshine [COS]. In geosynchronous orbit (radius 42 164 km) that of HST's
# average (540 km up), reduced as the solid angle of the Earth: derived here, no measurement.
EARTHSHINE = MappingProxyType(
    {
        "none": 0.0,
        "high orbit": 0.5 * _seen_solid_angle(42164.0) / _seen_solid_angle(6378.0 + 540.0),
        "average": 0.5,
        "high": 1.0,
        "extreme": 2.0,
    }
)
# Share of the high zodiacal light: V = 23.3, 22.7 and 22.1 mag arcsec-2 [STIS]
ZODIACAL = MappingProxyType({"none": 0.0, "low": 10**-0.48, "average": 10**-0.24, "high": 1.0})


@dataclass(frozen=True)
class Line:
    """A geocoronal line: wavelength in angstrom, and fluxes in erg s-1 cm-2 arcsec-2."""

    name: str
    wavelength: float
    low: float
    average: float
    high: float
    high_orbit: float = 0.0

    def flux(self, level: str) -> float:
        """Surface brightness at a level of `GEOCORONA`, erg s-1 cm-2 arcsec-2."""
        return 0.0 if level == "none" else float(getattr(self, level.replace(" ", "_")))


GEOCORONA = ("none", "high orbit", "low", "average", "high")
# [STIS, 6.5]. Checked: the four high fluxes (they give the paper's sky) and all three of
# [O II]; the low fluxes of O I and O I] are from memory. High orbit: Ly-alpha of 2 kR, between
# the geocorona's and the 0.24 to 0.57 kR beyond it (OGO-5, 1971A&A....11..218T), assumed; the
# oxygen lines come from the thermosphere, far below a geosynchronous orbit.
LINES = (
    Line("Ly-alpha 1216", 1215.67, 6.1e-14, 3.05e-13, 6.1e-13, high_orbit=6.1e-14),
    Line("O I 1304", 1304.0, 1.5e-16, 2.85e-14, 5.7e-14),
    Line("O I] 1356", 1356.0, 3.0e-17, 2.5e-15, 5.0e-15),
    Line("[O II] 2471", 2471.0, 1.5e-17, 1.5e-15, 3.0e-15),
)

# Lowest galactic latitude, degrees, at which the cosecant law is used.
LOWEST_LATITUDE = 15.0
# Mean wavelengths of the bands of GALEX, angstrom [M]
GALEX = np.array([1539.0, 2316.0])
ARCSEC2_PER_STERADIAN = (180 * 3600 / np.pi) ** 2


def diffuse_photons(latitude: float) -> Array:
    """Diffuse galactic and extragalactic light at a galactic latitude.

    Parameters
    ----------
    latitude : float
        Galactic latitude, degrees, at least 15 from the plane.

    Returns
    -------
    ndarray, shape (2,)
        In photon s-1 cm-2 A-1 arcsec-2 in the bands of GALEX, `GALEX`.

    Notes
    -----
    The cosecant law of Murthy (2014), north and south apart: photon s-1 cm-2 sr-1 A-1 is
    93.4 + 133.2 csc b and 257.5 + 185.1 csc b (b > 0), -205.5 - 401.8 csc b and
    66.7 - 356.3 csc b (b < 0). At the poles that is 196 to 227 and 423 to 443; Akshaya et al.
    (2018, ApJ 858, 101) find 230 to 290 and 480 to 580.
    """
    cosecant = 1 / sin(radians(latitude))
    if latitude > 0:
        per_steradian = np.array([93.4 + 133.2 * cosecant, 257.5 + 185.1 * cosecant])
    else:
        per_steradian = np.array([-205.5 - 401.8 * cosecant, 66.7 - 356.3 * cosecant])
    return per_steradian / ARCSEC2_PER_STERADIAN

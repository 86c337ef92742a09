"""The filters that the wheels can hold by name: neutral ones, and illustrative curves.

Only the neutral filters are the paper's. Gomez de Castro et al. 2014 (Ap&SS 354, 177) speak of
"long-pass and narrow band filters", and their sensitivity table implies narrow bands at 1215,
1306, 1335, 1550 and 2500 A; names, widths, transmissions and long-pass edges were not
published. The curves here show what such filters do. All but their central wavelengths is
assumed.
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from .filters import Filter
from .instrument import FILTERS


def narrow_band(name: str, centre: float, fwhm: float, peak: float) -> Filter:
    """Make a Gaussian narrow-band filter.

    Parameters
    ----------
    name : str
        The filter's name.
    centre, fwhm : float
        Central wavelength and full width at half maximum, angstrom.
    peak : float
        Largest transmission.
    """
    offset = np.linspace(-2.5, 2.5, 81)
    return Filter(name, centre + fwhm * offset, peak * np.exp(-4 * np.log(2) * offset**2))


def long_pass(name: str, edge: float, width: float, peak: float) -> Filter:
    """Make a long-pass filter.

    Parameters
    ----------
    name : str
        The filter's name.
    edge : float
        Wavelength of half the largest transmission, angstrom.
    width : float
        Range over which the transmission rises linearly from 0, angstrom.
    peak : float
        Transmission beyond, as far as 4000 A.
    """
    wavelength = np.array([edge - width / 2, edge + width / 2, 4000.0])
    return Filter(name, wavelength, np.array([0.0, peak, peak]))


# Narrow bands: centres from Gomez de Castro et al. 2014, Table 1; widths and peaks assumed.
# Long-pass edges: about the short-wavelength limits of CaF2, BaF2, crystal quartz (those of
# HST ACS/SBC F125LP, F140LP, F150LP) and, in the NUV, beyond [O II] 2471; assumed.
ILLUSTRATIVE_FILTERS = MappingProxyType(
    {
        made.name: made
        for made in (
            narrow_band("N1215", 1215.7, 60.0, 0.10),
            narrow_band("N1306", 1306.0, 40.0, 0.15),
            narrow_band("N1335", 1335.0, 40.0, 0.15),
            narrow_band("N1550", 1550.0, 120.0, 0.40),
            narrow_band("N2500", 2500.0, 120.0, 0.40),
            long_pass("LP1250", 1250.0, 20.0, 0.80),
            long_pass("LP1370", 1370.0, 20.0, 0.80),
            long_pass("LP1480", 1480.0, 40.0, 0.80),
            long_pass("LP2600", 2600.0, 60.0, 0.80),
        )
    }
)
FILTER_NOTE = (
    "This filter is illustrative: no curve of an ISSIS filter has been published. Its width, "
    "transmission and edges are assumed."
)
FILTER_NAMES = (*FILTERS, *ILLUSTRATIVE_FILTERS)

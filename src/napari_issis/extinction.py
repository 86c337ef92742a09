"""Extinction by dust of the Milky Way in front of a source."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

R_V = 3.1
# Where the curve is defined, angstrom: 0.3 to 10 per micron.
EXTINCTION_RANGE = (1000.0, 33000.0)
# Where pieces of the curve meet, angstrom: 5.9 per micron, the end of its far-UV term, and 2700,
# that of the UV formula (Fitzpatrick 1999, PASP 111, 63, Appendix).
EXTINCTION_KNOTS = (1e4 / 5.9, 2700.0)


def transmitted(wavelength: ArrayLike, ebv: float) -> Array:
    """Share of the light that dust lets through.

    Parameters
    ----------
    wavelength : array_like
        Angstrom, in `EXTINCTION_RANGE`.
    ebv : float
        E(B-V), mag.

    Returns
    -------
    ndarray
        10^(-0.4 A) with A = R_V E(B-V) A(lambda) / A(V), R_V = 3.1, of Fitzpatrick (1999,
        PASP 111, 63) by ``dust_extinction``.

    Raises
    ------
    ImportError
        If ``dust_extinction`` is not installed: ``pip install "napari-issis[extinction]"``.
    """
    at = np.asarray(wavelength, dtype=np.float64)
    curve = np.asarray(_curve()(np.atleast_1d(at) * u.AA), dtype=np.float64)
    return np.asarray(10 ** (-0.4 * R_V * ebv * curve.reshape(at.shape)))


@lru_cache(maxsize=1)
def _curve() -> Any:
    try:
        from dust_extinction.parameter_averages import F99
    except ImportError as error:
        raise ImportError(
            "reddening (ebv) needs the extinction curves of dust_extinction: "
            'pip install "napari-issis[extinction]"'
        ) from error
    return F99(Rv=R_V)

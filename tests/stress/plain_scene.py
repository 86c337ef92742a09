"""Source tables and PSFs of the package from the plain numbers of a scene."""

from astropy.table import vstack

import napari_issis as ni

CPS = 1.14e17  # NUV, the paper's
PIXEL = 0.036


def psf_of(name, numbers):
    """Widths in pixels; a telescope's numbers in metres, angstrom and arcsec."""
    if name == "gaussian":
        return ni.GaussianPSF(numbers[0] * PIXEL)
    if name == "moffat":
        return ni.MoffatPSF(numbers[0] * PIXEL, numbers[1])
    diameter, obscuration, low, high, blur = numbers
    return ni.TelescopePSF(diameter, obscuration, (low, high), blur)


def table_of(sources):
    """Sources given as (flux, kind, x, y, r_half, ellipticity, pa, n)."""
    return vstack(
        [
            ni.source(kind, x, y, flux, r, e, pa, n=n if kind == "sersic" else None)
            for flux, kind, x, y, r, e, pa, n in sources
        ]
    )

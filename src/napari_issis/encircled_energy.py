"""Encircled energy of a radial PSF."""

from __future__ import annotations

import numpy as np
from scipy import special

from .psf import RadialPSF, positive


def encircled_energy(psf: RadialPSF, diameter: float) -> float:
    """Share of the light of a point source that falls into a circle about it.

    Parameters
    ----------
    psf : RadialPSF
        The PSF; the detector's pixel is no part of it.
    diameter : float
        Diameter of the circle, arcsec.

    Returns
    -------
    float
        2 pi R int OTF(k) J1(2 pi k R) dk with R half the diameter: the PSF's Hankel transform,
        integrated over the circle (Goodman 2005, Introduction to Fourier Optics, 2.1.5).

    Raises
    ------
    ValueError
        If the diameter is not a positive number.
    """
    radius = 0.5 * positive("diameter", diameter, "arcsec")
    limit = psf.band_limit(1e-9)
    node, weight = np.polynomial.legendre.leggauss(16)
    # four panels to each turn of the Bessel function, and enough for the OTF
    panels = 4 * int(limit * radius) + 64
    width = limit / panels
    k = ((np.arange(panels)[:, None] + 0.5 * (node + 1)) * width).ravel()
    measure = np.tile(0.5 * weight * width, panels)
    return float(2 * np.pi * radius * (measure @ (psf.otf(k) * special.j1(2 * np.pi * k * radius))))

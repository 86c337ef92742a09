"""Encircled energy and width of a radial PSF."""

from __future__ import annotations

from collections.abc import Sequence

import astropy.units as u
import numpy as np
from astropy.table import QTable
from scipy import special

from .psf import PSF, RadialPSF, fwhm, positive

# arcsec
DIAMETERS = (0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0)


def psf_table(psf: PSF, diameters: Sequence[float] = DIAMETERS) -> QTable:
    """Tabulate the encircled energy of a radial PSF.

    Parameters
    ----------
    psf : RadialPSF
        The PSF, such as an observation's ``effective_psf``.
    diameters : sequence of float
        Diameters of circles about the source, arcsec.

    Returns
    -------
    astropy.table.QTable
        Columns ``diameter`` (arcsec) and ``encircled_energy`` (share of the light), and the
        full width at half maximum as ``meta["fwhm"]``; the detector's pixel is no part of it.

    Raises
    ------
    ValueError
        If the PSF is an image, or a diameter is not a positive number.
    """
    if not isinstance(psf, RadialPSF):
        raise ValueError(
            f"the PSF is a {type(psf).__name__}; the table needs a TelescopePSF, GaussianPSF or "
            "MoffatPSF. Measure an image in its own program."
        )
    shares = [encircled_energy(psf, diameter) for diameter in diameters]
    return QTable(
        {"diameter": np.asarray(diameters, dtype=float) * u.arcsec, "encircled_energy": shares},
        meta={"fwhm": fwhm(psf) * u.arcsec},
    )


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

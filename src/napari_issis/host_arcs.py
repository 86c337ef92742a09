"""The arcs into which a lens draws the host galaxy of a quasar."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special

from .instruments import PIXEL_SCALE
from .lens_model import IsothermalLens, source_offset
from .psf import positive
from .sources import BRIGHTEST, INDEX_RANGE

Array = NDArray[np.float64]

# Rays a side of each sample.
RAYS = 5
MOST_SAMPLES = 1024


def host_arcs(
    *,
    einstein_radius: float,
    ellipticity: float = 0.0,
    pa: float = 0.0,
    shear: float = 0.0,
    shear_pa: float = 0.0,
    quasar: tuple[float, float] = (0.05, 0.02),
    flux: float,
    r_half: float,
    n: float = 1.0,
    host_ellipticity: float = 0.0,
    host_pa: float = 0.0,
    pixel_scale: float = PIXEL_SCALE / 2,
    width: float | None = None,
) -> Array:
    """Image the host galaxy of a quasar through the lens of `lens_images`.

    Parameters
    ----------
    einstein_radius, ellipticity, pa, shear, shear_pa
        The lens, as for `lens_images`.
    quasar : (float, float)
        Centre of the host without the lens: arcsec east and north of the lens.
    flux : float
        That of the whole host without the lens, erg s-1 cm-2 A-1.
    r_half : float
        Semi-major axis of the ellipse that holds half of its light, arcsec, without the lens.
    n : float
        Its Sersic index, 0.5 to 8.
    host_ellipticity, host_pa : float
        1 - b/a, in [0, 1), and position angle of its major axis in degrees, from north
        through east.
    pixel_scale : float
        Spacing of the samples, arcsec.
    width : float, optional
        Side of the image, arcsec. By default it holds the Einstein ring and a host of five
        half-light radii, all stretched by the shear.

    Returns
    -------
    ndarray, shape (m, m)
        Flux of each sample, erg s-1 cm-2 A-1: the mean surface brightness in it times its
        area. The sum is the lensed flux in the image, and over ``flux`` the total
        magnification, but for what lies outside. Row 0 is in the south and column 0 in the
        east; m is odd and the lens stands in the middle of the central sample. Neither PSF
        nor pixel is in it.

    Raises
    ------
    ImportError
        If lenstronomy is not installed: ``pip install "napari-issis[lens]"``.
    ValueError
        If a value is out of range, or the image would be too large; the message names it.

    Notes
    -----
    A lens conserves surface brightness: each ray is followed to the source (lenstronomy; Birrer
    & Amara 2018, Phys. Dark Univ. 22, 189), and the Sersic (1963) profile taken there, 25 rays
    a sample.
    """
    lens = IsothermalLens(einstein_radius, ellipticity, pa, shear, shear_pa)
    east, north = source_offset(quasar)
    r_half = positive("r_half", r_half, "arcsec")
    pixel_scale = positive("pixel_scale", pixel_scale, "arcsec")
    flux = positive("flux", flux, "erg s-1 cm-2 A-1", zero=True)
    if flux > BRIGHTEST:
        raise ValueError(f"flux is {flux:g}; it must be at most {BRIGHTEST:g} erg s-1 cm-2 A-1.")
    if not INDEX_RANGE[0] <= n <= INDEX_RANGE[1]:
        raise ValueError(f"n is {n}; it must be in [{INDEX_RANGE[0]}, {INDEX_RANGE[1]}].")
    if not 0 <= host_ellipticity < 1:
        raise ValueError(f"host_ellipticity is {host_ellipticity}; it must be in [0, 1).")
    if not np.isfinite(host_pa):
        raise ValueError(f"host_pa is {host_pa}; it must be a finite angle in degrees.")
    if width is None:
        reach = 2 * lens.radius + float(np.hypot(east, north)) + 5 * r_half
        width = 2 * reach / (1 - lens.shear)
    half = int(np.ceil(0.5 * positive("width", width, "arcsec") / pixel_scale))
    side = 2 * half + 1
    if side > MOST_SAMPLES:
        raise ValueError(
            f"the image would have {side} x {side} samples, more than {MOST_SAMPLES} a side; give "
            "a coarser pixel_scale or a smaller width."
        )
    places = np.arange(-half, half + 1) * pixel_scale
    steps = ((np.arange(RAYS) + 0.5) / RAYS - 0.5) * pixel_scale
    total = np.zeros((side, side))
    for dy in steps:
        for dx in steps:
            x, y = np.meshgrid(places + dx, places + dy)
            # x is to the west
            sx, sy = lens.model.ray_shooting(x.ravel(), y.ravel(), lens.values)
            brightness = _sersic(sx + east, sy - north, r_half, n, host_ellipticity, host_pa)
            total += brightness.reshape(side, side)
    arcs: Array = total * (flux * (pixel_scale / RAYS) ** 2)
    return arcs


def _sersic(x: Array, y: Array, r_half: float, n: float, ellipticity: float, pa: float) -> Array:
    """Surface brightness of a host of unit flux, per square arcsec; x to the west, y north."""
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    ratio = 1 - ellipticity
    along, across = -x * sin + y * cos, x * cos + y * sin
    radius = np.hypot(along, across / ratio) / r_half
    b = float(special.gammaincinv(2 * n, 0.5))
    # integral of exp(-b r^(1/n)) over the plane (Graham & Driver 2005, PASA 22, 118, eq. 4)
    light = 2 * np.pi * n * b ** (-2 * n) * special.gamma(2 * n) * r_half**2 * ratio
    profile: Array = np.exp(-b * radius ** (1 / n)) / light
    return profile

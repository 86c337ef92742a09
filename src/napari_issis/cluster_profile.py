"""Where the stars of a cluster stand: projected profiles, drawn from exactly."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt
from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from .instruments import PIXEL_SCALE
from .psf import positive
from .sources import FARTHEST

Array = NDArray[np.float64]

PROFILES = ("king", "plummer", "gaussian")
CONCENTRATION_RANGE = (0.0, 4.0)
# A Plummer star stands 1e4 radii or farther off with a chance of 1e-8.
LARGEST_RADIUS = 1e-4 * FARTHEST
# Halvings of an interval that leave less than a rounding error of it.
_HALVINGS = 64


@dataclass(frozen=True)
class ClusterProfile:
    """Projected number density of a cluster.

    Parameters
    ----------
    profile : {"king", "plummer", "gaussian"}
        With r the projected radius, the density is proportional to

        * [(1 + r^2/rc^2)^-1/2 - (1 + rt^2/rc^2)^-1/2]^2 inside the tidal radius rt, and 0
          outside (King 1962, AJ 67, 471, eq. 14);
        * (1 + r^2/a^2)^-2 (Plummer 1911, MNRAS 71, 460), which never ends: of 100 stars one
          stands farther off than 10 a;
        * exp(-r^2 / 2 sigma^2).
    centre : (float, float)
        x, y of the centre in pixels.
    radius : float or Quantity
        Projected half-number radius (half-light radius, where bright and faint stars are mixed):
        the semi-major axis of the ellipse that holds half of the stars, in pixels (or an
        angle). It is a of Plummer and 1.17741 sigma of the Gaussian.
    concentration : float
        King's log10(rt/rc), 0 to 4; the other profiles have none. Globular clusters: 0.5 to 2.5
        (Harris 1996, AJ 112, 1487).
    ellipticity : float
        1 - b/a of the isopleths, in [0, 1).
    pa : float or Quantity
        Position angle of the major axis in degrees, from +y counter-clockwise towards -x.
    pixel_scale : float
        Arcsec per pixel, for a radius given as an angle; by default that of ISSIS.

    Raises
    ------
    ValueError
        If a value is unknown or out of range; the message names it.
    """

    profile: str = "king"
    centre: tuple[float, float] = (256.0, 256.0)
    radius: Any = 50.0
    concentration: float = 1.0
    ellipticity: float = 0.0
    pa: Any = 0.0
    pixel_scale: float = PIXEL_SCALE

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        if self.profile not in PROFILES:
            raise ValueError(f"profile is {self.profile!r}; known: {', '.join(PROFILES)}.")
        try:
            x, y = self.centre
        except (TypeError, ValueError):
            raise ValueError(f"centre is {self.centre!r}; give (x, y) in pixels.") from None
        x, y = _number("centre", x, u.pix), _number("centre", y, u.pix)
        if not max(abs(x), abs(y)) <= FARTHEST:
            raise ValueError(f"centre is {self.centre!r}; it must be within {FARTHEST:g} pixels.")
        set_(self, "centre", (x, y))
        scale = positive("pixel_scale", self.pixel_scale, "arcsec per pixel")
        set_(self, "pixel_scale", scale)
        radius = _number("radius", self.radius, u.pix, scale)
        if not 0 < radius <= LARGEST_RADIUS:
            raise ValueError(
                f"radius is {radius:g}; it must be above 0 and at most {LARGEST_RADIUS:g} pixels."
            )
        set_(self, "radius", radius)
        concentration = _number("concentration", self.concentration)
        low, high = CONCENTRATION_RANGE
        if not low <= concentration <= high:
            raise ValueError(
                f"concentration is {concentration:g}; log10(rt/rc) must be in [{low}, {high}]."
            )
        set_(self, "concentration", concentration)
        ellipticity = _number("ellipticity", self.ellipticity)
        if not 0 <= ellipticity < 1:
            raise ValueError(f"ellipticity is {ellipticity:g}; it must be in [0, 1).")
        set_(self, "ellipticity", ellipticity)
        set_(self, "pa", _number("pa", self.pa, u.deg))

    @property
    def scale_radius(self) -> float:
        """Plummer's a, King's core radius rc, or the Gaussian's sigma, in pixels."""
        return float(self.radius / _half_number_radius(self.profile, self.concentration))

    @property
    def tidal_radius(self) -> float:
        """Where the cluster ends, in pixels; infinite but for King's profile."""
        return 10**self.concentration * self.scale_radius if self.profile == "king" else np.inf

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Draw positions.

        Parameters
        ----------
        count : int
            Number of stars.
        rng : numpy.random.Generator
            Source of randomness.

        Returns
        -------
        x, y : ndarray, shape (count,)
            Pixels.
        """
        fraction = rng.random(count)
        r = self.scale_radius * _radius_of(fraction, self.profile, self.concentration)
        angle = rng.uniform(0.0, 2 * np.pi, count)
        major, minor = r * np.cos(angle), (1 - self.ellipticity) * r * np.sin(angle)
        sin, cos = np.sin(np.radians(self.pa)), np.cos(np.radians(self.pa))
        return (
            self.centre[0] - sin * major + cos * minor,
            self.centre[1] + cos * major + sin * minor,
        )


def _half_number_radius(profile: str, concentration: float) -> float:
    return float(_radius_of(np.array([0.5]), profile, concentration)[0])


def _radius_of(fraction: Array, profile: str, concentration: float) -> Array:
    """Radius, in scale radii, inside which a fraction (0 to below 1) of the stars stands.

    Plummer: the fraction is r^2 / (1 + r^2). Gaussian: 1 - exp(-r^2/2).
    """
    if profile == "plummer":
        return np.asarray(np.sqrt(fraction / (1 - fraction)))
    if profile == "gaussian":
        return np.asarray(np.sqrt(-2 * np.log1p(-fraction)))
    tidal = 10.0**concentration
    wanted = fraction * _king_number(np.asarray(tidal), tidal)
    low, high = np.zeros(fraction.shape), np.full(fraction.shape, tidal)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        inside = _king_number(middle, tidal) < wanted
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(0.5 * (low + high))


def _king_number(r: Array, tidal: float) -> Array:
    """Stars inside r, both radii in core radii, but for the factor pi rc^2 k: eq. 18 of King."""
    x, edge = r**2, 1 + tidal**2
    return np.asarray(np.log1p(x) - 4 * x / (np.sqrt(1 + x) + 1) / sqrt(edge) + x / edge)


def _number(
    name: str,
    value: Any,
    unit: u.UnitBase = u.dimensionless_unscaled,
    pixel_scale: float | None = None,
) -> float:
    scale = [] if pixel_scale is None else u.pixel_scale(pixel_scale * u.arcsec / u.pix)
    try:
        number = float(u.Quantity(value, getattr(value, "unit", unit)).to_value(unit, scale))
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} is {value!r}; it must be a number ({unit or 'no unit'})."
        ) from None
    if not isfinite(number):
        raise ValueError(f"{name} is {number}; it must be finite.")
    return number

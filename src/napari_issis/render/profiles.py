"""Surface-brightness profiles as sums of Gaussians, and their Fourier transforms.

Every profile is circular here, of unit flux and half-light radius 1; an ellipse is its affine
image.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import special

from .lookup import Lookup

Array = NDArray[np.float64]


# Sersic indices between which profiles of index 0.5 to the second one are interpolated
NEAR_GAUSSIAN = (0.5, 0.51, 0.52, 0.53, 0.54, 0.55, 0.56)


@dataclass(frozen=True, eq=False)
class GaussianSum:
    """A profile as a sum of circular Gaussians.

    Attributes
    ----------
    sigma : ndarray, shape (n,)
        Widths over the half-light radius, in ascending order for an index above 0.51.
    fraction : ndarray, shape (n,)
        Fluxes; they sum to 1.
    """

    sigma: Array
    fraction: Array


def sersic_b(n: float) -> float:
    """Return b of exp(-b r^(1/n)), half of the light inside r = 1 (Ciotti 1991, A&A 249, 99)."""
    return float(special.gammaincinv(2 * n, 0.5))


def sersic_value(r: Array, n: float) -> Array:
    """Sersic profile of unit flux and half-light radius 1 at radii r."""
    b = sersic_b(n)
    total = 2 * np.pi * n * b ** (-2 * n) * special.gamma(2 * n)
    value: Array = np.exp(-b * r ** (1 / n)) / total
    return value


@lru_cache(maxsize=512)
def sersic_gaussians(n: float, digits: float) -> GaussianSum:
    """Sum of Gaussians equal to a Sersic profile to exp(-digits) of itself.

    Parameters
    ----------
    n : float
        Sersic index, at least 0.5.
    digits : float
        Natural logarithm of the accuracy wanted.

    Notes
    -----
    exp(-b u^beta), u = r^2, beta = 1 / (2n) <= 1, is the Laplace transform of a one-sided
    stable density (Feller 1971, vol. II, XIII.6), hence a positive superposition of Gaussians
    of precision t. The trapezoid rule in ln t converges like exp(-2 pi d / step), d being the
    half-width of the strip around the real axis in which the density is analytic and bounded:
    pi/2 for n >= 1, and pi (1 - beta) / (2 beta) about the density's bulk for n < 1, where a
    smooth change of variable takes the smaller steps that this asks for.
    """
    if n == 0.5:
        return GaussianSum(np.array([1 / np.sqrt(2 * np.log(2))]), np.ones(1))
    if n < NEAR_GAUSSIAN[1]:
        return _nearly_gaussian(n, digits)
    beta = 1 / (2 * n)
    strip = min(1.0, 0.7 * (1 - beta) / beta)
    step = np.pi**2 / (digits + 1.5)
    tau = np.arange(-80.0, 2 * (digits + 25) / (1 + beta) + 0.5 / strip, step)
    start = 0.5 / strip  # right of the bulk the steps grow to full size
    log_s = strip * tau + (1 - strip) * np.logaddexp(0, tau - start)
    weight = step * (strip + (1 - strip) * special.expit(tau - start))
    amplitude = weight * _stable_density_log(log_s, beta)
    b = sersic_b(n)
    log_t = log_s + np.log(b) / beta
    total = 2 * np.pi * n * b ** (-2 * n) * special.gamma(2 * n)
    fraction = amplitude * np.pi * np.exp(-log_t) / total
    sigma = np.sqrt(0.5) * np.exp(-0.5 * log_t)
    # far wings are dropped by their light; in the cusp much less light makes a high peak
    kept = fraction > np.where(sigma > 1, 1e-3, 1e-14) * np.exp(-digits)
    narrow_first = np.flatnonzero(kept)[::-1]
    return GaussianSum(sigma[narrow_first], fraction[narrow_first] / fraction[kept].sum())


def _nearly_gaussian(n: float, digits: float) -> GaussianSum:
    """Index just above 0.5, where the density is too narrow to sample.

    The profile is analytic in n, so that it is interpolated between sums of larger index.
    """
    nodes = np.array(NEAR_GAUSSIAN)
    sums = [sersic_gaussians(node, digits) for node in NEAR_GAUSSIAN]
    weights = [np.prod([(n - m) / (node - m) for m in nodes if m != node]) for node in nodes]
    return GaussianSum(
        np.concatenate([s.sigma for s in sums]),
        np.concatenate([w * s.fraction for w, s in zip(weights, sums, strict=True)]),
    )


def _stable_density_log(log_s: Array, beta: float) -> Array:
    """S times the one-sided stable density of index beta, at s = exp(log_s).

    Zolotarev's integral (Kanter 1975, Ann. Probab. 3, 697), by the tanh-sinh rule, which
    follows the integrand's peak towards either end.
    """
    power = 1 / (1 - beta)
    spacing = 0.03 * min(1.0, (1 - beta) / beta) ** 0.75  # the peak narrows as beta nears 1
    x = np.arange(-3.3, 3.3, spacing)
    u = 0.5 * np.pi * np.sinh(x)
    phi = np.pi / (1 + np.exp(-2 * u))
    from_end = np.pi / (1 + np.exp(2 * u))
    dphi = spacing * np.pi * 0.5 * np.pi * np.cosh(x) / np.cosh(u) ** 2 / 2
    sine = np.where(phi < from_end, np.sin(phi), np.sin(from_end))
    log_a = power * (
        beta * np.log(np.sin(beta * phi))
        + (1 - beta) * np.log(np.sin((1 - beta) * phi))
        - np.log(sine)
    )
    log_x = -beta * power * log_s[:, None]
    with np.errstate(over="ignore"):
        integrand = np.exp(log_a + log_x - np.exp(log_a + log_x))
    density: Array = beta * power / np.pi * (integrand @ dphi)
    return density


def sersic_transform(n: float, q: Array) -> Array:
    """Hankel transform of the unit-flux Sersic profile of half-light radius 1.

    Parameters
    ----------
    n : float
        Sersic index.
    q : ndarray
        2 pi times the frequency in cycles per half-light radius.
    """
    value: Array
    if n == 0.5:
        value = np.exp(-0.25 / np.log(2) * q**2)
    elif n == 1.0:
        square = 1 + (q / sersic_b(1.0)) ** 2
        value = 1 / (square * np.sqrt(square))
    else:
        with np.errstate(divide="ignore"):
            log_q = np.log(q)
        value = np.exp(_log_transform(n)(log_q))
    return value


# range of ln q tabulated: on its left every transform is 1, on its right nothing passes a PSF
LOG_Q_RANGE = (-23.0, 18.5)


@lru_cache(maxsize=512)
def _log_transform(n: float) -> Lookup:
    """Logarithm of the transform of the Sersic profile of index n, summed from its Gaussians."""
    gaussians = sersic_gaussians(n, 30.0)

    def logarithm(log_q: Array) -> Array:
        exponent = -0.5 * np.exp(2 * log_q)[:, None] * gaussians.sigma**2
        value = np.exp(np.maximum(exponent, -700.0)) @ gaussians.fraction
        log: Array = np.log(np.maximum(value, 1e-300))
        return log

    return Lookup(logarithm(np.linspace(*LOG_Q_RANGE, 4001)), *LOG_Q_RANGE)


def disc_envelope(q: Array) -> Array:
    """Bound of the modulus of `disc_transform`: sqrt(8 / pi) z^(-3/2), at most 1."""
    bound: Array = np.minimum(1.0, 1.6 * np.maximum(np.sqrt(2) * q, 1e-9) ** -1.5)
    return bound


# arguments up to which the disc's transform is tabulated
LARGEST_Z = 400.0


def disc_transform(q: Array, accuracy: float = 1e-13) -> Array:
    """2 J1(z) / z, z = sqrt(2) q: transform of the uniform disc of half-light radius 1.

    Parameters
    ----------
    q : ndarray
        2 pi times the frequency in cycles per half-light radius.
    accuracy : float
        Absolute error allowed, not below 1e-15: a coarser table is quicker.
    """
    z = np.sqrt(2) * q
    # the spline's error is h^4 / 384 times the fourth derivative, which is at most 1/8
    least = LARGEST_Z * (3e3 * max(accuracy, 2e-15)) ** -0.25
    value = _disc_table(2 ** int(np.ceil(np.log2(least))))(z)
    beyond = z > LARGEST_Z
    if beyond.any():
        value[beyond] = _disc_value(z[beyond])
    return value


@lru_cache(maxsize=16)
def _disc_table(intervals: int) -> Lookup:
    return Lookup(_disc_value(np.linspace(0.0, LARGEST_Z, intervals + 1)), 0.0, LARGEST_Z)


def _disc_value(z: Array) -> Array:
    value: Array = np.where(z > 1e-9, 2 * special.j1(z) / np.where(z > 1e-9, z, 1.0), 1.0)
    return value

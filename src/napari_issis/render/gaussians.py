"""The scene as elliptical Gaussians: what the meshes are painted with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal

from ..sources import SourceArrays
from .profiles import GaussianSum, sersic_gaussians

Array = NDArray[np.float64]

# Gaussians more elongated than this are cut along their major axis before they are painted
MOST_ELONGATED = 6.0
# Gaussians that take the place of a source's narrowest
NODES = 3
# profiles are decomposed to at least this accuracy, a natural logarithm
FEWEST_PROFILE_DIGITS = 4.0


@dataclass(frozen=True)
class Gaussians:
    """Elliptical Gaussians; every array has shape (n,).

    ``x y`` are centres in pixels, ``rate`` the count rate of each, ``xx xy yy`` the covariance
    in pixels squared, ``minor`` and ``major`` the standard deviations along the axes. ``pitch``
    is the spacing in pixels of equals that add up, as those of an image do, else infinite.
    """

    x: Array
    y: Array
    rate: Array
    xx: Array
    xy: Array
    yy: Array
    minor: Array
    major: Array
    pitch: Array

    def __len__(self) -> int:
        return self.x.size

    def take(self, chosen: NDArray[np.bool_] | NDArray[np.intp] | slice) -> Gaussians:
        """Return some of them."""
        return Gaussians(*(getattr(self, name)[chosen] for name in self.__dataclass_fields__))


def join(parts: list[Gaussians]) -> Gaussians:
    """Join lists of Gaussians."""
    return Gaussians(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in Gaussians.__dataclass_fields__
        )
    )


def ellipse(x: Array, y: Array, rate: Array, major: Array, minor: Array, pa: Array) -> Gaussians:
    """Gaussians from axes and position angles (radians, from +y towards -x)."""
    sin, cos = np.sin(pa), np.cos(pa)
    return Gaussians(
        x=x,
        y=y,
        rate=rate,
        xx=(major * sin) ** 2 + (minor * cos) ** 2,
        xy=(minor**2 - major**2) * sin * cos,
        yy=(major * cos) ** 2 + (minor * sin) ** 2,
        minor=minor,
        major=major,
        pitch=np.full_like(x, np.inf),
    )


def points(x: Array, y: Array, rate: Array) -> Gaussians:
    """Gaussians of no width."""
    zero = np.zeros_like(x)
    return Gaussians(x, y, rate, zero, zero, zero, zero, zero, np.full_like(x, np.inf))


def decompose(
    sources: SourceArrays,
    rate: Array,
    digits: Array,
    moment: float,
    allowed: float,
    cell: float,
) -> Gaussians:
    """Points and Sersic profiles of a scene as Gaussians; uniform ellipses and images are not.

    Parameters
    ----------
    sources : SourceArrays
        The scene.
    rate : ndarray, shape (n,)
        Count rates of the sources.
    digits : ndarray, shape (n,)
        Natural logarithms of the accuracies of the profiles.
    moment : float
        `Optics.moment` of order 4 NODES over the frequencies at which the Gaussians will be
        looked at.
    allowed : float
        Error in cps per pixel up to which narrow Gaussians of a source may be joined.
    cell : float
        Finest cell on which they will be painted, pixels.
    """
    is_point = sources.kind == "point"
    parts = [points(sources.x[is_point], sources.y[is_point], rate[is_point])]
    # sums of Gaussians are kept: few different accuracies
    digits = 2 * np.ceil(0.5 * np.maximum(digits, FEWEST_PROFILE_DIGITS))
    smooth = np.isfinite(sources.index)
    for n, accuracy in sorted(set(zip(sources.index[smooth], digits[smooth], strict=True))):
        chosen = np.flatnonzero((sources.index == n) & (digits == accuracy))
        profile = (float(n), float(accuracy))
        joined = _joinable(sersic_gaussians(*profile), sources.r_half[chosen], moment)
        joined = np.sum(np.abs(rate[chosen, None]) * joined <= allowed, axis=1)
        for count in np.unique(joined):
            alike = chosen[joined == count]
            sigma, fraction = _joined(profile, int(count))
            width = (sources.r_half[alike, None] * sigma).ravel()
            row = np.repeat(alike, sigma.size)
            parts.append(
                ellipse(
                    sources.x[row],
                    sources.y[row],
                    (rate[alike, None] * fraction).ravel(),
                    width,
                    width * (1 - sources.ellipticity[row]),
                    np.radians(sources.pa[row]),
                )
            )
    everything = join(parts)
    longest = float(digits.max(initial=FEWEST_PROFILE_DIGITS))
    return _shorten(everything.take(everything.rate != 0), longest, 4 * cell)


def _joinable(gaussians: GaussianSum, r_half: Array, moment: float) -> Array:
    """Bound of the error, per rate, that `_joined` makes of the narrowest 1, 2, ... Gaussians.

    An n-point Gauss rule for exp(-x s), 0 < s < s_max, is wrong by 2 (x s_max / 4)^(2n) / (2n)!
    at most, times the weight; x s = 2 pi^2 k^2 sigma^2 here.
    """
    n = NODES
    flux = np.cumsum(np.abs(gaussians.fraction))
    largest = np.maximum.accumulate(
        flux * (0.5 * np.pi**2 * (r_half[:, None] * gaussians.sigma) ** 2) ** (2 * n), axis=1
    )
    bound: Array = largest * (2 * moment / factorial(2 * n))
    return bound


@lru_cache(maxsize=512)
def _joined(profile: tuple[float, float], count: int) -> tuple[Array, Array]:
    """Widths and fractions of a profile with the ``count`` narrowest Gaussians in NODES ones.

    The nodes and weights are those of the Gauss rule for the discrete measure of the squared
    widths (Gautschi 2004, Orthogonal Polynomials, 2.2.3: Stieltjes' procedure).
    """
    gaussians = sersic_gaussians(*profile)
    sigma, fraction = gaussians.sigma, gaussians.fraction
    if count <= NODES or np.any(fraction[:count] < 0):
        return sigma, fraction
    s, weight = sigma[:count] ** 2 / sigma[count - 1] ** 2, fraction[:count]
    diagonal, beside = np.zeros(NODES), np.zeros(NODES)
    before, now = np.zeros(count), np.full(count, 1 / np.sqrt(weight.sum()))
    for i in range(NODES):
        diagonal[i] = np.sum(weight * s * now**2)
        after = (s - diagonal[i]) * now - beside[i - 1] * before
        norm = np.sqrt(np.sum(weight * after**2))
        beside[i] = norm
        before, now = now, after / norm
    nodes, vectors = eigh_tridiagonal(diagonal, beside[:-1])
    return (
        np.concatenate([sigma[count - 1] * np.sqrt(np.maximum(nodes, 0.0)), sigma[count:]]),
        np.concatenate([weight.sum() * vectors[0] ** 2, fraction[count:]]),
    )


def _shorten(gaussians: Gaussians, digits: float, shortest: float) -> Gaussians:
    """Cut long Gaussians into chains of shorter ones.

    A Gaussian is the convolution of a shorter one with another, which the trapezoid rule with
    a spacing d replaces by a chain. Its error is exp(-2 pi^2 sigma^2 / d^2), sigma being the
    width of the product of the two, at most that of either.
    """
    long = gaussians.major > np.maximum(MOST_ELONGATED * gaussians.minor, shortest)
    if not long.any():
        return gaussians
    parts = [gaussians.take(~long)]
    for i in np.flatnonzero(long):
        one = gaussians.take(slice(i, i + 1))
        minor, major = float(one.minor[0]), float(one.major[0])
        link = max(0.6 * MOST_ELONGATED * minor, 0.6 * shortest, 0.01 * major)
        rest = np.sqrt(major**2 - link**2)
        spacing = link * rest / major * np.sqrt(2 * np.pi**2 / (digits + 2))
        count = int(np.ceil(rest * np.sqrt(2 * (digits + 2)) / spacing))
        offset = np.arange(-count, count + 1) * spacing
        weight = np.exp(-0.5 * (offset / rest) ** 2)
        weight /= weight.sum()
        angle = 0.5 * np.arctan2(-2 * one.xy[0], one.yy[0] - one.xx[0])
        full = np.full_like(offset, 1.0)
        parts.append(
            ellipse(
                one.x - offset * np.sin(angle),
                one.y + offset * np.cos(angle),
                one.rate * weight,
                link * full,
                minor * full,
                angle * full,
            )
        )
    return join(parts)

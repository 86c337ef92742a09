"""The scene as elliptical Gaussians: what the meshes are painted with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..sources import SourceArrays
from .profiles import sersic_gaussians

Array = NDArray[np.float64]

# Gaussians more elongated than this are cut along their major axis before they are painted
MOST_ELONGATED = 6.0


@dataclass(frozen=True)
class Gaussians:
    """Elliptical Gaussians; every array has shape (n,).

    ``x y`` are centres in pixels, ``rate`` the count rate of each, ``xx xy yy`` the covariance
    in pixels squared, ``minor`` and ``major`` the standard deviations along the axes.
    """

    x: Array
    y: Array
    rate: Array
    xx: Array
    xy: Array
    yy: Array
    minor: Array
    major: Array

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
    )


def points(x: Array, y: Array, rate: Array) -> Gaussians:
    """Gaussians of no width."""
    zero = np.zeros_like(x)
    return Gaussians(x, y, rate, zero, zero, zero, zero, zero)


def decompose(
    sources: SourceArrays, rate: Array, digits: float, merge: float, allowed: float, cell: float
) -> Gaussians:
    """Points and Sersic profiles of a scene as Gaussians; uniform ellipses are left out.

    Parameters
    ----------
    sources : SourceArrays
        The scene.
    rate : ndarray, shape (n,)
        Count rates of the sources.
    digits : float
        Natural logarithm of the accuracy of the profiles.
    merge : float
        Highest frequency, cycles per pixel, at which the Gaussians will be looked at.
    allowed : float
        Error in cps per pixel up to which narrow Gaussians of a source may be joined.
    cell : float
        Finest cell on which they will be painted, pixels.
    """
    is_point = sources.kind == "point"
    parts = [points(sources.x[is_point], sources.y[is_point], rate[is_point])]
    for n in np.unique(sources.index[np.isfinite(sources.index)]):
        chosen = sources.index == n
        gaussians = sersic_gaussians(float(n), digits)
        order = np.argsort(gaussians.sigma)
        sigma, fraction = gaussians.sigma[order], gaussians.fraction[order]
        r_half, share = sources.r_half[chosen], rate[chosen]
        joined, first = _join_narrow(sigma, fraction, r_half, share, merge, allowed)
        keep = np.arange(sigma.size) >= first[:, None]
        row, column = np.nonzero(keep)
        width = np.concatenate([joined[1], r_half[row] * sigma[column]])
        flux = np.concatenate([joined[0], share[row] * fraction[column]])
        row = np.concatenate([np.arange(r_half.size), row])
        x, y, ratio, pa = (
            values[chosen][row]
            for values in (sources.x, sources.y, 1 - sources.ellipticity, np.radians(sources.pa))
        )
        parts.append(ellipse(x, y, flux, width, width * ratio, pa))
    everything = join(parts)
    return _shorten(everything.take(everything.rate != 0), digits, 4 * cell)


def _join_narrow(
    sigma: Array, fraction: Array, r_half: Array, rate: Array, merge: float, allowed: float
) -> tuple[tuple[Array, Array], NDArray[np.intp]]:
    """Join each source's narrowest Gaussians into one of the same flux and variance.

    Their transforms differ by about flux (2 pi^2 k^2 sigma^2)^2 / 8 at frequency k.
    """
    flux = np.cumsum(fraction)
    mean_square = np.cumsum(fraction * sigma**2) / flux
    exponent = 2 * (np.pi * merge * r_half[:, None] * sigma) ** 2
    error = np.abs(rate[:, None] * flux) * exponent**2 / 8 * np.pi * merge**2
    first = np.sum(np.logical_and.accumulate(error <= allowed, axis=1), axis=1)
    last = np.maximum(first - 1, 0)
    some = first > 0
    return (
        (
            np.where(some, rate * flux[last], 0.0),
            np.where(some, r_half * np.sqrt(np.abs(mean_square[last])), 0.0),
        ),
        first,
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

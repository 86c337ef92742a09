"""A pixel model of stars and a galaxy under a Gaussian PSF, and maximum-likelihood fits of it.

It shares nothing with the package: stars are error functions, the galaxy is a sum of Gaussians
fitted to the de Vaucouleurs law, and derivatives are theirs, in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

Array = NDArray[np.float64]

# I(r) = exp(-B (r / r_half)^(1/4)); Ciotti & Bertin (1999, A&A 352, 447)
B = 7.66924944


@dataclass(frozen=True)
class PixelModel:
    """Count rates of stars and, if wanted, one de Vaucouleurs galaxy behind them.

    Parameters
    ----------
    sigma : float
        Of the PSF, pixels.
    sky : float
        Count rate per pixel.
    shape : (int, int)
        Frame (y, x) in pixels.
    stars : int
        How many. Parameters are rate, x, y of each star, then rate, x, y, r_half,
        ellipticity, pa of the galaxy.
    galaxy : bool
        Whether there is one.
    """

    sigma: float
    sky: float
    shape: tuple[int, int]
    stars: int
    galaxy: bool = False

    def image(self, parameters: Array) -> Array:
        """Count rate per pixel, flat."""
        cut = 3 * self.stars
        total = np.full(self.shape, self.sky)
        for rate, x, y in parameters[:cut].reshape(-1, 3):
            total += rate * np.outer(self._along(y, 0)[0], self._along(x, 1)[0])
        if self.galaxy:
            total += parameters[cut] * self._galaxy(*parameters[cut + 1 :], slopes=False)[0]
        return total.ravel()

    def slopes(self, parameters: Array) -> Array:
        """Return derivatives of the image by the parameters, shape (parameters, pixels)."""
        cut = 3 * self.stars
        result = []
        for rate, x, y in parameters[:cut].reshape(-1, 3):
            (value_y, slope_y), (value_x, slope_x) = self._along(y, 0), self._along(x, 1)
            result += [np.outer(value_y, value_x), rate * np.outer(value_y, slope_x)]
            result += [rate * np.outer(slope_y, value_x)]
        if self.galaxy:
            rate, own = parameters[cut], parameters[cut + 1 :]
            image, *slopes = self._galaxy(*own)
            result += [image, *(rate * each for each in slopes)]
        return np.array([each.ravel() for each in result])

    def _along(self, centre: float, axis: int) -> tuple[Array, Array]:
        """Share of a star's light in each row or column, and its derivative by the centre."""
        edges = np.arange(self.shape[axis] + 1) - 0.5 - centre
        value = np.diff(0.5 * special.erf(edges / (np.sqrt(2) * self.sigma)))
        density = np.exp(-((edges / self.sigma) ** 2) / 2) / (np.sqrt(2 * np.pi) * self.sigma)
        return value, -np.diff(density)

    def _galaxy(
        self,
        x: float,
        y: float,
        r_half: float,
        ellipticity: float,
        pa: float,
        *,
        slopes: bool = True,
    ) -> list[Array]:
        """Image of a galaxy of rate 1 and its derivatives by these parameters.

        The pixel is a Gaussian of its variance, 1/12.
        """
        dy = (np.arange(self.shape[0]) - y)[:, None]
        dx = (np.arange(self.shape[1]) - x)[None, :]
        sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
        along, across = dy * cos - dx * sin, dy * sin + dx * cos
        along2, across2 = along**2, across**2
        blur, ratio = self.sigma**2 + 1 / 12, 1 - ellipticity
        image, per_major, per_minor, by_size, by_ratio = np.zeros((5, *self.shape))
        for width, weight in zip(*_mixture(), strict=True):
            major, minor = (r_half * width) ** 2 + blur, (r_half * ratio * width) ** 2 + blur
            height = weight / (2 * np.pi * np.sqrt(major * minor))
            one = height * np.exp(-0.5 * (along2 / major + across2 / minor))
            image += one
            if slopes:
                per_major += one / major
                per_minor += one / minor
                by_major = one * (along2 / major - 1) / (2 * major)
                by_minor = one * (across2 / minor - 1) / (2 * minor)
                by_size += 2 * r_half * width**2 * (by_major + ratio**2 * by_minor)
                by_ratio += 2 * r_half**2 * ratio * width**2 * by_minor
        if not slopes:
            return [image]
        turn = along * across * (per_major - per_minor)
        return [
            image,
            across * cos * per_minor - along * sin * per_major,
            across * sin * per_minor + along * cos * per_major,
            by_size,
            -by_ratio,
            np.radians(turn),
        ]


@lru_cache(maxsize=1)
def _mixture() -> tuple[Array, Array]:
    """Widths in r_half and weights of Gaussians that add up to a de Vaucouleurs galaxy."""
    widths = np.geomspace(2e-3, 12.0, 22)
    r = np.geomspace(1e-4, 30.0, 3000)
    wanted = np.exp(-B * r**0.25) * B**8 / (np.pi * factorial(8))
    shapes = np.exp(-0.5 * (r[:, None] / widths) ** 2) / (2 * np.pi * widths**2)
    # both the light in equal steps of ln r and the brightness count
    measure = r * (1 + r)
    weights, _ = optimize.nnls(shapes * measure[:, None], wanted * measure)
    return widths[weights > 0], weights[weights > 0]


def fit(model: PixelModel, counts: Array, exposure: float, start: Array, scale: Array) -> Array:
    """Maximum-likelihood parameters by Levenberg-Marquardt on the roots of the deviance.

    Parameters
    ----------
    model : PixelModel
        What is fitted.
    counts : ndarray
        The exposure, flat.
    exposure : float
        Seconds.
    start, scale : ndarray, shape (parameters,)
        Where the fit starts, and about how far it may have to go.
    """
    constant = special.xlogy(counts, counts) - counts

    def mean(scaled: Array) -> Array:
        return np.maximum(exposure * model.image(start + scaled * scale), 1e-12)

    def residual(scaled: Array) -> Array:
        m = mean(scaled)
        half = m + constant - counts * np.log(m)
        signed: Array = np.sign(m - counts) * np.sqrt(2 * np.maximum(half, 0.0))
        return signed

    def slope(scaled: Array) -> Array:
        m, r = mean(scaled), residual(scaled)
        close = np.abs(m - counts) < 1e-4 * np.sqrt(m)
        per_mean = np.where(close, 1 / np.sqrt(m), (1 - counts / m) / np.where(close, 1.0, r))
        slopes: Array = model.slopes(start + scaled * scale) * (exposure * scale[:, None])
        jacobian: Array = (slopes * per_mean).T
        return jacobian

    best = optimize.least_squares(
        residual, np.zeros(start.size), slope, method="lm", xtol=1e-4, ftol=1e-9, max_nfev=200
    )
    result: Array = start + best.x * scale
    return result

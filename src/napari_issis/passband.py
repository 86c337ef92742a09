"""A channel seen through its filters: effective area, flat spectra, lines and continua."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .filters import Filter

Array = NDArray[np.float64]

# Planck constant times speed of light, erg angstrom (SI 2019, exact).
HC = 6.62607015e-27 * 2.99792458e18
# Nodes of each piece between two samples. The integrands are polynomials of degree 5 at most,
# or such a polynomial over the wavelength, smooth on a channel's band.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Passband:
    """A channel's response behind filters.

    Parameters
    ----------
    band : (float, float)
        The channel's spectral range, angstrom; no light is counted outside it.
    cps_per_flux : float
        Count rate in cps of 1 erg s-1 cm-2 A-1 without filters.
    filters : tuple of Filter
        The curves in the light path.
    response : Filter, optional
        Shape of the effective area without filters; constant over the band by default.

    Notes
    -----
    The count rate of a flux density F is int A T F lambda / (h c) dlambda with the effective
    area A and the transmission T for a photon-counting detector. ``cps_per_flux`` fixes A.
    """

    band: tuple[float, float]
    cps_per_flux: float
    filters: tuple[Filter, ...] = ()
    response: Filter | None = None

    @cached_property
    def unfiltered_moment(self) -> float:
        """Integral of R lambda over the band, R the response without filters."""
        if self.response is not None:
            return Passband(self.band, self.cps_per_flux, (self.response,))._moment(1)
        low, high = self.band
        return 0.5 * (high**2 - low**2)

    @property
    def area(self) -> float:
        """Largest effective area without filters, cm2; its mean without a response."""
        return self.cps_per_flux * HC / self.unfiltered_moment

    def transmission(self, wavelength: ArrayLike) -> Array:
        """Product of the filters' transmissions, 0 outside the band; wavelengths in angstrom."""
        wavelength = np.asarray(wavelength, dtype=np.float64)
        low, high = self.band
        value: Array = np.where((wavelength >= low) & (wavelength <= high), 1.0, 0.0)
        for one in self.filters:
            value = value * one(wavelength)
        return value

    @property
    def _curves(self) -> tuple[Filter, ...]:
        return self.filters if self.response is None else (*self.filters, self.response)

    def relative_response(self, wavelength: ArrayLike) -> Array:
        """Effective area with the filters over ``area``; wavelengths in angstrom."""
        value = self.transmission(wavelength)
        return value if self.response is None else value * self.response(wavelength)

    def effective_area(self, wavelength: ArrayLike) -> Array:
        """Effective area with the filters, cm2; wavelengths in angstrom."""
        return self.area * self.relative_response(wavelength)

    @cached_property
    def transmittance(self) -> float:
        """Share of the counts of a flat spectrum (constant F_lambda) that the filters pass."""
        return self._moment(1) / self.unfiltered_moment if self.filters else 1.0

    @cached_property
    def pivot(self) -> float:
        """Pivot wavelength, angstrom.

        lambda_p^2 = int R lambda dlambda / int R / lambda dlambda, R area times transmission
        (Bessell & Murphy 2012, PASP 124, 140, eq. A15).
        """
        return sqrt(self._moment(1) / self._moment(-1))

    @cached_property
    def equivalent_band(self) -> tuple[float, float]:
        """Rectangular band of the same mean wavelength and variance, angstrom.

        It stands for the response where only a band can be given. Not wider than the channel's.
        """
        total = self._moment(0)
        mean = self._moment(1) / total
        spread = sqrt(3 * max(self._moment(2) / total - mean**2, 0.0))
        low, high = self.band
        return max(mean - spread, low), min(mean + spread, high)

    def line_rate(self, flux: float, wavelength: float) -> float:
        """Count rate, cps, of a line of ``flux`` erg s-1 cm-2 at a wavelength in angstrom."""
        return float(flux * self.effective_area(wavelength) * wavelength / HC)

    def continuum_rate(self, wavelength: Array, flux: Array) -> float:
        """Count rate of a spectrum, cps.

        Parameters
        ----------
        wavelength : ndarray, shape (n,)
            In angstrom, increasing.
        flux : ndarray, shape (n,)
            In erg s-1 cm-2 A-1; linear in between, constant outside.
        """
        nodes, weights = self._quadrature(wavelength)
        return self.area * float(weights @ (np.interp(nodes, wavelength, flux) * nodes)) / HC

    def photon_rate(self, wavelength: Array, photons: Array) -> float:
        """Count rate of a spectrum in photon s-1 cm-2 A-1, cps; else as `continuum_rate`."""
        nodes, weights = self._quadrature(wavelength)
        return self.area * float(weights @ np.interp(nodes, wavelength, photons))

    def moment_of(self, spectrum: Callable[[Array], Array], knots: Array) -> float:
        """Integral of R T F lambda over the band, for a spectrum F smooth between ``knots``."""
        nodes, weights = self._quadrature(knots)
        return float(weights @ (spectrum(nodes) * nodes))

    def _moment(self, power: int) -> float:
        """Integral of R T lambda^power over the band."""
        nodes, weights = self._quadrature()
        return float(weights @ nodes**power)

    def _quadrature(self, *samples: Array) -> tuple[Array, Array]:
        """Nodes and weights, the weights times response and transmission."""
        low, high = self.band
        knots = np.concatenate([[low, high], *samples, *(one.wavelength for one in self._curves)])
        knots = np.unique(knots[(knots >= low) & (knots <= high)])
        half = 0.5 * np.diff(knots)[:, None]
        nodes = (knots[:-1, None] + half * (1 + _NODES)).ravel()
        return nodes, (half * _WEIGHTS).ravel() * self.relative_response(nodes)

"""The telescope's transfer function and PSF from their textbook formulas, by quadrature.

Nothing here is taken from the package that is measured. Lengths are in pixels, frequencies in
cycles per pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import j0

Array = NDArray[np.float64]


def gauss_panels(edges: Array, order: int) -> tuple[Array, Array]:
    """Nodes and weights of Gauss-Legendre quadrature on each panel between the edges."""
    x, w = np.polynomial.legendre.leggauss(order)
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    return (middle + half * x).ravel(), (half * w).ravel()


@dataclass(frozen=True)
class ExactOptics:
    """Annular aperture at one wavelength with a Gaussian blur.

    ``cutoff`` is diameter / wavelength in cycles per pixel, ``blur`` a standard deviation in
    pixels, ``reach`` the largest radius of `psf`.
    """

    cutoff: float
    obscuration: float
    blur: float
    reach: float

    def transfer(self, k: Array) -> Array:
        """OTF by O'Neill (1956): the autocorrelation of the annulus."""
        nu, e = np.minimum(k / self.cutoff, 1.0), self.obscuration
        whole = _circle(nu)
        hole = e**2 * _circle(np.minimum(nu / e, 1.0))
        cross = np.full_like(nu, 2 * e**2)
        middle = (nu > (1 - e) / 2) & (nu < (1 + e) / 2)
        d = 2 * nu[middle]
        angle_1 = np.arccos((d**2 + 1 - e**2) / (2 * d))
        angle_e = np.arccos((d**2 + e**2 - 1) / (2 * d * e))
        kite = np.sqrt((1 + e + d) * (1 + e - d) * (d + 1 - e) * (d - 1 + e))
        cross[middle] = 2 * (angle_1 + e**2 * angle_e - 0.5 * kite) / np.pi
        cross[nu >= (1 + e) / 2] = 0.0
        blur = np.exp(-2 * (np.pi * self.blur * k) ** 2)
        value: Array = (whole + hole - cross) / (1 - e**2) * blur
        return value

    def radial_nodes(self, cycles: float, lowest: float = 0.0) -> tuple[Array, Array]:
        """Frequencies and weights for integrands that turn ``cycles`` times per unit of k.

        Panels end where the OTF is not smooth; near such ends the nodes crowd like t^2, which
        turns its powers of 3/2 into polynomials. Below ``lowest`` panels halve.
        """
        e = self.obscuration
        kinks = np.array([0.0, (1 - e) / 2, e, (1 + e) / 2, 1.0]) * self.cutoff
        nodes, weights = [], []
        for low, high in zip(*(lambda s: (s[:-1], s[1:]))(np.sort(kinks)), strict=True):
            panels = max(2, int(np.ceil((high - low) * cycles / 6)))
            edges = np.linspace(0, 1, panels + 1)
            if low == 0 and lowest:
                halvings = int(np.log2(edges[1] * high / lowest)) // 2 + 1
                edges = np.concatenate(
                    [[0.0], edges[1] * 2.0 ** np.arange(-halvings, 0), edges[1:]]
                )
            t, w = gauss_panels(edges, 32)
            smooth, slope = t**2 * (3 - 2 * t), 6 * t * (1 - t)
            nodes.append(low + (high - low) * smooth)
            weights.append((high - low) * slope * w)
        return np.concatenate(nodes), np.concatenate(weights)

    @cached_property
    def _radial(self) -> tuple[Array, Array]:
        return self.radial_nodes(cycles=self.reach * 1.1)

    def psf(self, r: Array) -> Array:
        """PSF at radii r up to ``reach``, per square pixel, from a table of Chebyshev panels."""
        panel = np.minimum((r / PANEL).astype(int), self._table.shape[0] - 1)
        t = 2 * (r / PANEL - panel) - 1
        coefficients = self._table[panel]
        previous, value = np.zeros_like(r), np.zeros_like(r)
        for column in range(ORDER - 1, 0, -1):  # Clenshaw's recurrence
            previous, value = value, 2 * t * value - previous + coefficients[..., column]
        result: Array = t * value - previous + coefficients[..., 0]
        return result

    @cached_property
    def _table(self) -> Array:
        k, w = self._radial
        weight = 2 * np.pi * w * k * self.transfer(k)
        t = np.cos(np.pi * (np.arange(ORDER) + 0.5) / ORDER)
        inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(t, ORDER - 1))
        rows = []
        for start in np.arange(0, self.reach, PANEL):
            r = start + 0.5 * PANEL * (t + 1)
            rows.append(inverse @ (j0(2 * np.pi * r[:, None] * k) @ weight))
        return np.array(rows)


# size in pixels and polynomial order of the radial table's panels
PANEL = 1.0
ORDER = 20


def _circle(nu: Array) -> Array:
    return 2 / np.pi * (np.arccos(nu) - nu * np.sqrt((1 - nu) * (1 + nu)))

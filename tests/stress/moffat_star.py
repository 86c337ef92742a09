"""A star's light in a pixel through a Moffat PSF, by quadrature of the profile itself."""

import numpy as np

NODE, WEIGHT = np.polynomial.legendre.leggauss(20)


def rate(dy, dx, fwhm, beta):
    """Share of the light in the unit pixel (dy, dx) away; all in pixels."""
    a = fwhm / (2 * np.sqrt(2 ** (1 / beta) - 1))
    sides = []
    for d in (dy, dx):
        edges = np.concatenate([[d - 0.5, d + 0.5, 0.0], a * 2.0 ** np.arange(-2, 12)])
        edges = np.unique(np.concatenate([edges, -edges]))
        edges = edges[(edges >= d - 0.5) & (edges <= d + 0.5)]
        half = 0.5 * np.diff(edges)[:, None]
        sides.append(((edges[:-1, None] + half * (NODE + 1)).ravel(), (half * WEIGHT).ravel()))
    (y, wy), (x, wx) = sides
    profile = (beta - 1) / (np.pi * a**2) * (1 + (y[:, None] ** 2 + x**2) / a**2) ** -beta
    return float(wy @ profile @ wx)

"""One ellipse of any size and elongation through a Gaussian PSF, by real-space quadrature.

Nothing of the package and no Fourier transform. Everything is in pixels and of unit count rate.
Where `quadrature.rate` walks around the source, which takes ever more steps the longer it is,
this walks over the pixel's neighbourhood in the source's own axes.
"""

import numpy as np

from quadrature import brightness, pixel_share

NODE, WEIGHT = np.polynomial.legendre.leggauss(12)


def composite(edges):
    """Gauss-Legendre nodes and weights on consecutive panels."""
    half = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (NODE + 1)).ravel(), (half * WEIGHT).ravel()


def graded(low, high, step, scale, n):
    """Panel edges from low to high, at most ``step`` wide and crowding about zero.

    ``scale`` is the half-light radius, below which the cusp is followed for nine decades.
    """
    edges = np.linspace(low, high, int(np.ceil((high - low) / step)) + 1)
    reach = max(abs(low), abs(high))
    cusp = np.geomspace(1e-9 * scale, max(reach, 1e-8 * scale), int(np.log(reach / scale) + 22) + 2)
    # below the index 1 a profile varies over its own size, not its distance from the centre
    body = np.arange(1, 13) * scale if n < 1 else []
    edges = np.concatenate([edges, cusp, -cusp, body, np.negative(body), [0.0]])
    return np.unique(edges[(edges >= low) & (edges <= high)])


def rate(source, pixels, sigma):
    """Rate of one source of unit count rate in some pixels.

    ``source`` is (kind, x, y, r_half, ellipticity, pa, n), ``pixels`` a sequence of (y, x).
    """
    kind, x, y, r_half, ellipticity, pa, n = source
    sin, cos = np.sin(np.radians(pa)), np.cos(np.radians(pa))
    ratio = 1 - ellipticity
    reach = np.sqrt(0.5) + 9 * sigma
    if kind == "point":
        pixels = np.asarray(pixels, dtype=float)
        return pixel_share(pixels[:, 0] - y, pixels[:, 1] - x, sigma)
    one = _disc_pixel if kind == "uniform" else _sersic_pixel
    result = []
    for py, px in pixels:
        dy, dx = py - y, px - x

        def share(along, across, dy=dy, dx=dx):
            return pixel_share(
                dy - along * cos - across * sin, dx + along * sin - across * cos, sigma
            )

        along, across = dy * cos - dx * sin, dy * sin + dx * cos
        result.append(one(share, along, across, reach, sigma, r_half, ratio, n))
    return np.array(result)


def _sersic_pixel(share, along, across, reach, sigma, r_half, ratio, n):
    step = 1.2 * sigma
    # light beyond this radius is below 1e-18 of all, whatever the index
    last = r_half * max(60.0**n, 20.0)
    windows = []
    for centre, squeeze in ((along, 1.0), (across, ratio)):
        low, high = (np.clip((centre + d) / squeeze, -last, last) for d in (-reach, reach))
        if low == high:
            return 0.0
        windows.append(composite(graded(low, high, step / squeeze, r_half, n)))
    (u, du), (w, dw) = windows
    value = 0.0
    for part in np.array_split(np.arange(u.size), u.size * w.size // 400_000 + 1):
        r = np.hypot(u[part, None], w) / r_half
        light = brightness("", n, r) * share(u[part, None], ratio * w)
        value += du[part] @ light @ dw
    return value / r_half**2


def _disc_pixel(share, along, across, reach, sigma, r_half, ratio, n):
    a = np.sqrt(2) * r_half
    b = ratio * a
    # u = a sin(phi) takes the root out of the disc's edge
    low, high = (np.arcsin(np.clip((along + d) / a, -1, 1)) for d in (-reach, reach))
    length = a * max(np.sin(high) - np.sin(low), (high - low) * np.cos(max(low, -high, 0)))
    phi, dphi = composite(np.linspace(low, high, int(3 * length / sigma) + 24))
    value = 0.0
    for p, dp in zip(phi, dphi, strict=True):
        chord = b * np.cos(p)
        v, dv = (np.clip((across + d) / chord, -1, 1) * chord for d in (-reach, reach))
        if v == dv:
            continue
        v, dv = composite(np.linspace(v, dv, int((dv - v) / (1.2 * sigma)) + 2))
        value += dp * a * np.cos(p) * (dv @ share(a * np.sin(p), v))
    return value / (np.pi * a * b)

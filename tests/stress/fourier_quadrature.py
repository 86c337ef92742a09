"""Count rates in single pixels by direct quadrature of the Fourier integral; nothing periodic.

Nothing of the package. Frequencies are in cycles per pixel, sources of unit count rate. The
integral is done in polar coordinates: Gauss-Legendre panels in radius that crowd at every kink
of the transfer function, equidistant points in angle.
"""

from functools import lru_cache

import numpy as np
from scipy import special
from scipy.interpolate import make_interp_spline

NODE, WEIGHT = np.polynomial.legendre.leggauss(16)
INDEX = {"gaussian": 0.5, "exponential": 1.0, "devaucouleurs": 4.0}


def gaussian(fwhm):
    """Transfer function, its kinks and its end, of a Gaussian of that FWHM in pixels."""
    sigma = fwhm / np.sqrt(8 * np.log(2))
    return lambda k: np.exp(-2 * (np.pi * sigma * k) ** 2), [], 1.4 / sigma


def moffat(fwhm, beta):
    """The same of a Moffat profile: its Hankel transform is a Macdonald function."""
    a = fwhm / (2 * np.sqrt(2 ** (1 / beta) - 1))

    def otf(k):
        x = 2 * np.pi * a * k
        order = beta - 1
        return 2 / special.gamma(order) * (x / 2) ** order * special.kv(order, x)

    return otf, [], (40 + 8 * np.log1p(beta)) / (2 * np.pi * a)


def telescope(diameter, obscuration, low, high, blur_fwhm, pixel):
    """The same of an annular aperture: metres, angstrom, arcsec; photons are the weights."""
    radian = 180 * 3600 / np.pi
    cutoff = [diameter / (w * 1e-10) / radian * pixel for w in (low, high)]
    kinks = sorted({obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2, 1.0} - {0.0})
    sigma = blur_fwhm / pixel / np.sqrt(8 * np.log(2))

    def otf(k):
        nu = k / cutoff[0]
        if low == high:
            value = _annulus(nu, obscuration)
        else:
            value = _band(nu, obscuration, high / low, kinks)
        return value * np.exp(-2 * (np.pi * sigma * k) ** 2)

    edges = sorted({c * e for c in cutoff for e in kinks})
    end = cutoff[0] if sigma == 0 else min(cutoff[0], 1.4 / sigma)
    return otf, [e for e in edges if e < end], end


def _overlap(first, second, d):
    """Area common to two circles whose centres are d apart."""
    crossing = (d > abs(first - second)) & (d < first + second)
    s = np.where(crossing, d, max(first, second))
    cos_1 = (s**2 + first**2 - second**2) / (2 * s * first)
    cos_2 = (s**2 + second**2 - first**2) / (2 * s * second)
    kite = (first + second - s) * (s + first - second) * (s - first + second)
    kite = 0.5 * np.sqrt(np.maximum(kite * (s + first + second), 0))
    area = first**2 * np.arccos(np.clip(cos_1, -1, 1)) - kite
    area = area + second**2 * np.arccos(np.clip(cos_2, -1, 1))
    whole = np.pi * min(first, second) ** 2
    return np.where(crossing, area, np.where(d <= abs(first - second), whole, 0.0))


def _annulus(nu, obscuration):
    d = 2 * nu
    area = _overlap(1.0, 1.0, d)
    if obscuration:
        area = area - 2 * _overlap(1.0, obscuration, d) + _overlap(obscuration, obscuration, d)
    return area / (np.pi * (1 - obscuration**2))


def _band(nu, obscuration, ratio, kinks):
    """Mean over wavelength, weighted by wavelength; nu is that of the shortest one."""
    with np.errstate(divide="ignore"):
        corners = np.clip(np.array(kinks) / nu[:, None], 1.0, ratio)
    corners = np.column_stack([np.ones_like(nu), corners, np.full_like(nu, ratio)])
    t = 0.5 * (NODE + 1)
    smooth, slope = np.sin(0.5 * np.pi * t) ** 2, 0.5 * np.pi * np.sin(np.pi * t)
    mean = np.zeros_like(nu)
    for a, b in zip(corners.T[:-1], corners.T[1:], strict=True):
        wavelength = a[:, None] + (b - a)[:, None] * smooth
        weight = 0.5 * WEIGHT * slope * (b - a)[:, None] * wavelength
        mean += np.sum(weight * _annulus(nu[:, None] * wavelength, obscuration), axis=1)
    return mean / (0.5 * (ratio**2 - 1))


@lru_cache(maxsize=64)
def sersic_transform(n):
    """Hankel transform of the profile of index n, half-light radius 1, as a function of q.

    J0 is the real part of a Hankel function, whose integral along a ray in the upper half-plane
    converges exponentially; both in steps of the logarithm, so that one table serves all q.
    """
    b = special.gammaincinv(2 * n, 0.5)
    if n == 0.5:
        return lambda q: np.exp(-(q**2) / (4 * b))
    if n == 1:
        return lambda q: (1 + (q / b) ** 2) ** -1.5
    step, phi = 0.05, 0.5 * min(np.pi, n * np.pi / 2)
    s = np.arange(-22 * 20, int(np.log(400.0 ** max(n, 1)) * 20)) * step
    log_q = np.arange(-20 * 20, 9 * 20) * step
    z = np.exp(1j * phi + s[0] + log_q[0] + step * np.arange(s.size + log_q.size))
    bessel = special.hankel1(0, z)
    exponent = -b * np.exp((s + 1j * phi) / n) + 2 * (s + 1j * phi)
    # where the Hankel function has underflowed nothing is left to weigh
    bessel[~np.isfinite(bessel)] = 0
    profile = step * np.exp(exponent)
    value = np.array([np.sum(profile * bessel[i : i + s.size]).real for i in range(log_q.size)])
    value *= b ** (2 * n) / (n * special.gamma(2 * n))
    spline = make_interp_spline(log_q, value, k=7)
    return lambda q: spline(np.log(np.clip(q, np.exp(log_q[0]), np.exp(log_q[-1]))))


def source_transform(kind, r_half, n):
    """Transform of a circular source of unit flux."""
    if kind == "point":
        return np.ones_like
    if kind == "uniform":

        def disc(k):
            z = 2 * np.pi * np.sqrt(2) * r_half * np.maximum(k, 1e-12)
            return 2 * special.j1(z) / z

        return disc
    transform = sersic_transform(INDEX.get(kind, n))
    return lambda k: transform(2 * np.pi * r_half * k)


def radial_nodes(kinks, end, width):
    """Nodes and weights on panels at most ``width`` wide that crowd at zero and at the kinks."""
    edges = [np.linspace(0, end, int(end / width) + 2)]
    for kink in [0.0, *kinks, end]:
        near = np.geomspace(1e-7, 1, 20) * end
        edges += [kink - near, [kink], kink + near]
    edges = np.unique(np.concatenate(edges))
    edges = edges[(edges >= 0) & (edges <= end)]
    half = 0.5 * np.diff(edges)[:, None]
    return edges[:-1, None] + half * (NODE + 1), half * WEIGHT


def rate(source, pixels, system):
    """Rate of one source of unit count rate in some pixels.

    ``source`` is (kind, x, y, r_half, ellipticity, pa, n), ``pixels`` a sequence of (y, x),
    ``system`` the transfer function, its kinks and its end.
    """
    kind, x, y, r_half, ellipticity, pa, n = source
    otf, kinks, end = system
    if kind == "point":
        r_half, ellipticity = 0.0, 0.0
    pixels = np.asarray(pixels, dtype=float)
    dy, dx = pixels[:, 0] - y, pixels[:, 1] - x
    size = np.sqrt(2) * r_half if kind == "uniform" else 0.0
    far = np.hypot(dy, dx).max() + size + 1
    transform = source_transform(kind, r_half, n)
    angle = np.radians(pa)
    k, weight = radial_nodes(kinks, end, 1.5 / far)
    passed = weight * k * otf(k.ravel()).reshape(k.shape)
    result = np.zeros(len(pixels))
    for panel, share in zip(k, passed, strict=True):
        count = int(
            1.2 * np.pi * panel[-1] * far + 24 + (30 / (1 - ellipticity) if size or r_half else 0)
        )
        theta = np.pi * (np.arange(count) + 0.5) / count
        kx, ky = np.outer(panel, np.cos(theta)), np.outer(panel, np.sin(theta))
        along = ky * np.cos(angle) - kx * np.sin(angle)
        across = kx * np.cos(angle) + ky * np.sin(angle)
        light = np.sinc(kx) * np.sinc(ky) * share[:, None] * (2 * np.pi / count)
        if r_half:
            light *= transform(np.hypot(along, (1 - ellipticity) * across))
        for i in range(len(pixels)):
            result[i] += np.sum(light * np.cos(2 * np.pi * (kx * dx[i] + ky * dy[i])))
    return result

"""Images between their samples, seen through a Gaussian PSF: nothing of the package, no FFT.

The sum of Gaussians, one about each point of the lattice, that passes through the samples and
through zeros around them is found by solving for it; each Gaussian and the PSF make a wider one,
whose share in a pixel is a product of error functions.
"""

import mpmath as mp
import numpy as np
from scipy import special

AROUND = 70


def amplitudes(samples):
    """Amplitudes of the Gaussians on the lattice, AROUND points wider on all sides."""
    wide = np.pad(np.asarray(samples, float), AROUND)

    def through(n):
        i = np.arange(n)
        return np.linalg.inv(np.exp(-0.5 * (i[:, None] - i) ** 2))

    return through(wide.shape[0]) @ wide @ through(wide.shape[1]).T


def centres(shape, pitch, x, y, pa):
    """Places (x, y) in pixels of lattice points, the image's +y axis turned by pa towards -x."""
    up, right = np.mgrid[: shape[0], : shape[1]].astype(float)
    up, right = pitch * (up - (shape[0] - 1) / 2), pitch * (right - (shape[1] - 1) / 2)
    angle = np.radians(pa)
    # +y of the image points to (-sin pa, cos pa), its +x to (cos pa, sin pa)
    return (
        (x + right * np.cos(angle) - up * np.sin(angle)).ravel(),
        (y + right * np.sin(angle) + up * np.cos(angle)).ravel(),
    )


def image_rate(samples, pitch, x, y, pa, shape, sigma):
    """Share of the image's light in each pixel of a frame; lengths in pixels."""
    share = amplitudes(samples)
    share /= share.sum()
    at_x, at_y = centres(share.shape, pitch, x, y, pa)
    width = np.hypot(pitch, sigma)

    def in_pixels(n, at):
        offset = np.arange(n)[:, None] - at
        return special.ndtr((offset + 0.5) / width) - special.ndtr((offset - 0.5) / width)

    return (in_pixels(shape[0], at_y) * share.ravel()) @ in_pixels(shape[1], at_x).T


def exact_pixel(samples, pitch, x, y, pa, pixel, sigma, digits=30):
    """One pixel (row, column) of the same, in arithmetic of so many digits."""
    with mp.workdps(digits):
        n = range(-12, 13)
        steps = 400
        # 1 / (Fourier series of the Gaussian's samples), back to the lattice
        inverse = [
            1 / mp.fsum(mp.exp(-mp.mpf(i * i) / 2) * mp.cos(2 * mp.pi * i * j / steps) for i in n)
            for j in range(steps)
        ]
        filter_ = [
            mp.fsum(v * mp.cos(2 * mp.pi * i * j / steps) for j, v in enumerate(inverse)) / steps
            for i in range(2 * AROUND)
        ]
        ny, nx = np.shape(samples)

        def spread(count):
            matrix = np.zeros((count + 2 * AROUND, count), dtype=object)
            for i, j in np.ndindex(matrix.shape):
                away = abs(i - AROUND - j)
                matrix[i, j] = filter_[away] if away < len(filter_) else mp.mpf(0)
            return matrix

        values = np.array([[mp.mpf(float(v)) for v in row] for row in samples], dtype=object)
        share = spread(ny) @ values @ spread(nx).T
        cos, sin = mp.cos(mp.radians(mp.mpf(pa))), mp.sin(mp.radians(mp.mpf(pa)))
        width = mp.sqrt(mp.mpf(pitch) ** 2 + mp.mpf(sigma) ** 2)

        def in_pixel(offset):
            return mp.ncdf((offset + 0.5) / width) - mp.ncdf((offset - 0.5) / width)

        total = mp.mpf(0)
        for i, j in np.ndindex(share.shape):
            up = pitch * (i - mp.mpf(share.shape[0] - 1) / 2)
            right = pitch * (j - mp.mpf(share.shape[1] - 1) / 2)
            at_x, at_y = x + right * cos - up * sin, y + right * sin + up * cos
            # beyond 14 standard deviations nothing of 30 digits is left
            if max(abs(pixel[0] - at_y), abs(pixel[1] - at_x)) > 14 * width + 1:
                continue
            total += share[i, j] * in_pixel(pixel[0] - at_y) * in_pixel(pixel[1] - at_x)
        return float(total / share.sum())

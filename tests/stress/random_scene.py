"""A random scene, its optics and its exact rate in chosen pixels; nothing of the package."""

from dataclasses import dataclass

import ellipse_quadrature
import fourier_quadrature
import numpy as np

KINDS = ("point", "uniform", "gaussian", "exponential", "devaucouleurs", "sersic")
INDEX = {"gaussian": 0.5, "exponential": 1.0, "devaucouleurs": 4.0}


@dataclass
class RandomScene:
    """Frame, tolerance, PSF and sources; a source is (flux, kind, x, y, r, e, pa, n)."""

    shape: tuple[int, int]
    tolerance: float
    psf: tuple[str, tuple[float, ...]]
    sources: list[tuple]


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def random_psf(rng):
    """Gaussian and Moffat in FWHM of pixels; telescope in m, angstrom and arcsec."""
    name = str(rng.choice(["gaussian", "moffat", "telescope"]))
    if name == "gaussian":
        return name, (log_uniform(rng, 0.2, 15),)
    if name == "moffat":
        return name, (log_uniform(rng, 0.5, 15), log_uniform(rng, 1.4, 6))
    low = rng.uniform(1150, 4000)
    high = low * rng.choice([1.0, rng.uniform(1.01, 1.8)])
    blur = rng.choice([0.0, rng.uniform(0.02, 0.15)])
    obscuration = rng.choice([0.0, rng.uniform(0.05, 0.6)])
    return name, (rng.uniform(0.5, 1.7), obscuration, low, high, blur)


def random_position(rng, side):
    """Anywhere, a pixel's centre or corner, the frame's edge, or outside."""
    choice = rng.integers(6)
    if choice == 0:
        return float(rng.integers(side))
    if choice == 1:
        return float(rng.integers(side + 1)) - 0.5
    return float(rng.uniform(-9, side + 8) if choice == 2 else rng.uniform(-0.5, side - 0.5))


def random_scene(seed):
    rng = np.random.default_rng([97, seed])
    shape = tuple(int(n) for n in rng.integers(1, 48, 2))
    psf = random_psf(rng)
    # a telescope's rings reach far; only the long run pays for their last digits
    tolerance = 10 ** rng.uniform(-6 if psf[0] == "telescope" and seed < 50 else -10, -2)
    sources = []
    for kind in rng.choice(KINDS, rng.integers(1, 5)):
        n = float(rng.uniform(0.5, 8))
        sources.append(
            (
                log_uniform(rng, 1e-20, 1e-10),
                str(kind),
                random_position(rng, shape[1]),
                random_position(rng, shape[0]),
                log_uniform(rng, 1e-2, 12),
                float(rng.uniform(0, 0.9) * (rng.random() < 0.8)),
                float(rng.uniform(-400, 800)),
                INDEX.get(str(kind), n),
            )
        )
    return RandomScene(shape, float(tolerance), psf, sources)


def exact_rate(scene, pixels, pixel_scale):
    """Exact rate per unit of the instrument's response; shape (sources, pixels)."""
    name, numbers = scene.psf
    if name == "gaussian":
        sigma = numbers[0] / np.sqrt(8 * np.log(2))
        one = lambda source, at: ellipse_quadrature.rate(source, at, sigma)  # noqa: E731
    else:
        system = (
            fourier_quadrature.moffat(*numbers)
            if name == "moffat"
            else fourier_quadrature.telescope(*numbers, pixel_scale)
        )
        one = lambda source, at: fourier_quadrature.rate(source, at, system)  # noqa: E731
    return np.array([flux * one(source, pixels) for flux, *source in scene.sources])


def promised_error(scene, brightest, response, pixel_scale):
    """Largest error that the package promises for an image whose brightest pixel is given.

    The tolerance; where only wings are in the frame, 1e-14 of the brightest source's own peak,
    or 1e-10 for the rings of a telescope.
    """
    promise = scene.tolerance * brightest
    floor = response * (1e-10 if scene.psf[0] == "telescope" else 1e-14)
    # a source's own peak, in a pixel about its centre, is less than all of its light
    for source in scene.sources:
        if floor * source[0] > promise:
            alone = RandomScene(scene.shape, scene.tolerance, scene.psf, [source])
            peak = exact_rate(alone, [(source[3], source[2])], pixel_scale)[0, 0]
            promise = max(promise, floor * peak)
    return promise

"""Optical point spread functions, given by their optical transfer functions (OTF).

A PSF here is that of the optics, pointing and detector blur; the square pixel is not part of
it. Every OTF is 1 at zero frequency. Frequencies are in cycles per arcsec.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

Array = NDArray[np.float64]

ARCSEC_PER_RADIAN = 180 * 3600 / np.pi
FWHM_PER_SIGMA = 2 * np.sqrt(2 * np.log(2))


class PSF(Protocol):
    """What the renderer needs to know of a PSF.

    Attributes
    ----------
    includes_pixel : bool
        True where the OTF already holds the transform of the detector pixel.
    extent : float
        Half-size in arcsec beyond which the PSF is zero by construction, 0 if it has none.
    """

    @property
    def includes_pixel(self) -> bool:
        """Whether the OTF holds the transform of the detector pixel."""

    @property
    def extent(self) -> float:
        """Half-size in arcsec beyond which the PSF is zero."""

    def band_limit(self, threshold: float) -> float:
        """Frequency in cycles per arcsec above which |OTF| is at most ``threshold``."""

    def otf_grid(self, fy: Array, fx: Array) -> NDArray[np.complexfloating] | Array:
        """OTF on the grid of frequencies (fy, fx), shape (len(fy), len(fx))."""


def _positive(name: str, value: float, unit: str, *, zero: bool = False) -> float:
    value = float(value)
    if not np.isfinite(value) or value < 0 or (value == 0 and not zero):
        least = "zero or more" if zero else "positive"
        raise ValueError(f"{name} is {value}; it must be a finite number of {unit}, {least}.")
    return value


class RadialPSF:
    """A PSF whose OTF depends on the length of the frequency vector only."""

    includes_pixel = False
    extent = 0.0

    def otf(self, k: ArrayLike) -> Array:
        """OTF at frequencies k (cycles per arcsec, any shape)."""
        raise NotImplementedError

    def otf_grid(self, fy: Array, fx: Array) -> Array:
        """OTF on the grid of frequencies (fy, fx), shape (len(fy), len(fx))."""
        return self.otf(np.hypot(fy[:, None], fx[None, :]))

    def cutoff(self) -> float:
        """Frequency beyond which the OTF is exactly zero (inf where it never is)."""
        return np.inf

    def first_edge(self) -> float:
        """Lowest frequency above zero at which the OTF is not smooth (inf if it always is).

        Such an edge makes rings in the PSF that fall off slowly.
        """
        return np.inf

    def band_limit(self, threshold: float) -> float:
        """Frequency in cycles per arcsec above which |OTF| is at most ``threshold``."""
        if threshold >= 1:
            return 0.0
        low, high = 0.0, 1.0
        while high < self.cutoff() and float(np.abs(self.otf(high))) > threshold:
            low, high = high, 2 * high
        high = min(high, self.cutoff())
        # The OTF need not fall steadily (an annulus has a shoulder): take the last crossing.
        for _ in range(4):
            k = np.linspace(low if _ else 0.0, high, 2049)
            above = np.flatnonzero(np.abs(self.otf(k)) > threshold)
            if above.size == 0:
                return 0.0
            low, high = k[above[-1]], k[min(above[-1] + 1, k.size - 1)]
        return float(high)


@dataclass(frozen=True)
class GaussianPSF(RadialPSF):
    """Circular Gaussian.

    Parameters
    ----------
    fwhm : float
        Full width at half maximum, arcsec.
    """

    fwhm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "fwhm", _positive("fwhm", self.fwhm, "arcsec"))

    def otf(self, k: ArrayLike) -> Array:
        """exp(-2 pi^2 sigma^2 k^2)."""
        return _gaussian_otf(k, self.fwhm)


@dataclass(frozen=True)
class MoffatPSF(RadialPSF):
    """Moffat profile, (1 + (r/a)^2)^-beta (Moffat 1969, A&A 3, 455).

    Parameters
    ----------
    fwhm : float
        Full width at half maximum, arcsec.
    beta : float
        Exponent, above 1 (the flux is infinite otherwise).
    """

    fwhm: float
    beta: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "fwhm", _positive("fwhm", self.fwhm, "arcsec"))
        beta = float(self.beta)
        if not 1 < beta <= 100:
            raise ValueError(f"beta is {beta}; it must be above 1 and at most 100.")
        object.__setattr__(self, "beta", beta)

    def otf(self, k: ArrayLike) -> Array:
        """2 (x/2)^(beta-1) K_(beta-1)(x) / Gamma(beta-1), x = 2 pi k a (Hankel transform)."""
        scale = self.fwhm / (2 * np.sqrt(2 ** (1 / self.beta) - 1))
        x = 2 * np.pi * scale * np.asarray(k, dtype=float)
        order = self.beta - 1
        safe = np.where(x > 0, x, 1.0)
        with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
            log_value = (
                np.log(2)
                + order * np.log(safe / 2)
                + np.log(special.kve(order, safe))
                - safe
                - special.gammaln(order)
            )
            value = np.exp(log_value)
        # Towards zero the Bessel function overflows where the OTF is 1 to machine precision.
        return np.where((x > 0) & np.isfinite(value), value, 1.0)


@dataclass(frozen=True)
class TelescopePSF(RadialPSF):
    """Diffraction by an annular aperture, averaged over a band, with a Gaussian blur.

    Parameters
    ----------
    diameter : float
        Aperture diameter, m.
    obscuration : float
        Linear central obscuration, 0 to below 1.
    band : float or (float, float)
        One wavelength, or the band's limits, in angstrom. Over a band the OTF is the mean of
        the monochromatic ones weighted by photons, that is by wavelength, at unit response.
    blur_fwhm : float
        FWHM of the Gaussian blur of pointing and detector, arcsec; 0 for none.

    Notes
    -----
    The OTF of an annulus is its autocorrelation (O'Neill 1956, JOSA 46, 285), here as areas
    common to two shifted circles.
    """

    diameter: float
    obscuration: float = 0.0
    band: float | tuple[float, float] = 2500.0
    blur_fwhm: float = 0.0

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "diameter", _positive("diameter", self.diameter, "metres"))
        set_(self, "blur_fwhm", _positive("blur_fwhm", self.blur_fwhm, "arcsec", zero=True))
        obscuration = float(self.obscuration)
        if not 0 <= obscuration < 1:
            raise ValueError(f"obscuration is {obscuration}; it must lie in [0, 1).")
        set_(self, "obscuration", obscuration)
        limits = np.atleast_1d(np.asarray(self.band, dtype=float))
        if limits.shape not in ((1,), (2,)) or not np.all(np.isfinite(limits) & (limits > 0)):
            raise ValueError(
                f"band is {self.band!r}; give one wavelength or (low, high) in angstrom."
            )
        if limits.size == 2 and not limits[0] <= limits[1]:
            raise ValueError(f"band is {self.band!r}; its lower limit exceeds the upper one.")
        set_(
            self,
            "band",
            float(limits[0]) if limits[0] == limits[-1] else (float(limits[0]), float(limits[1])),
        )

    @property
    def band_limits(self) -> tuple[float, float]:
        """Lower and upper limit of the band, angstrom; equal for one wavelength."""
        return self.band if isinstance(self.band, tuple) else (self.band, self.band)

    def cutoff(self) -> float:
        """Highest frequency that the aperture passes: diameter / shortest wavelength."""
        return self.diameter / (self.band_limits[0] * 1e-10) / ARCSEC_PER_RADIAN

    def first_edge(self) -> float:
        """Where the overlap of the two rims begins: (1 - obscuration) / 2 of the cut-off."""
        cutoff = self.diameter / (self.band_limits[1] * 1e-10) / ARCSEC_PER_RADIAN
        return cutoff if self.obscuration == 0 else 0.5 * (1 - self.obscuration) * cutoff

    def otf(self, k: ArrayLike) -> Array:
        """Annular OTF, averaged over the band, times the blur's."""
        frequency: Array = np.abs(np.asarray(k, dtype=float))
        low, high = self.band_limits
        value: Array
        if low == high:
            value = annular_otf(frequency / self.cutoff(), self.obscuration)
        else:
            relative = np.minimum(frequency / self.cutoff(), 1.0)
            value = _band_otf(self.obscuration, high / low)(relative)
        return value * _gaussian_otf(frequency, self.blur_fwhm) if self.blur_fwhm else value


@dataclass(frozen=True, eq=False)
class ImagePSF:
    """A PSF given by an image: band-limited (sinc) interpolation of its samples, zero outside.

    Parameters
    ----------
    array : array_like, shape (ny, nx)
        Samples of the PSF, in any unit: they are scaled to a sum of 1. The PSF's centre is
        the geometric centre of the array, ((ny - 1) / 2, (nx - 1) / 2).
    pixel_scale : float
        Spacing of the samples, arcsec.
    includes_pixel : bool
        True where the samples are those of the PSF as integrated by the detector's pixel;
        no further pixel integration is then applied.

    Raises
    ------
    ValueError
        If the array is not a finite 2D image with a positive sum.
    """

    array: Array = field(repr=False)
    pixel_scale: float
    includes_pixel: bool = False

    def __post_init__(self) -> None:
        array = np.array(self.array, dtype=np.float64, order="C", copy=True)
        if array.ndim != 2 or array.size == 0:
            raise ValueError(
                f"a PSF image has two dimensions; this array's shape is {array.shape}."
            )
        if not np.all(np.isfinite(array)):
            bad = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
            raise ValueError(f"the PSF image holds {array[bad]} at [y, x] = {list(bad)}.")
        total = array.sum()
        if not total > 0:
            raise ValueError(f"the PSF image sums to {total}; the sum must be positive.")
        if abs(total - 1) > 1e-14:
            array /= total
        array.setflags(write=False)
        object.__setattr__(self, "array", array)
        scale = _positive("pixel_scale", self.pixel_scale, "arcsec per pixel")
        object.__setattr__(self, "pixel_scale", scale)
        object.__setattr__(self, "includes_pixel", bool(self.includes_pixel))

    @classmethod
    def from_fits(
        cls,
        path: str | Path,
        *,
        pixel_scale: float | None = None,
        includes_pixel: bool = False,
    ) -> ImagePSF:
        """Read a PSF from the first image of a FITS file.

        Parameters
        ----------
        path : path-like
            The file.
        pixel_scale : float, optional
            Spacing of the samples in arcsec. By default that of the header: ``PIXELSCL`` or
            ``PIXSCALE`` in arcsec, else its celestial WCS.
        includes_pixel : bool
            As for the class.

        Raises
        ------
        ValueError
            If the file holds no image, or no pixel scale is given or found.
        OSError
            If the file cannot be read.
        """
        from astropy.io import fits
        from astropy.wcs import WCS
        from astropy.wcs.utils import proj_plane_pixel_scales

        with fits.open(path, memmap=False) as hdus:
            image = next((hdu for hdu in hdus if hdu.is_image and hdu.data is not None), None)
            if image is None or image.data.ndim != 2:
                raise ValueError(f"{path} holds no two-dimensional image.")
            header = image.header
            data = np.asarray(image.data, dtype=np.float64)
        if pixel_scale is None:
            pixel_scale = header.get("PIXELSCL", header.get("PIXSCALE"))
        if pixel_scale is None:
            wcs = WCS(header)
            if wcs.has_celestial:
                pixel_scale = float(np.mean(proj_plane_pixel_scales(wcs.celestial)) * 3600)
        if pixel_scale is None:
            raise ValueError(
                f"{path} does not say its pixel scale (PIXELSCL or a celestial WCS); "
                "give pixel_scale in arcsec."
            )
        return cls(data, pixel_scale, includes_pixel)

    @property
    def extent(self) -> float:
        """Half-size of the array, arcsec."""
        return float(0.5 * max(self.array.shape) * self.pixel_scale)

    def band_limit(self, threshold: float) -> float:
        """Frequency in cycles per arcsec above which |OTF| is at most ``threshold``."""
        nyquist = 0.5 / self.pixel_scale
        f = np.linspace(-nyquist, nyquist, 4 * max(self.array.shape) + 1)
        above = np.abs(self.otf_grid(f, f)) > threshold
        reach = np.maximum(
            np.abs(f)[above.any(axis=1)].max(initial=0), np.abs(f)[above.any(axis=0)].max(initial=0)
        )
        step = f[1] - f[0]
        return float(min(reach + step, nyquist)) if reach > 0 or threshold < 1 else 0.0

    def otf_grid(self, fy: Array, fx: Array) -> NDArray[np.complexfloating]:
        """Transform of the interpolated samples: their Fourier series inside the Nyquist box."""
        ny, nx = self.array.shape
        row = _phases(fy, ny, self.pixel_scale)
        column = _phases(fx, nx, self.pixel_scale)
        return row @ self.array @ column.T

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, ImagePSF)
            and self.pixel_scale == other.pixel_scale
            and self.includes_pixel == other.includes_pixel
            and np.array_equal(self.array, other.array)
        )

    def __hash__(self) -> int:
        digest = hashlib.sha256(self.array.tobytes()).hexdigest()
        return hash((digest, self.array.shape, self.pixel_scale, self.includes_pixel))


def fwhm(psf: RadialPSF) -> float:
    """Full width at half maximum of a radial PSF, arcsec, by Hankel transform of its OTF."""
    limit = psf.band_limit(1e-7)
    x, w = np.polynomial.legendre.leggauss(600)
    k, w = 0.5 * limit * (x + 1), 0.5 * limit * w
    weight = w * k * psf.otf(k)

    def intensity(r: float) -> float:
        return float(weight @ special.j0(2 * np.pi * k * r))

    half = 0.5 * intensity(0.0)
    outside = 0.5 / limit
    while intensity(outside) > half:
        outside *= 1.5
    return 2 * float(brentq(lambda r: intensity(r) - half, 0.0, outside))


def annular_otf(nu: ArrayLike, obscuration: float) -> Array:
    """OTF of an annular aperture at frequencies nu, in units of the cut-off.

    Parameters
    ----------
    nu : array_like
        Frequency over the cut-off frequency diameter / wavelength.
    obscuration : float
        Inner over outer radius.
    """
    separation = 2 * np.asarray(nu, dtype=float)
    common = _lens_area(1.0, 1.0, separation)
    if obscuration > 0:
        common = (
            common
            - 2 * _lens_area(1.0, obscuration, separation)
            + _lens_area(obscuration, obscuration, separation)
        )
    return common / (np.pi * (1 - obscuration**2))


def _lens_area(big: float, small: float, d: Array) -> Array:
    """Area common to circles of radii big >= small whose centres are d apart."""
    inside = np.pi * small**2
    crossing = (d > big - small) & (d < big + small)
    x = np.where(crossing, d, big)  # any separation at which the circles cross
    to_chord = (x**2 + big**2 - small**2) / (2 * x)
    half_chord = np.sqrt(np.maximum(big**2 - to_chord**2, 0.0))
    area = (
        big**2 * np.arctan2(half_chord, to_chord)
        + small**2 * np.arctan2(half_chord, x - to_chord)
        - x * half_chord
    )
    return np.where(crossing, area, np.where(d <= big - small, inside, 0.0))


@lru_cache(maxsize=16)
def _band_otf(obscuration: float, ratio: float) -> CubicSpline:
    """Band-averaged annular OTF as a spline in frequency over the highest cut-off.

    ``ratio`` is the longest over the shortest wavelength. At each frequency the mean over
    wavelength is split where the integrand has kinks, and each piece is integrated by
    Gauss-Legendre after a substitution that removes the 3/2 powers at its ends.
    """
    kinks = np.array([1.0, obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2])
    corners = np.concatenate([kinks, kinks / ratio])
    # knots crowd where the mean itself has its (weaker) kinks
    k = np.unique(np.concatenate([np.linspace(0, 1, 6001), corners[corners > 0]]))
    x, w = np.polynomial.legendre.leggauss(20)
    s = 0.5 * (x + 1)
    smooth, slope = s**2 * (3 - 2 * s), 6 * s * (1 - s) * 0.5 * w
    with np.errstate(divide="ignore"):
        edges = np.clip(kinks[None, :] / k[:, None], 1.0, ratio)
    edges = np.sort(np.column_stack([np.ones_like(k), edges, np.full_like(k, ratio)]), axis=1)
    mean = np.zeros_like(k)
    for low, high in zip(edges.T[:-1], edges.T[1:], strict=True):
        wavelength = low[:, None] + (high - low)[:, None] * smooth
        weight = (high - low)[:, None] * slope * wavelength
        mean += np.sum(weight * annular_otf(k[:, None] * wavelength, obscuration), axis=1)
    return CubicSpline(k, mean / (0.5 * (ratio**2 - 1)))


def _gaussian_otf(k: ArrayLike, fwhm: float) -> Array:
    sigma = fwhm / FWHM_PER_SIGMA
    value: Array = np.exp(-2 * (np.pi * sigma * np.asarray(k, dtype=float)) ** 2)
    return value


def _phases(f: Array, n: int, step: float) -> NDArray[np.complexfloating]:
    """exp(-2 pi i f x) of n samples centred on zero; zero beyond the Nyquist frequency.

    At the very edge of the box the interpolated function's transform is half of its value.
    """
    position = (np.arange(n) - 0.5 * (n - 1)) * step
    inside = np.abs(f) * step
    window = np.where(inside < 0.5, 1.0, np.where(inside == 0.5, 0.5, 0.0))
    phases: NDArray[np.complexfloating] = (
        np.exp(-2j * np.pi * f[:, None] * position) * window[:, None]
    )
    return phases

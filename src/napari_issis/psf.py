"""Optical point spread functions, given by their optical transfer functions (OTF).

A PSF here is that of the optics, pointing and detector blur; the square pixel is not part of
it. Every OTF is 1 at zero frequency. Frequencies are in cycles per arcsec.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import special
from scipy.optimize import brentq

from .annulus import annular_otf, band_averaged_otf

Array = NDArray[np.float64]

ARCSEC_PER_RADIAN = 180 * 3600 / np.pi
WIDEST = 1e4  # m
# Widest blur, arcsec. Much wider ones leave no light to transform.
BROADEST = 1000.0
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


def positive(name: str, value: float | None, unit: str, *, zero: bool = False) -> float:
    """Return a parameter as a float, or raise a ValueError that names it."""
    try:
        value = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {value!r}; it must be a plain number of {unit}.") from None
    if not np.isfinite(value) or value < 0 or (value == 0 and not zero):
        least = "zero or more" if zero else "positive"
        raise ValueError(f"{name} is {value}; it must be a finite number of {unit}, {least}.")
    return value


def _width(name: str, value: float, *, zero: bool = False) -> float:
    """Return a full width at half maximum in arcsec, or raise a ValueError that names it."""
    width = positive(name, value, "arcsec", zero=zero)
    if width > BROADEST:
        raise ValueError(
            f"{name} is {width:g}; widths of at most {BROADEST:g} arcsec can be rendered. "
            "Is it in another unit?"
        )
    return width


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
        object.__setattr__(self, "fwhm", _width("fwhm", self.fwhm))

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
        object.__setattr__(self, "fwhm", _width("fwhm", self.fwhm))
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
    """Diffraction by an annular aperture, averaged over a band, with Gaussian blurs and a halo.

    Parameters
    ----------
    diameter : float
        Aperture diameter, m, at most 10,000.
    obscuration : float
        Linear central obscuration, 0 to below 1.
    band : float or (float, float)
        One wavelength, or the band's limits, in angstrom. Over a band the OTF is the mean of
        the monochromatic ones weighted by photons, that is by wavelength, at unit response.
    blur_fwhm : float
        FWHM of the Gaussian blur of the detector, or of pointing and detector together,
        arcsec; 0 for none.
    jitter_fwhm : float
        FWHM of a Gaussian blur of the pointing beside it, arcsec; they add in quadrature.
    halo_share : float
        Share of the light that the detector spreads into a halo, 0 to 1.
    halo_fwhm : float
        FWHM of the Gaussian over which the halo's light is spread, arcsec.

    Raises
    ------
    ValueError
        If a value is out of range, or there is a halo without a width; the message names it.

    Notes
    -----
    The OTF of an annulus is its autocorrelation (O'Neill 1956, JOSA 46, 285), here as areas
    common to two shifted circles. With a halo it is multiplied by (1 - s) + s G, with s the
    share and G the transform of the Gaussian: each photon is counted where it falls, or with
    probability s somewhere around.
    """

    diameter: float
    obscuration: float = 0.0
    band: float | tuple[float, float] = 2500.0
    blur_fwhm: float = 0.0
    jitter_fwhm: float = 0.0
    halo_share: float = 0.0
    halo_fwhm: float = 0.0

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        for name in ("jitter_fwhm", "halo_fwhm"):
            set_(self, name, _width(name, getattr(self, name), zero=True))
        share = positive("halo_share", self.halo_share, "1 (a share)", zero=True)
        if share > 1:
            raise ValueError(f"halo_share is {share}; it must be a share from 0 to 1.")
        if share and not self.halo_fwhm:
            raise ValueError(f"halo_fwhm is 0 for a halo_share of {share}; give arcsec above 0.")
        set_(self, "halo_share", share)
        set_(self, "diameter", positive("diameter", self.diameter, "metres"))
        if self.diameter > WIDEST:
            raise ValueError(
                f"diameter is {self.diameter:g}; apertures of at most {WIDEST:g} metres can be "
                "rendered. Is it in another unit?"
            )
        set_(self, "blur_fwhm", _width("blur_fwhm", self.blur_fwhm, zero=True))
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
        """Where the rims' overlap begins or the obscuration's with itself ends.

        (1 - obscuration) / 2 or the obscuration, in units of the longest wavelength's cut-off.
        """
        cutoff = self.diameter / (self.band_limits[1] * 1e-10) / ARCSEC_PER_RADIAN
        if self.obscuration == 0:
            return cutoff
        return min(0.5 * (1 - self.obscuration), self.obscuration) * cutoff

    def otf(self, k: ArrayLike) -> Array:
        """Annular OTF, averaged over the band, times those of the blurs and the halo."""
        frequency: Array = np.abs(np.asarray(k, dtype=float))
        low, high = self.band_limits
        value: Array
        if low == high:
            value = annular_otf(frequency / self.cutoff(), self.obscuration)
        else:
            relative = np.minimum(frequency / self.cutoff(), 1.0)
            value = band_averaged_otf(self.obscuration, high / low)(relative)
        blur = np.hypot(self.blur_fwhm, self.jitter_fwhm) if self.jitter_fwhm else self.blur_fwhm
        if blur:
            value = value * _gaussian_otf(frequency, blur)
        if self.halo_share:
            share = self.halo_share
            value = value * (1 - share + share * _gaussian_otf(frequency, self.halo_fwhm))
        return value


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


def _gaussian_otf(k: ArrayLike, fwhm: float) -> Array:
    sigma = fwhm / FWHM_PER_SIGMA
    value: Array = np.exp(-2 * (np.pi * sigma * np.asarray(k, dtype=float)) ** 2)
    return value

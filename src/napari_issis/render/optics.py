"""The system's transfer function in cycles per pixel: OTF times the pixel's transform."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..psf import PSF, RadialPSF

Array = NDArray[np.float64]
Transfer = NDArray[np.float64] | NDArray[np.complex128]


# Cycles per pixel, those of a Gaussian of FWHM 0.02 pixel: finer meshes exceed the memory.
HIGHEST = 150.0


@dataclass(frozen=True)
class Optics:
    """A PSF as the detector's pixels see it.

    Parameters
    ----------
    psf : PSF
        The optical PSF.
    pixel_scale : float
        Arcsec per pixel.
    """

    psf: PSF
    pixel_scale: float

    @property
    def radial(self) -> bool:
        """Whether the OTF is real and even in either frequency."""
        return isinstance(self.psf, RadialPSF)

    @property
    def extent(self) -> float:
        """Half-size in pixels beyond which an image PSF is zero."""
        return self.psf.extent / self.pixel_scale

    @property
    def point_area(self) -> float:
        """Flux over highest pixel of a point source, pixels."""
        return 1 / self.moment(0)

    def moment(self, power: int, limit: float = np.inf) -> float:
        """Integral of k^power times the modulus of the transfer function along kx, over k < limit.

        Parameters
        ----------
        power : int
            Power of the frequency in cycles per pixel.
        limit : float
            Cycles per pixel.
        """
        return _moment(self, power, limit)

    def band_limit(self, threshold: float) -> float:
        """Frequency in cycles per pixel beyond which the OTF is below ``threshold``."""
        return _band_limit(self, threshold)

    def transfer(self, ky: Array, kx: Array, limit: float = np.inf) -> Transfer:
        """OTF times the pixel's transform on the grid (ky, kx).

        Parameters
        ----------
        ky, kx : ndarray
            Frequencies in cycles per pixel, shapes (ny,) and (nx,).
        limit : float
            Beyond this frequency a radial OTF is not needed and 0 is returned.
        """
        if isinstance(self.psf, RadialPSF):
            k = np.hypot(ky[:, None], kx[None, :])
            transfer = np.zeros_like(k)
            inside = k <= limit
            transfer[inside] = self.psf.otf(k[inside] / self.pixel_scale)
        else:
            transfer = self.psf.otf_grid(ky / self.pixel_scale, kx / self.pixel_scale)
        if not self.psf.includes_pixel:
            transfer *= self.pixel(ky, kx)
        return transfer

    def pixel(self, ky: Array, kx: Array) -> Array:
        """Transform of the pixel's square on the grid (ky, kx)."""
        square: Array = np.sinc(ky)[:, None] * np.sinc(kx)
        return square


@lru_cache(maxsize=256)
def _band_limit(optics: Optics, threshold: float) -> float:
    limit = optics.psf.band_limit(threshold) * optics.pixel_scale
    if limit > HIGHEST:
        raise ValueError(
            f"the PSF passes frequencies up to {limit:.3g} cycles per pixel: it is too sharp for "
            f"pixels of {optics.pixel_scale:g} arcsec, and no more than {HIGHEST:g} can be "
            "rendered; give it a blur (blur_fwhm of a TelescopePSF), a smaller aperture or a "
            "larger width."
        )
    return limit


@lru_cache(maxsize=256)
def _moment(optics: Optics, power: int, limit: float) -> float:
    highest = min(max(optics.band_limit(1e-4 if power == 0 else 1e-9), 1e-9), limit)
    k = (np.arange(2048) + 0.5) / 2048 * highest
    transfer = np.abs(np.asarray(optics.transfer(np.zeros(1), k)[0]))
    return 2 * np.pi * float(np.sum(k ** (power + 1) * transfer) * (k[1] - k[0]))

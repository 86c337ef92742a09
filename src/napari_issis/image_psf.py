"""A PSF given by an image."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .psf import positive

Array = NDArray[np.float64]


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
        scale = positive("pixel_scale", self.pixel_scale, "arcsec per pixel")
        object.__setattr__(self, "pixel_scale", scale)
        object.__setattr__(self, "includes_pixel", bool(self.includes_pixel))

    @classmethod
    def from_fits(
        cls,
        path: str | Path,
        *,
        pixel_scale: float | None = None,
        includes_pixel: bool = False,
        hdu: int | str | None = None,
        check: bool = True,
    ) -> ImagePSF:
        """Read a PSF from an image of a FITS file.

        Parameters
        ----------
        path : path-like
            The file.
        pixel_scale : float, optional
            Spacing of the samples in arcsec. By default that of the header: ``PIXELSCL`` or
            ``PIXSCALE`` in arcsec, else its WCS, whose pixels must be square.
        includes_pixel : bool
            As for the class.
        hdu : int or str, optional
            Number or name of the extension; by default the first with an image.
        check : bool
            Whether to refuse an image that is off its centre, bright at its border, negative or
            undersampled, see `napari_issis.psf_checks.check_psf_image`.

        Raises
        ------
        ValueError
            If the file holds no image, no pixel scale is given or found, or the image is not
            fit to be a PSF; the message says what is wrong and what to do.
        OSError
            If the file cannot be read.
        """
        from .fits_image import read_image
        from .fits_pixel_scale import stated_pixel_scale
        from .psf_checks import check_psf_image

        image = read_image(path, hdu=hdu)
        try:
            if pixel_scale is None:
                pixel_scale = stated_pixel_scale(image.header)
            if pixel_scale is None:
                raise ValueError(
                    "it does not say its pixel scale (PIXELSCL or a WCS in angles); "
                    "give pixel_scale in arcsec."
                )
            psf = cls(image.data, pixel_scale, includes_pixel)
            if check:
                check_psf_image(psf.array)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        return psf

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

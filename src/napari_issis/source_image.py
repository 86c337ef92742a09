"""An image as a source: a frame of another telescope or a model's arcs, between its samples too.

A source table names an image by a text, ``path#digest`` or ``array#digest``; the digest is of
the samples. The images themselves are kept here, for as long as the program runs, and in the
FITS file of an exposure.
"""

from __future__ import annotations

import hashlib
import os
import warnings
from functools import cached_property
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from .instruments import PIXEL_SCALE
from .psf import positive
from .sources import FLUX_UNIT, IMAGE, check_sources, image_texts
from .spectra import Spectrum

Array = NDArray[np.float64]

# Most samples of an image; a render takes some 20 microseconds for each that holds light.
MOST_SAMPLES = 1024 * 1024
# Samples of zero about the image over which its interpolation fades out, by exp(-1/2) each.
MARGIN = 64
DIGITS = 16
ARRAY = "array"

# Negative light of an image over all its light, beyond which one is warned.
MOST_NEGATIVE = 0.01

_kept: dict[str, SourceImage] = {}


class NegativeLightWarning(UserWarning):
    """An image has much negative light, of which no counts can be drawn."""


class SourceImage:
    """A light distribution given by an image.

    Parameters
    ----------
    array : array_like, shape (ny, nx)
        Surface brightness at the centres of square pixels, in any unit; row 0 is the lowest.
        Around the image it is dark.
    name : str
        Where it comes from: the path of its file, or ``array``.

    Attributes
    ----------
    text : str
        What names it in a source table; images with equal samples have equal digests.

    Raises
    ------
    ValueError
        If it is not a finite image of two dimensions whose sum is positive, or is too large.

    Warns
    -----
    NegativeLightWarning
        If negative samples hold more than 1 % of the light.

    Notes
    -----
    Between its samples the image is interpolated by Gaussians whose standard deviation is the
    spacing of the samples, one about each sample and each point of the lattice around: the one
    sum of them that passes through all samples (cardinal interpolation by Gaussians; Schoenberg
    1973, Cardinal Spline Interpolation, and Riemenschneider & Sivakumar 2000, J. Anal. Math.
    79, 33, who show that it tends to the band-limited, sinc, interpolation as the Gaussians
    widen). Its transfer function in cycles per sample, 1 / (1 + exp(-2 pi^2 (1 - 2 k))) but
    for 1e-8, differs from the sinc's, which is 1 up to the Nyquist frequency of 1/2 and 0
    beyond, by 5e-5 at k = 0.25 and 0.02 at k = 0.4; but what a sample spreads fades like
    exp(-r / 2) instead of 1 / r, and nothing wraps around. The blur that the image has of its
    own telescope and pixels stays in it.
    """

    def __init__(self, array: ArrayLike, name: str = ARRAY) -> None:
        try:
            samples = np.array(array, dtype=np.float64, order="C", copy=True)
        except (TypeError, ValueError):
            raise ValueError("the image is no array of numbers.") from None
        if samples.ndim != 2 or samples.size == 0:
            raise ValueError(f"an image has two dimensions; this array's shape is {samples.shape}.")
        if samples.size > MOST_SAMPLES:
            raise ValueError(
                f"the image has {samples.shape[1]} x {samples.shape[0]} samples, more than "
                f"{MOST_SAMPLES}; cut out the part with the source, or add up pixels of it."
            )
        bad = ~np.isfinite(samples)
        if bad.any():
            y, x = (int(i) for i in np.argwhere(bad)[0])
            raise ValueError(
                f"the image holds {samples[y, x]} at x = {x}, y = {y} ({bad.sum()} such samples); "
                "replace them, for example by 0."
            )
        total = float(samples.sum())
        if not (np.isfinite(total) and total > 0):
            raise ValueError(
                f"the image sums to {total}; the sum must be positive and finite. "
                "Is its background subtracted too much?"
            )
        negative = float(-samples[samples < 0].sum() / total)
        if negative > MOST_NEGATIVE:
            warnings.warn(
                f"negative samples of the image hold {100 * negative:.2g} % of its light; where "
                "the expected rate is below zero no counts are drawn, and the image gets brighter "
                "by as much. Set noise around the source to 0 to avoid that.",
                NegativeLightWarning,
                stacklevel=2,
            )
        samples.setflags(write=False)
        self.array = samples
        digest = hashlib.sha256(repr(samples.shape).encode() + samples.tobytes()).hexdigest()
        self.digest = digest[:DIGITS]
        self.text = f"{name}#{self.digest}"

    @cached_property
    def r_half(self) -> float:
        """Radius in samples of the circle about the image's centre that holds half of its light.

        To a sample: the distance of the sample with which the sum, from the centre outwards,
        first reaches a half; at least half a sample.
        """
        ny, nx = self.array.shape
        y, x = np.arange(ny) - 0.5 * (ny - 1), np.arange(nx) - 0.5 * (nx - 1)
        radius = np.hypot(y[:, None], x).ravel()
        order = np.argsort(radius, kind="stable")
        grown = np.cumsum(self.array.ravel()[order])
        reached = int(np.argmax(grown >= 0.5 * grown[-1]))
        return max(float(radius[order[reached]]), 0.5)

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half of the image's sides (y, x), outermost pixels included, in units of `r_half`."""
        ny, nx = self.array.shape
        return 0.5 * ny / self.r_half, 0.5 * nx / self.r_half

    @cached_property
    def weights(self) -> Array:
        """Shares of the flux of the Gaussians, shape (ny + 2 MARGIN, nx + 2 MARGIN); sum 1."""
        padded = np.pad(self.array / np.abs(self.array).max(), MARGIN)
        spectrum = fft.rfft2(padded)
        spectrum /= _gaussian_series(padded.shape[0])[:, None]
        spectrum /= _gaussian_series(padded.shape[1])[: spectrum.shape[1]]
        weights: Array = fft.irfft2(spectrum, padded.shape)
        weights /= weights.sum()
        weights.setflags(write=False)
        return weights

    @property
    def half_diagonal(self) -> float:
        """Distance in samples from the centre beyond which there is no light at all."""
        return float(0.5 * np.hypot(*self.weights.shape)) + 6.0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SourceImage) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        ny, nx = self.array.shape
        return f"SourceImage({nx} x {ny}, {self.text!r})"

    def __deepcopy__(self, memo: Any) -> SourceImage:
        return self

    def __reduce__(self) -> Any:
        # on a worker of a cluster it is found by its text as here
        return _restored, (np.array(self.array), self.text)


def image_source(
    image: str | os.PathLike[str] | ArrayLike,
    x: float,
    y: float,
    flux: Any,
    *,
    pixel_scale: float | None = None,
    pa: Any = 0.0,
    mirrored: bool = False,
    hdu: int | str | None = None,
    spectrum: str | Spectrum | None = None,
    frame_pixel_scale: float = PIXEL_SCALE,
) -> QTable:
    """Make a source table of one row whose light is distributed as in an image.

    Parameters
    ----------
    image : path-like or array_like, shape (ny, nx)
        A FITS file, or surface brightness in any unit, ``[y, x]``; the sky subtracted. Samples
        may be negative, their sum not.
    x, y : float
        Where the centre of the image comes to lie, pixels: the geometric centre of the array,
        ((nx - 1) / 2, (ny - 1) / 2). The centre of the frame's first pixel is (0, 0).
    flux : float or Quantity or Magnitude
        Flux of the whole image in erg s-1 cm-2 A-1, or AB magnitude (with its unit).
    pixel_scale : float, optional
        Spacing of the samples, arcsec. By default that of the file's header: ``PIXELSCL`` or
        ``PIXSCALE``, else its WCS.
    pa : float or Quantity
        Direction in the frame of the image's +y axis, degrees from the frame's +y
        counter-clockwise towards -x.
    mirrored : bool
        Whether to exchange left and right first, as an image needs whose east is to the right.
    hdu : int or str, optional
        Number or name of the file's extension; by default the first with an image.
    spectrum : str or Spectrum, optional
        One spectrum for the whole image, as for `napari_issis.source`.
    frame_pixel_scale : float
        Arcsec per pixel of the frame, by default that of ISSIS; `Observation.pixel_scale`.

    Returns
    -------
    astropy.table.QTable
        Columns ``kind x y flux r_half ellipticity pa image`` (and ``spectrum``). ``r_half`` is
        the radius of the circle about the image's centre that holds half of its light (see
        `SourceImage.r_half`), in pixels of the frame: it is the image's size in the table, and
        whoever changes it scales the image. The ellipticity is 0.

    Raises
    ------
    ValueError
        If the image or a value is not valid, or no pixel scale is given or found; the message
        names it.
    OSError
        If the file cannot be opened.

    Notes
    -----
    How the image is interpolated: see `SourceImage`. The interpolated image is convolved with
    the PSF and the pixel like any other source.
    """
    if isinstance(image, str | os.PathLike):
        from .fits_image import read_image
        from .fits_pixel_scale import stated_pixel_scale

        read = read_image(image, hdu=hdu)
        samples: Any = read.data
        name = str(Path(image).resolve())
        if pixel_scale is None:
            try:
                pixel_scale = stated_pixel_scale(read.header)
            except ValueError as error:
                raise ValueError(f"{image}: {error}") from None
        if pixel_scale is None:
            raise ValueError(
                f"{image} does not say its pixel scale (PIXELSCL or a WCS in angles); "
                "give pixel_scale in arcsec."
            )
    else:
        samples, name = image, ARRAY
        if pixel_scale is None:
            raise ValueError("an array has no pixel scale; give pixel_scale in arcsec.")
        if hdu is not None:
            raise ValueError(f"hdu is {hdu!r}, but an array has no extensions.")
    scale = positive("pixel_scale", pixel_scale, "arcsec per pixel")
    frame = positive("frame_pixel_scale", frame_pixel_scale, "arcsec per pixel")
    light = SourceImage(np.fliplr(samples) if mirrored else samples, name)
    columns: dict[str, Any] = {
        "kind": np.array([IMAGE], dtype="U13"),
        "x": [x],
        "y": [y],
        "flux": np.atleast_1d(flux if hasattr(flux, "unit") else flux * FLUX_UNIT),
        "r_half": [light.r_half * scale / frame] * u.pix,
        "ellipticity": [0.0],
        "pa": np.atleast_1d(pa if hasattr(pa, "unit") else pa * u.deg),
        "image": [keep(light)],
    }
    if spectrum is not None:
        columns["spectrum"] = [str(spectrum)]
    table = QTable(columns)
    check_sources(table)
    return table


def keep(image: SourceImage) -> str:
    """Keep an image so that source tables can name it, and return its text."""
    _kept.setdefault(image.digest, image)
    return image.text


def kept_image(text: str) -> SourceImage:
    """Return the image that a text of a source table names.

    One that is not kept is looked for in the file that the text names.

    Raises
    ------
    ValueError
        If there is none; the message says what to do.
    """
    name, mark, digest = text.rpartition("#")
    if not mark or not name:
        raise ValueError(
            f"{text!r} names no image; make the source with napari_issis.image_source."
        )
    if digest not in _kept and name != ARRAY:
        found = _found(Path(name), digest)
        if found is not None:
            keep(found)
    if digest not in _kept:
        where = "" if name == ARRAY else f", and {name} holds no image with that digest"
        raise ValueError(
            f"the image {text!r} is not loaded{where}; load it with napari_issis.image_source, "
            "or open the FITS file of an exposure, which holds its images."
        )
    return _kept[digest]


def kept_images(table: Any) -> dict[str, SourceImage]:
    """Return the images that a source table names, by their texts, in the order of the rows."""
    texts = image_texts(table)
    if texts is None:
        return {}
    imaged = [str(kind).strip() == IMAGE for kind in table["kind"]]
    return {text: kept_image(text) for text in dict.fromkeys(texts[imaged].tolist())}


def check_in_files(table: Any) -> None:
    """Raise a ValueError if an image of a source table cannot be read again from a file."""
    texts = image_texts(table)
    for text, image in kept_images(table).items():
        name = text.rpartition("#")[0]
        if name == ARRAY or not _found(Path(name), image.digest):
            assert texts is not None
            row = int(np.argmax(texts == text))
            lies = "was an array" if name == ARRAY else f"is no longer in {name}"
            raise ValueError(
                f"row {row}, image: the image {lies}, and this format holds no images; "
                "write the table, or an exposure of it, as FITS."
            )


def _found(path: Path, digest: str) -> SourceImage | None:
    """Image of a file that has a digest, mirrored or not, if there is one."""
    from .fits_image import read_image
    from .fits_table import open_fits

    try:
        with open_fits(path) as hdus:
            numbers = [i for i, hdu in enumerate(hdus) if hdu.is_image and len(hdu.shape) >= 2]
        for number in numbers:
            samples = read_image(path, hdu=number).data
            # an image that cannot be a source is not the one
            if samples.size > MOST_SAMPLES or not np.isfinite(samples).all() or samples.sum() <= 0:
                continue
            for one in (samples, np.fliplr(samples)):
                light = SourceImage(one, str(path))
                if light.digest == digest:
                    return light
    except (OSError, ValueError):
        pass
    return None


def _restored(array: Array, text: str) -> SourceImage:
    image = SourceImage(array, text.rpartition("#")[0])
    keep(image)
    return _kept[image.digest]


def _gaussian_series(period: int) -> Array:
    """Fourier series of exp(-n^2 / 2) over the integers n, at the multiples of 1 / period."""
    n = np.arange(-12.0, 13.0)
    k = np.arange(period) / period
    series: Array = np.cos(2 * np.pi * np.outer(k, n)) @ np.exp(-0.5 * n**2)
    return series

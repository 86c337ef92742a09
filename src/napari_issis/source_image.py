"""An image that is a source's light, between its samples too."""

from __future__ import annotations

import hashlib
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import fft

Array = NDArray[np.float64]

# Most samples of an image; a render takes some 20 microseconds for each that holds light.
MOST_SAMPLES = 1024 * 1024
# Samples of zero about the image over which its interpolation fades out, by exp(-1/2) each.
MARGIN = 64
DIGITS = 16
ARRAY = "array"


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
        samples.setflags(write=False)
        self.array = samples
        digest = hashlib.sha256(repr(samples.shape).encode() + samples.tobytes()).hexdigest()
        self.digest = digest[:DIGITS]
        self.text = f"{name}#{self.digest}"

    @property
    def negative_light(self) -> float:
        """Light of the negative samples over that of all."""
        return float(-self.array[self.array < 0].sum() / self.array.sum())

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
        from .kept_images import restored

        return restored, (np.array(self.array), self.text)


def _gaussian_series(period: int) -> Array:
    """Fourier series of exp(-n^2 / 2) over the integers n, at the multiples of 1 / period."""
    n = np.arange(-12.0, 13.0)
    k = np.arange(period) / period
    series: Array = np.cos(2 * np.pi * np.outer(k, n)) @ np.exp(-0.5 * n**2)
    return series

"""Noise that is a pure function of the expected counts, the seed and the pixel."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from .dead_time import dead_time_quantile, photons_of
from .poisson_quantile import poisson_quantile

MAX_EXPECTED = 1e15


def poisson_counts(
    expected: NDArray[np.float64],
    seed: int,
    *,
    dead_share: float = 0.0,
    previous: tuple[NDArray[np.float64], NDArray[np.int64]] | None = None,
    windows: Sequence[tuple[slice, slice]] | None = None,
) -> NDArray[np.int64]:
    """Draw Poisson counts, or those of a detector with a dead time.

    The counts of a pixel are the smallest k with CDF(k; expected) >= u, u being the pixel's
    own uniform number (`pixel_uniforms`). Hence they depend on nothing but its expected
    counts, its position and the seed, and never fall when its expected counts rise.

    Parameters
    ----------
    expected : ndarray of float64, shape (ny, nx)
        Expected counts, from 0 to 1e15.
    seed : int
        Seed of the noise, 0 or more.
    dead_share : float
        Time for which a pixel is blind after each count, over the exposure time; then
        ``expected`` is reduced by it, to lambda / (1 + lambda d) for lambda photons, and the
        distribution that of `napari_issis.dead_time`.
    previous : (ndarray, ndarray), optional
        Expected counts and counts of an earlier call with the same seed and shape. Only the
        pixels whose expected counts differ are drawn; the result is the same.
    windows : sequence of (slice, slice), optional
        Parts of the frame outside of which nothing differs from ``previous``: only they are
        looked at.

    Returns
    -------
    ndarray of int64, shape (ny, nx)
        The counts, exactly so distributed to the resolution of a 53-bit uniform number.

    Raises
    ------
    ValueError
        If an expected number is negative, not finite or above 1e15, the array is not
        two-dimensional, the seed is not an integer of 0 or more, `previous` has another
        shape, or a pixel receives more than 1e15 photons, of which a dead time leaves fewer.
    """
    expected = np.asarray(expected, dtype=np.float64)
    if expected.ndim != 2:
        raise ValueError(
            f"expected has {expected.ndim} dimensions; give an image of shape (ny, nx)."
        )
    whole = (slice(None), slice(None))
    parts = [whole] if previous is None or windows is None else list(windows)
    _check_range(expected, parts)
    if dead_share > 0:
        _check_photons(expected, parts, dead_share)
    u, z = _uniforms_and_normals(checked_seed(seed), expected.shape)
    if previous is None:
        drawn = _quantile(u.ravel(), expected.ravel(), z.ravel(), dead_share)
        return drawn.reshape(expected.shape)
    before, counts_before = (np.asarray(a) for a in previous)
    if before.shape != expected.shape or counts_before.shape != expected.shape:
        raise ValueError(
            f"previous has the shapes {before.shape} and {counts_before.shape}; both must be "
            f"that of expected, {expected.shape}."
        )
    counts = counts_before.astype(np.int64)
    for part in parts:
        changed = expected[part] != before[part]
        drawn = _quantile(u[part][changed], expected[part][changed], z[part][changed], dead_share)
        counts[part][changed] = drawn
    return counts


def _quantile(
    u: NDArray[np.float64],
    expected: NDArray[np.float64],
    z: NDArray[np.float64],
    dead_share: float,
) -> NDArray[np.int64]:
    if dead_share > 0:
        return dead_time_quantile(u, photons_of(expected, dead_share), dead_share, z)
    return poisson_quantile(u, expected, z)


def pixel_uniforms(seed: int, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Uniform random numbers of the pixels of a frame.

    Parameters
    ----------
    seed : int
        Seed, 0 or more.
    shape : (int, int)
        Frame ``(ny, nx)`` in pixels.

    Returns
    -------
    ndarray of float64, shape (ny, nx)
        Multiples of 2^-53 in (0, 1), with 2^-54 in place of 0; read-only. The number of pixel
        [y, x] depends on the seed, y and x, not on the shape. The last two frames are kept.

    Raises
    ------
    ValueError
        If the seed is not an integer of 0 or more.

    Notes
    -----
    Philox4x64-10 (Salmon et al. 2011, SC'11) with the key that numpy's ``SeedSequence`` makes
    of the seed; each row has 2^64 counter values of its own.
    """
    ny, nx = shape
    return _uniforms_and_normals(checked_seed(seed), (int(ny), int(nx)))[0]


@lru_cache(maxsize=2)
def _uniforms_and_normals(
    seed: int, shape: tuple[int, int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    ny, nx = shape
    u = np.empty(shape)
    key = np.random.SeedSequence(seed).generate_state(2, np.uint64)
    for y in range(ny):
        bits = np.random.Philox(key=key, counter=[0, y, 0, 0]).random_raw(nx)
        u[y] = bits >> np.uint64(11)
    u *= 2.0**-53
    np.maximum(u, 2.0**-54, out=u)
    z = ndtri(u)
    u.flags.writeable = z.flags.writeable = False
    return u, z


def checked_seed(seed: Any) -> int:
    """Return a seed as an int, or raise a ValueError that names it."""
    if not isinstance(seed, Integral) or seed < 0:
        raise ValueError(f"seed is {seed!r}; it must be an integer of 0 or more.")
    return int(seed)


def _check_photons(
    expected: NDArray[np.float64], parts: Sequence[tuple[slice, slice]], dead_share: float
) -> None:
    for part in parts:
        brightest = expected[part].max(initial=0.0)
        photons = float(photons_of(np.array([brightest]), dead_share)[0])
        if photons > MAX_EXPECTED:
            y, x = np.argwhere(expected == brightest)[0]
            raise ValueError(
                f"pixel [{y}, {x}] receives {photons:.4g} photons in the exposure, more than "
                f"{MAX_EXPECTED:g}; shorten the exposure or make the sources fainter."
            )


def _check_range(expected: NDArray[np.float64], parts: Sequence[tuple[slice, slice]]) -> None:
    if all(
        part.size == 0 or (part.min() >= 0 and part.max() <= MAX_EXPECTED)
        for part in (expected[window] for window in parts)
    ):
        return
    y, x = np.argwhere(~((expected >= 0) & (expected <= MAX_EXPECTED)))[0]
    value = float(expected[y, x])
    if value > MAX_EXPECTED and value != np.inf:
        raise ValueError(
            f"pixel [{y}, {x}] expects {value:.4g} counts, more than {MAX_EXPECTED:g}; shorten "
            "the exposure or make the sources fainter."
        )
    raise ValueError(
        f"pixel [{y}, {x}] expects {value} counts; expected counts must be finite and not negative."
    )

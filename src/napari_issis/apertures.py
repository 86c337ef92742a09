"""Aperture photometry of an exposure beside the truth: what the neighbours do to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from .aperture_masks import Apertures, own_shares, ring_levels, sums
from .exposure import Exposure
from .source_rates import sources_and_rates
from .sources import SourceArrays

Array = NDArray[np.float64]

SKIES = ("known", "mean", "median")
# Of apertures and annuli, pixels: their masks are as large as they are.
LARGEST = 3000.0
# Standard error of the median of a normal distribution over that of the mean.
MEDIAN_ERROR = np.sqrt(np.pi / 2)


def aperture_photometry(
    exposure: Exposure,
    *,
    radius: Any = 5.0,
    scale: float = 2.0,
    sky: str = "known",
    annulus: tuple[float, float] = (2.0, 3.0),
    sigma_clip: float | None = 3.0,
    rows: int | Sequence[int] | None = None,
) -> QTable:
    """Measure the sources of an exposure in apertures, and compare with what they are.

    Parameters
    ----------
    exposure : Exposure
        The simulated exposure; its source table says where the apertures go.
    radius : float or Quantity
        Radius of the apertures of points, in pixels or as an angle.
    scale : float
        Apertures of extended sources are ellipses of their ellipticity and position angle
        with the semi-axes sqrt((scale r_half)^2 + radius^2) and
        sqrt((scale r_half (1 - ellipticity))^2 + radius^2): that of a point where they are small.
    sky : {"known", "mean", "median"}
        What is subtracted: the sky that was put in, or that of an elliptical annulus about
        each aperture.
    annulus : (float, float)
        Inner and outer edge of the annulus over the edge of the aperture, 1 or more.
    sigma_clip : float or None
        Pixels of the annulus farther than this many standard deviations from the median are
        left out, again and again until none is; None keeps all.
    rows : int or sequence of int, optional
        Rows of the source table to measure; all by default.

    Returns
    -------
    astropy.table.QTable
        One row a source: ``row kind x y``; ``a b pa area`` of its aperture in pixels and
        degrees; ``aperture_counts``; ``sky``, counts per pixel; ``net_counts``, the sky
        subtracted; ``aperture_correction``, 1 over the share of the source's own light in the
        aperture; ``counts``, net counts times that, and its 1-sigma ``counts_error``; ``snr``;
        ``true_counts``, what the source sends to the detector in all; ``bias``, what
        the same measurement of the expected image gives too much, ``bias_percent`` of the
        truth and ``bias_sigma``, in units of the error; ``complete``, whether the aperture
        lies within the frame. What cannot be divided by zero is 0. ``meta`` holds the options.

    Raises
    ------
    ImportError
        If ``photutils`` is not installed: ``pip install "napari-issis[photometry]"``.
    ValueError
        If an option is out of range, a row does not exist, or an aperture is too large; the
        message names it.

    Notes
    -----
    Pixels on the edge count by the part of them that lies inside. The correction is that of the
    source alone, imaged without noise at its own place among the pixels: for a point the PSF's
    encircled energy, widened by the pixel. So an isolated source has no bias. The error is
    sqrt(N + area^2 s^2) of N counts and a sky known to s, from Poisson's law.

    Counts are whole numbers: where the sky is a few counts per pixel or less, the median and
    clipping are far off its mean, which ``bias`` does not show; take ``sky="known"``, or
    ``"mean"`` with ``sigma_clip=None``.
    """
    _require_photutils()
    observation = exposure.observation
    size = _radius(radius, observation.pixel_scale)
    _check(scale, sky, annulus, sigma_clip)
    arrays, rates = sources_and_rates(exposure.sources, observation)
    chosen = _rows(rows, len(arrays))
    arrays, truth = arrays.take(chosen), rates[chosen] * observation.exposure
    apertures = _apertures(arrays, size, scale)
    reach = apertures.a * (1.0 if sky == "known" else annulus[1])
    for i in np.flatnonzero(reach > LARGEST):
        raise ValueError(
            f"row {chosen[i]}: its aperture or annulus reaches {reach[i]:.4g} pixels; at most "
            f"{LARGEST:g} can be. Choose a smaller scale or annulus, or leave it out by rows."
        )
    masks = apertures.masks()
    area, complete = _areas(apertures, masks, observation.shape)
    share = own_shares(exposure.sources[chosen], arrays, apertures, masks, observation)

    rings = [] if sky == "known" else apertures.rings(*annulus)

    def measured(image: Array) -> tuple[Array, Array, Array]:
        total = sums(image, masks)
        if sky == "known":
            return total, np.full(len(area), exposure.background), np.zeros(len(area))
        level, mean, count = ring_levels(image, rings, sigma_clip, sky == "median")
        seen = count > 0
        error = np.sqrt(_ratio(np.where(seen, np.maximum(mean, 0.0), 0.0), count.astype(float)))
        error *= MEDIAN_ERROR if sky == "median" else 1.0
        return total, np.where(seen, level, exposure.background), error

    counts, level, level_error = measured(exposure.counts.astype(np.float64))
    net = counts - area * level
    error = np.sqrt(np.maximum(counts, 0.0) + (area * level_error) ** 2)
    ideal, ideal_level, _ = measured(exposure.expected)
    correction = _ratio(np.ones_like(share), share)
    bias = (ideal - area * ideal_level) * correction - truth
    corrected_error = error * correction
    return QTable(
        {
            "row": chosen,
            "kind": arrays.kind,
            "x": arrays.x * u.pix,
            "y": arrays.y * u.pix,
            "a": apertures.a * u.pix,
            "b": apertures.b * u.pix,
            "pa": arrays.pa * u.deg,
            "area": area * u.pix**2,
            "aperture_counts": counts * u.ct,
            "sky": level * u.ct / u.pix**2,
            "net_counts": net * u.ct,
            "aperture_correction": correction,
            "counts": net * correction * u.ct,
            "counts_error": corrected_error * u.ct,
            "snr": _ratio(net, error),
            "true_counts": truth * u.ct,
            "bias": bias * u.ct,
            "bias_percent": 100 * _ratio(bias, truth),
            "bias_sigma": _ratio(bias, corrected_error),
            "complete": complete,
        },
        meta={
            "radius": size,
            "scale": float(scale),
            "sky": sky,
            **({} if sky == "known" else {"annulus": list(annulus), "sigma_clip": sigma_clip}),
            "seed": exposure.seed,
        },
    )


def _apertures(arrays: SourceArrays, radius: float, scale: float) -> Apertures:
    major = scale * arrays.r_half
    minor = major * (1 - arrays.ellipticity)
    # pa counts from +y, an angle of photutils from +x
    theta = np.radians(arrays.pa + 90.0)
    return Apertures(arrays.x, arrays.y, np.hypot(major, radius), np.hypot(minor, radius), theta)


def _areas(
    apertures: Apertures, masks: list[Any], shape: tuple[int, int]
) -> tuple[Array, NDArray[np.bool_]]:
    """Area of each aperture within the frame, and whether that is all of it."""
    area = sums(np.ones(shape), masks)
    return area, area > np.pi * apertures.a * apertures.b * (1 - 1e-6)


def _ratio(above: Array, below: Array) -> Array:
    return np.divide(above, below, out=np.zeros_like(below), where=below > 0)


def _rows(rows: int | Sequence[int] | None, n: int) -> NDArray[np.intp]:
    if rows is None:
        return np.arange(n)
    chosen = np.atleast_1d(np.asarray(rows, dtype=np.intp))
    for row in chosen[(chosen < 0) | (chosen >= n)]:
        raise ValueError(f"there is no row {row}; the table has {n} rows, from 0.")
    return chosen


def _radius(radius: Any, pixel_scale: float) -> float:
    try:
        scale = u.pixel_scale(pixel_scale * u.arcsec / u.pix)
        size = float(u.Quantity(radius, getattr(radius, "unit", u.pix)).to_value(u.pix, scale))
    except (TypeError, ValueError):
        raise ValueError(
            f"radius is {radius!r}; it must be a number of pixels, or an angle."
        ) from None
    if not 0 < size <= LARGEST:
        raise ValueError(f"radius is {radius}; it must be above 0 and at most {LARGEST:g} pixels.")
    return size


def _check(scale: Any, sky: Any, annulus: Any, sigma_clip: Any) -> None:
    if not _is_number(scale) or scale <= 0:
        raise ValueError(f"scale is {scale!r}; it must be a number above 0.")
    if sky not in SKIES:
        raise ValueError(f"sky is {sky!r}; known: {', '.join(SKIES)}.")
    try:
        inner, outer = annulus
        good = _is_number(inner) and _is_number(outer) and 1 <= inner < outer
    except (TypeError, ValueError):
        good = False
    if not good:
        raise ValueError(
            f"annulus is {annulus!r}; give its edges over that of the aperture, such as (2, 3)."
        )
    if sigma_clip is not None and (not _is_number(sigma_clip) or sigma_clip <= 0):
        raise ValueError(f"sigma_clip is {sigma_clip!r}; give a number above 0, or None.")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and bool(np.isfinite(value))


def _require_photutils() -> None:
    try:
        import photutils.aperture  # noqa: F401
    except ImportError as error:
        raise ImportError(
            'aperture photometry needs photutils: pip install "napari-issis[photometry]"'
        ) from error

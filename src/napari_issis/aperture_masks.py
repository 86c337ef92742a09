"""Elliptical apertures on pixels, and the share of a source's own light that each holds."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from astropy.table import Table
from astropy.utils.exceptions import AstropyUserWarning
from numpy.typing import NDArray

from .observation import Observation
from .render import count_rate
from .render.optics import Optics
from .render.point_images import point_images
from .sources import SourceArrays

Array = NDArray[np.float64]

# Points whose images are made at once: some ten megabytes.
CHUNK = 256
# Pixels of annuli that are clipped at once.
MOST_VALUES = 2_000_000


@dataclass(frozen=True, eq=False)
class Apertures:
    """Elliptical apertures: centres, semi-axes (pixels) and angles from +x to +y (radians)."""

    x: Array
    y: Array
    a: Array
    b: Array
    theta: Array

    def masks(self) -> list[Any]:
        """Shares of the pixels that lie in each aperture, `photutils.aperture.ApertureMask`."""
        from photutils.aperture import EllipticalAperture

        def made(places: Array, a: float, b: float, theta: float) -> list[Any]:
            return list(EllipticalAperture(places, a, b, theta=theta).to_mask(method="exact"))

        return self._of_alike(made)

    def rings(self, inner: float, outer: float) -> list[Any]:
        """Pixels whose centres lie in an annulus; its edges are over that of each aperture."""
        from photutils.aperture import EllipticalAnnulus

        def made(places: Array, a: float, b: float, theta: float) -> list[Any]:
            edges = inner * a, outer * a, outer * b
            ring = EllipticalAnnulus(places, *edges, b_in=inner * b, theta=theta)
            return list(ring.to_mask(method="center"))

        return self._of_alike(made)

    def _of_alike(self, made: Callable[[Array, float, float, float], list[Any]]) -> list[Any]:
        """Masks by one call for all apertures that are alike, as photutils is quickest."""
        result: list[Any] = [None] * self.x.size
        if not result:
            return result
        figures = np.stack([self.a, self.b, self.theta], axis=1)
        places = np.stack([self.x, self.y], axis=1)
        _, group = np.unique(figures, axis=0, return_inverse=True)
        group = group.ravel()
        order = np.argsort(group, kind="stable")
        for alike in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
            for i, mask in zip(
                alike, made(places[alike], *figures[alike[0]].tolist()), strict=True
            ):
                result[i] = mask
        return result


def sums(image: Array, masks: list[Any]) -> Array:
    """Sum of an image in each aperture; 0 outside the frame."""
    result = np.zeros(len(masks))
    for i, mask in enumerate(masks):
        inside, part = mask.get_overlap_slices(image.shape)
        if inside is not None:
            result[i] = (image[inside] * mask.data[part]).sum()
    return result


def ring_levels(
    image: Array, rings: list[Any], clip: float | None, median: bool
) -> tuple[Array, Array, NDArray[np.intp]]:
    """Sky in each annulus of an image.

    Parameters
    ----------
    image : ndarray, shape (ny, nx)
        Counts.
    rings : list of ApertureMask, of length n
        The annuli.
    clip : float or None
        Pixels farther than this many standard deviations from the median are left out.
    median : bool
        Whether the level is the median or the mean.

    Returns
    -------
    level, mean : ndarray, shape (n,)
        Counts per pixel; NaN of an annulus without pixels.
    count : ndarray of int, shape (n,)
        Pixels that were kept.
    """
    from astropy.stats import sigma_clip

    level, mean = np.full(len(rings), np.nan), np.full(len(rings), np.nan)
    count = np.zeros(len(rings), dtype=np.intp)
    values = [np.asarray(ring.get_values(image), dtype=np.float64) for ring in rings]
    sizes = np.array([each.size for each in values], dtype=np.intp)
    # those of about the same size at once
    order = np.argsort(sizes, kind="stable")
    order = order[sizes[order] > 0]
    first = 0
    while first < order.size:
        last = first + max(1, MOST_VALUES // int(sizes[order[min(first + CHUNK, order.size) - 1]]))
        rows = order[first : min(last, first + CHUNK)]
        table = np.full((rows.size, int(sizes[rows[-1]])), np.nan)
        for line, i in zip(table, rows, strict=True):
            line[: sizes[i]] = values[i]
        if clip is not None:
            with warnings.catch_warnings():
                # the NaN that fill the lines
                warnings.simplefilter("ignore", AstropyUserWarning)
                table = sigma_clip(table, sigma=clip, maxiters=None, axis=1, masked=False)
        count[rows] = np.isfinite(table).sum(axis=1)
        mean[rows] = np.nanmean(table, axis=1)
        level[rows] = np.nanmedian(table, axis=1) if median else mean[rows]
        first += rows.size
    return level, mean, count


def own_shares(
    table: Table, arrays: SourceArrays, apertures: Apertures, masks: list[Any], where: Observation
) -> Array:
    """Share of each source's light that its aperture holds, on pixels, without noise.

    Parameters
    ----------
    table : astropy.table.Table
        The source table, of n rows.
    arrays : SourceArrays
        The same, checked.
    apertures : Apertures
        One for each source; its place within a pixel counts.
    masks : list of ApertureMask
        Theirs.
    where : Observation
        The instrument set-up.
    """
    shares = np.full(len(arrays), np.nan)
    optics = Optics(where.effective_psf, where.pixel_scale)
    points = np.flatnonzero(arrays.kind == "point")
    if points.size:
        # all points have the same radius
        half = int(np.ceil(apertures.a[points[0]])) + 1
        for first in range(0, points.size, CHUNK):
            rows = points[first : first + CHUNK]
            images = point_images(optics, arrays.y[rows], arrays.x[rows], half)
            if images is None:
                break
            for i, image in zip(rows, images, strict=True):
                box = masks[i].bbox
                top = box.iymin - int(np.rint(arrays.y[i])) + half
                left = box.ixmin - int(np.rint(arrays.x[i])) + half
                own = image[top : top + box.shape[0], left : left + box.shape[1]]
                shares[i] = (own * masks[i].data).sum()
    for i in np.flatnonzero(np.isnan(shares)):
        one = Apertures(*(getattr(apertures, name)[i : i + 1] for name in _NAMES))
        shares[i] = _rendered_share(table[i : i + 1], one, where)
    return shares


_NAMES = tuple(Apertures.__dataclass_fields__)


def _rendered_share(one: Table, aperture: Apertures, observation: Observation) -> float:
    """Share of the light of one source in its aperture, from an image of it alone."""
    half = int(np.ceil(aperture.a[0])) + 1
    x, y = (half + v - np.rint(v) for v in (aperture.x, aperture.y))
    flux = 1e-15
    alone = Table(one)
    # with a flat spectrum and open filters, whose rate is known
    alone.keep_columns([name for name in alone.colnames if name != "spectrum"])
    alone["x"], alone["y"], alone["flux"] = x, y, np.array([flux])
    frame = observation.replace(
        shape=(2 * half + 1, 2 * half + 1),
        filters=("open", "open"),
        psf=observation.effective_psf,
    )
    masks = replace(aperture, x=x, y=y).masks()
    return float(sums(count_rate(alone, frame), masks)[0] / (flux * frame.cps_per_flux))

"""The renderer: from a source table to the expected count rate, exact to a tolerance."""

from __future__ import annotations

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from ..observation import Observation
from ..psf import RadialPSF
from ..source_rates import sources_and_rates
from ..sources import SourceArrays
from .bounds import brightest_pixels, outside, psf_beyond, unseen
from .direct import add_direct, has_sharp_edge
from .fine_mesh import fine_meshes
from .gaussians import NODES, Gaussians, decompose, join
from .images import (
    highest_gaussian,
    image_excess,
    image_gaussians,
    image_peak,
    image_reach,
    is_image,
)
from .meshes import LARGEST_DISC, mesh_rate
from .optics import Optics
from .plan import BAND, make_plan
from .profiles import disc_envelope, sersic_transform
from .stamps import add_stamps

Array = NDArray[np.float64]

# tolerances accepted; below, rounding of the transforms is larger
SMALLEST_TOLERANCE = 1e-12
# side in pixels of the squares in which neighbours are counted
NEIGHBOURHOOD = 128.0
# half-light radius in pixels above which a uniform ellipse gets no stamp of its own
LARGEST_STAMP = 300.0


def count_rate(
    sources: Table, observation: Observation | None = None, *, tolerance: float = 1e-6
) -> Array:
    """Compute the expected count rate of the sources alone, after filters and PSF, without sky.

    Parameters
    ----------
    sources : astropy.table.QTable
        The source table.
    observation : Observation, optional
        The instrument set-up, by default the paper's.
    tolerance : float
        Largest error of any pixel over the image's largest pixel, 1e-12 to 0.1. Where only
        the wings of sources are in the frame, the error is not below 1e-14 of the brightest
        source's own peak.

    Returns
    -------
    ndarray of float64, shape (ny, nx)
        cps per pixel. Exact zeros if the scene is empty; ripple below zero stays within the
        tolerance.

    Raises
    ------
    ValueError
        If the table or the tolerance is not valid; the message names the value.
    """
    return render(sources, observation or Observation(), tolerance=tolerance)


def render(
    sources: Table,
    observation: Observation,
    *,
    tolerance: float,
    absolute: float | None = None,
) -> Array:
    """`count_rate` with a second demand: the error is also at most ``absolute`` cps per pixel.

    The tolerance is tightened for that as far as 1e-12.
    """
    if not isinstance(tolerance, float | int) or not SMALLEST_TOLERANCE <= tolerance <= 0.1:
        raise ValueError(
            f"tolerance is {tolerance!r}; it must lie between {SMALLEST_TOLERANCE} and 0.1."
        )
    arrays, rate = arrays_and_rates(sources, observation)
    if not len(arrays):
        return np.zeros(observation.shape)
    optics = Optics(observation.effective_psf, observation.pixel_scale)
    own_peak = peaks(optics, arrays, rate)
    bound = brightest_pixels(optics, observation.shape, arrays, rate)
    least = 1e-14 * float(own_peak.max())
    # The image's peak is not known yet: start from what the sources in the frame give.
    inside = (np.abs(arrays.y - 0.5 * (observation.shape[0] - 1)) <= 0.5 * observation.shape[0]) & (
        np.abs(arrays.x - 0.5 * (observation.shape[1] - 1)) <= 0.5 * observation.shape[1]
    )
    peak = float(own_peak[inside].max(initial=0.0)) or float(own_peak.max())
    while True:
        allowed = tolerance * peak
        if absolute is not None:
            allowed = min(allowed, max(absolute, SMALLEST_TOLERANCE * peak))
        allowed = max(allowed, least)
        dark = unseen(bound, 0.05 * allowed)
        if dark.all():
            # no pixel is brighter than all bounds together
            found = float(bound.sum())
            if allowed <= least:
                return np.zeros(observation.shape)
        else:
            seen = arrays.take(~dark)
            image = _render(optics, observation.shape, seen, rate[~dark], allowed, own_peak[~dark])
            found = float(image.max())
            if allowed <= least or found >= 0.5 * peak:
                return image
        peak = max(min(found, 0.1 * peak), least)


def arrays_and_rates(sources: Table, observation: Observation) -> tuple[SourceArrays, Array]:
    """Return the sources that are not dark, and their count rates after the filters."""
    arrays, rate = sources_and_rates(sources, observation)
    bright = rate > 0
    return arrays.take(bright), rate[bright]


def _render(
    optics: Optics,
    shape: tuple[int, int],
    sources: SourceArrays,
    rate: Array,
    allowed: float,
    own_peak: Array,
) -> Array:
    """Render with an error of at most ``allowed`` cps per pixel."""
    brightest = float(own_peak.max())
    is_point, is_disc, imaged = (
        sources.kind == "point",
        sources.kind == "uniform",
        is_image(sources),
    )
    lattice: Gaussians | None = None
    if imaged.any():
        pictures, picture_rate = sources.take(imaged), rate[imaged]
        lattice = image_gaussians(pictures, picture_rate, allowed)
        brightest = max(brightest, highest_gaussian(optics, pictures, picture_rate))
    sharp_edge = has_sharp_edge(
        optics, 0.1 * allowed / brightest, optics.extent + 50.0, optics.point_area
    )
    strength = _ring_strength(optics, sources, rate)
    # the rings of a disc go out from its edge
    edge = np.where(is_disc, np.sqrt(2) * sources.r_half, image_reach(sources))
    beyond = outside(shape, sources)
    clear = np.maximum(np.hypot(*beyond) - edge, 0.0)
    ringing = ~unseen(strength * psf_beyond(optics, clear), 0.05 * allowed)

    half = np.where(is_point, 0.0, np.sqrt(2) * np.minimum(sources.r_half, LARGEST_DISC))

    def distances(reach: float) -> tuple[float, tuple[float, float]]:
        near = ~imaged & (~is_point | (np.maximum(*beyond) <= reach))
        rings = _distances(sources.take(near & ringing), shape, half[near & ringing])
        seen = _distances(sources.take(near), shape, half[near])
        if lattice is not None:
            far = _distances(lattice, shape)
            rings = max(far[0], rings[0]), max(far[1], rings[1])
            seen = max(far[0], seen[0]), max(far[1], seen[1])
        return float(np.hypot(*rings)), seen

    plan = make_plan(
        optics,
        shape,
        allowed / brightest,
        _ring_accuracy(optics, sources, strength, allowed),
        distances,
        int(is_point.sum()),
        int((~is_point).sum()),
        sharp_edge,
        meshes_only=lattice is not None or bool(np.any(sources.r_half[is_disc] > LARGEST_STAMP)),
    )
    share = 0.03 * allowed
    smooth = ~(is_disc | imaged)
    gaussians = decompose(
        sources.take(smooth),
        rate[smooth],
        plan.digits + 1.0 + np.log(np.minimum(own_peak[smooth] / brightest, 1.0)),
        optics.moment(4 * NODES, np.inf if plan.near == "mesh" else BAND / plan.cell),
        share / np.sqrt(len(sources)),
        fine_meshes(plan)[0].cell if plan.near == "mesh" else plan.cell,
    )
    if lattice is not None:
        gaussians = join([gaussians, lattice])
    image = mesh_rate(plan, shape, gaussians, sources.take(is_disc), rate[is_disc], allowed)
    if sharp_edge:
        add_direct(image, plan, sources, rate)
    elif plan.near == "stamps":
        add_stamps(image, plan, sources, rate, share / np.sqrt(len(sources)))
    return image


def _ring_strength(optics: Optics, sources: SourceArrays, rate: Array) -> Array:
    """Rates of the point sources that have as strong diffraction rings, shape (n,)."""
    psf = optics.psf
    if not isinstance(psf, RadialPSF) or psf.first_edge() == np.inf:
        return np.zeros_like(rate)
    ratio = 1 - sources.ellipticity
    q = 2 * np.pi * sources.r_half * ratio * psf.first_edge() * optics.pixel_scale
    strength = rate.copy()
    disc = sources.kind == "uniform"
    strength[disc] *= disc_envelope(q[disc])
    for n in np.unique(sources.index[np.isfinite(sources.index)]):
        chosen = sources.index == n
        strength[chosen] *= sersic_transform(float(n), q[chosen])
    # the rings of an image are at most those of all its samples
    strength *= image_excess(sources)
    return strength


def _ring_accuracy(optics: Optics, sources: SourceArrays, strength: Array, allowed: float) -> float:
    """Error allowed in the diffraction rings over the peak of the source that has the strongest.

    Rings of neighbours add up at random: the number of equally strong ones that are about as
    far away is taken from the fullest of the squares into which the field is divided.
    """
    strongest = float(strength.max())
    if strongest <= 0:
        return np.inf
    square = np.stack([sources.y, sources.x]) // NEIGHBOURHOOD
    _, which = np.unique(square, axis=1, return_inverse=True)
    neighbours = float(np.bincount(which.ravel(), (strength / strongest) ** 2).max())
    return float(allowed * optics.point_area / (strongest * 3 * (1 + np.sqrt(neighbours))))


def _distances(
    lights: SourceArrays | Gaussians, shape: tuple[int, int], half: Array | float = 0.0
) -> tuple[float, float]:
    """Largest distances (y, x) in pixels between a pixel and the far side of a light."""
    y, x = (
        float((np.maximum(p, n - 1 - p) + half).max(initial=0.0))
        for p, n in zip((lights.y, lights.x), shape, strict=True)
    )
    return y, x


def peaks(optics: Optics, sources: SourceArrays, rate: Array) -> Array:
    """Estimate the highest pixel of each source alone, cps per pixel, shape (n,)."""
    size = np.pi * sources.r_half**2 * (1 - sources.ellipticity)
    # half of the light inside the half-light ellipse; cusps are higher, which is safe
    estimate: Array = rate / (optics.point_area + 2 * size)
    for i in np.flatnonzero(is_image(sources)):
        estimate[i] = image_peak(optics, sources.take(slice(i, i + 1)), float(rate[i]))
    return estimate

"""High frequencies of a PSF whose spectrum ends at a sharp edge.

The sinc interpolation of an undersampled PSF image has a spectrum that is cut at the Nyquist
frequency; its ripples fall like 1/x and reach across every frame, so that neither stamps nor
periodic meshes serve. Here the Fourier integral itself is done by Gauss-Legendre quadrature
up to that edge: nothing is periodic, and the error falls exponentially once the nodes resolve
the largest distance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..image_psf import ImagePSF
from ..sources import SourceArrays
from .near import high_pass
from .optics import Optics
from .plan import Plan
from .stamps import transform

Array = NDArray[np.float64]

# quadrature nodes along half an axis; more would need several GB
MOST_NODES = 7000


def has_sharp_edge(optics: Optics, accuracy: float, reach: float, area: float) -> bool:
    """Whether the ripples of a cut spectrum pass an accuracy at a distance in pixels.

    On an axis they are at most the spectrum along the edge, integrated, over pi times the
    distance. ``area`` is a point source's flux over its peak, ``accuracy`` relative to that.
    """
    if not isinstance(optics.psf, ImagePSF):
        return False
    edge = 0.5 / optics.psf.pixel_scale * optics.pixel_scale
    k = np.linspace(-edge, edge, 4 * max(optics.psf.array.shape) + 1)[1:-1]
    inside = np.array([edge * (1 - 1e-12)])
    along = max(
        float(np.abs(optics.transfer(inside, k)).sum()),
        float(np.abs(optics.transfer(k, inside)).sum()),
    ) * (k[1] - k[0])
    return bool(along * area / (np.pi * reach) > accuracy)


def add_direct(image: Array, plan: Plan, sources: SourceArrays, rate: Array) -> None:
    """Add the high frequencies of every source to an image, by quadrature.

    Parameters are those of `stamps.add_stamps`.

    Raises
    ------
    ValueError
        If the frame is too large for the PSF image's sampling.
    """
    psf = plan.optics.psf
    assert isinstance(psf, ImagePSF)
    edge = 0.5 / psf.pixel_scale * plan.optics.pixel_scale
    ny, nx = image.shape
    row, column = np.arange(ny, dtype=float), np.arange(nx, dtype=float)
    span = plan.optics.extent + 2 * plan.reach(-1)
    ky, weight_y = _nodes(edge, max(np.abs(sources.y).max(), ny, np.ptp(sources.y)) + span)
    kx, weight_x = _nodes(edge, max(np.abs(sources.x).max(), nx, np.ptp(sources.x)) + span)
    ky, weight_y = np.concatenate([-ky[::-1], ky]), np.concatenate([weight_y[::-1], weight_y])
    spectrum = np.zeros((ky.size, kx.size), dtype=np.complex128)
    point = sources.kind == "point"
    phase_y = np.exp(-2j * np.pi * np.outer(ky, sources.y))
    phase_x = np.exp(-2j * np.pi * np.outer(kx, sources.x))
    spectrum += (phase_y[:, point] * rate[point]) @ phase_x[:, point].T
    for i in np.flatnonzero(~point):
        own = transform(sources.take(slice(i, i + 1)), ky, kx) * rate[i]
        spectrum += own * phase_y[:, i, None] * phase_x[None, :, i]
    spectrum *= high_pass(plan, ky, kx)
    spectrum *= weight_y[:, None]
    spectrum *= 2 * weight_x  # kx < 0 holds the complex conjugates
    rows = np.exp(2j * np.pi * np.outer(row, ky)) @ spectrum
    columns = np.exp(2j * np.pi * np.outer(kx, column))
    image += rows.real @ columns.real - rows.imag @ columns.imag


def _nodes(edge: float, distance: float) -> tuple[Array, Array]:
    """Quadrature on [0, edge] for phases over a distance, on panels of 20 nodes.

    A panel holds at most three oscillations.
    """
    panels = int(np.ceil(edge * distance / 3)) + 2
    if 20 * panels > MOST_NODES:
        raise ValueError(
            "the PSF image is cut off at its Nyquist frequency while its spectrum is not small "
            f"there, which a frame and sources over {distance:.0f} pixels cannot be computed "
            "with; use a better sampled PSF image, a smaller frame or a larger tolerance."
        )
    x, w = np.polynomial.legendre.leggauss(20)
    width = edge / panels
    k = ((np.arange(panels)[:, None] + 0.5 * (x + 1)) * width).ravel()
    return k, np.tile(0.5 * w * width, panels)

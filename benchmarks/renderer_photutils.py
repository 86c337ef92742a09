"""photutils: stamps of an oversampled PSF image, stars only."""

from __future__ import annotations

from collections.abc import Callable

import galsim
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray
from photutils.datasets import make_model_image
from photutils.psf import ImagePSF

from napari_issis import Observation, TelescopePSF
from renderer_galsim import galsim_psf

OVERSAMPLING = 5


def stamps(observation: Observation, size: int) -> Callable[[QTable], NDArray[np.float64]]:
    """Make a renderer with stamps of ``size`` pixels a side; the PSF image is made in advance."""
    assert isinstance(observation.psf, TelescopePSF)
    scale = observation.pixel_scale
    effective = galsim.Convolve(galsim_psf(observation.psf, "tight"), galsim.Pixel(scale))
    side = OVERSAMPLING * (size + 2) + 1
    image = effective.drawImage(
        nx=side, ny=side, scale=scale / OVERSAMPLING, method="no_pixel", dtype=float
    )
    # values times OVERSAMPLING^2 are the flux fraction in a pixel centred there
    model = ImagePSF(image.array * OVERSAMPLING**2, oversampling=OVERSAMPLING)

    def draw(table: QTable) -> NDArray[np.float64]:
        rate = np.asarray(table["flux"].value)
        parameters = QTable(
            {
                "x_0": np.asarray(table["x"]),
                "y_0": np.asarray(table["y"]),
                "flux": rate * observation.cps_per_flux,
            }
        )
        frame = make_model_image(observation.shape, model, parameters, model_shape=(size, size))
        return np.asarray(frame, dtype=np.float64)

    return draw

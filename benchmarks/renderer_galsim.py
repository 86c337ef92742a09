"""GalSim (Rowe et al. 2015): each source on its own stamp, or all in one sum.

GalSim counts position angles from +x, this package from +y; its radii are those of circles
of equal area.
"""

from __future__ import annotations

from collections.abc import Callable

import galsim
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from napari_issis import Observation, TelescopePSF

# Accuracy parameters; GalSim's defaults are 5e-3, 1e-3 and 1e-5.
SETTINGS = {
    "default": galsim.GSParams(maximum_fft_size=32768),
    "tight": galsim.GSParams(
        folding_threshold=1e-3,
        maxk_threshold=1e-5,
        kvalue_accuracy=1e-7,
        xvalue_accuracy=1e-7,
        maximum_fft_size=32768,
    ),
}
PROFILES: dict[str, Callable[..., galsim.GSObject]] = {
    "gaussian": galsim.Gaussian,
    "exponential": galsim.Exponential,
    "devaucouleurs": lambda half_light_radius, **rest: galsim.DeVaucouleurs(
        half_light_radius=half_light_radius, trunc=0, **rest
    ),
    "uniform": lambda half_light_radius, **rest: galsim.TopHat(
        radius=np.sqrt(2) * half_light_radius, **rest
    ),
}


def galsim_psf(psf: TelescopePSF, setting: str = "default") -> galsim.GSObject:
    """Obscured Airy pattern of one wavelength, convolved with the Gaussian blur; arcsec."""
    gsparams = SETTINGS[setting]
    airy = galsim.Airy(
        lam=psf.band_limits[0] / 10,
        diam=psf.diameter,
        obscuration=psf.obscuration,
        scale_unit=galsim.arcsec,
        gsparams=gsparams,
    )
    return galsim.Convolve(airy, galsim.Gaussian(fwhm=psf.blur_fwhm, gsparams=gsparams))


def profiles(
    table: QTable, observation: Observation, gsparams: galsim.GSParams
) -> list[galsim.GSObject]:
    """Every source before the PSF, at the origin."""
    rate = np.asarray(table["flux"].value) * observation.cps_per_flux
    radius = np.asarray(table["r_half"].value)
    angle = np.asarray(table["pa"].value) + 90
    objects = []
    for row, kind in enumerate(table["kind"]):
        if kind == "point":
            objects.append(galsim.DeltaFunction(flux=rate[row], gsparams=gsparams))
            continue
        ratio = 1 - float(table["ellipticity"][row])
        circular = float(radius[row]) * np.sqrt(ratio) * observation.pixel_scale
        profile = PROFILES[kind](half_light_radius=circular, flux=rate[row], gsparams=gsparams)
        objects.append(profile.shear(q=ratio, beta=float(angle[row]) * galsim.degrees))
    return objects


def convolved(profile: galsim.GSObject, psf: galsim.GSObject) -> galsim.GSObject:
    """Convolve with the PSF; of a star the PSF itself is drawn, which is quicker."""
    if isinstance(profile, galsim.DeltaFunction):
        return psf.withFlux(profile.flux)
    return galsim.Convolve(profile, psf)


def stamps(
    observation: Observation, setting: str = "default", without: str = ""
) -> Callable[[QTable], NDArray[np.float64]]:
    """Make a renderer that draws each source on a stamp of the size GalSim finds good.

    Sources of the kind ``without`` are left out.
    """
    assert isinstance(observation.psf, TelescopePSF)
    psf = galsim_psf(observation.psf, setting)

    def draw(table: QTable) -> NDArray[np.float64]:
        frame = empty_frame(observation)
        table = table[table["kind"] != without]
        x, y = np.asarray(table["x"]), np.asarray(table["y"])
        for row, profile in enumerate(profiles(table, observation, psf.gsparams)):
            stamp = convolved(profile, psf).drawImage(
                center=galsim.PositionD(x[row], y[row]), scale=observation.pixel_scale, dtype=float
            )
            overlap = stamp.bounds & frame.bounds
            if overlap.isDefined():
                frame[overlap] += stamp[overlap]
        return np.array(frame.array)

    return draw


def one_sum(
    observation: Observation, setting: str = "default"
) -> Callable[[QTable], NDArray[np.float64]]:
    """Make a renderer that draws the sum of all sources at once."""
    assert isinstance(observation.psf, TelescopePSF)
    psf = galsim_psf(observation.psf, setting)

    def draw(table: QTable) -> NDArray[np.float64]:
        frame = empty_frame(observation)
        scale = observation.pixel_scale
        x, y = np.asarray(table["x"]), np.asarray(table["y"])
        objects = [
            profile.shift(
                scale * (x[row] - frame.true_center.x), scale * (y[row] - frame.true_center.y)
            )
            for row, profile in enumerate(profiles(table, observation, psf.gsparams))
        ]
        galsim.Convolve(galsim.Add(objects), psf).drawImage(image=frame, scale=scale)
        return np.array(frame.array)

    return draw


def empty_frame(observation: Observation) -> galsim.Image:
    """Image of the frame, its first pixel at (0, 0)."""
    ny, nx = observation.shape
    return galsim.ImageD(nx, ny, xmin=0, ymin=0, init_value=0.0)

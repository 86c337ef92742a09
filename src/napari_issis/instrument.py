"""The instrument as data: channels, filters, sky and PSF, each number with its source.

Sources
-------
[P]  Shalyapin & Goicoechea 2014, "Crowded-field image simulator for WSO-UV/ISSIS".
[S]  Public WSO-UV pages (wso-uv.es) and Gomez de Castro et al. 2014, Ap&SS 354, 177.
[H]  HST ACS Instrument Handbook, sections 3.5 and 4.5 (SBC: CsI MAMA detector).
[A]  Assumed here; no published value was found.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, sqrt
from types import MappingProxyType

from .psf import TelescopePSF

# linear pixel scale, arcsec per pixel [P]
PIXEL_SCALE = 0.036
# square frames the instrument panel offers, pixels; 512 and 256 [P], the detector is 2048 [P]
FRAME_SIZES = (256, 512, 1024, 2048)
# clear aperture of the T-170M telescope, m [S]
DIAMETER = 1.7
# linear central obscuration of a Ritchey-Chretien of this class [A]
OBSCURATION = 0.33
PSF_NOTE = (
    "The PSF is assumed: no ISSIS PSF has been published. It is an obscured 1.7 m aperture, "
    "averaged over the band and blurred to about 0.10 arcsec FWHM."
)


@dataclass(frozen=True)
class SkyConstants:
    """The paper's sky background at open-open, count rates in cps per pixel.

    The paper prints the total and the sum of earthshine and zodiacal light; the geocorona is
    the difference of the two.
    """

    total: float
    earthshine_and_zodiacal: float

    @property
    def geocorona(self) -> float:
        """Geocoronal emission, cps per pixel."""
        return self.total - self.earthshine_and_zodiacal


@dataclass(frozen=True)
class Channel:
    """One channel of the camera.

    Attributes
    ----------
    band : tuple of float
        Spectral range in angstrom.
    cps_per_flux : float
        Count rate in cps for 1 erg s-1 cm-2 A-1 at open-open.
    sky : SkyConstants
        The paper's background at open-open.
    psf : TelescopePSF
        The PSF used when an observation names no other one. Assumed, see `PSF_NOTE`.
    """

    name: str
    band: tuple[float, float]
    cps_per_flux: float
    sky: SkyConstants
    psf: TelescopePSF

    @property
    def pivot(self) -> float:
        """Pivot wavelength of a flat photon response over the band, angstrom.

        For response 1, lambda_p^2 = int R lambda dlambda / int R dlambda / lambda
        (Bessell & Murphy 2012, PASP 124, 140, eq. A15).
        """
        low, high = self.band
        return sqrt(0.5 * (high**2 - low**2) / log(high / low))


@dataclass(frozen=True)
class CountRateLimits:
    """Rates above which a photon-counting detector stops being linear.

    Values of the nearest analogue, HST ACS/SBC [H]: 22 cps per pixel (1 % non-linearity) and
    2e5 cps over the detector.
    """

    local: float = 22.0
    total: float = 2e5


# transmittances of the neutral filters
FILTERS = MappingProxyType({"open": 1.0, "NF1": 0.1, "NF2": 0.01})  # [P]

CHANNELS = MappingProxyType(
    {
        "FUV": Channel(
            name="FUV",
            band=(1150.0, 1750.0),  # [P]
            cps_per_flux=3.36e15,  # [P]
            sky=SkyConstants(total=4.9e-3, earthshine_and_zodiacal=7.2e-12),  # [P]
            # blur by pointing and detector chosen for about 0.10 arcsec FWHM in all [A]
            psf=TelescopePSF(DIAMETER, OBSCURATION, band=(1150.0, 1750.0), blur_fwhm=0.0945),
        ),
        "NUV": Channel(
            name="NUV",
            band=(1850.0, 3200.0),  # [P]
            cps_per_flux=1.14e17,  # [P]
            sky=SkyConstants(total=3.5e-4, earthshine_and_zodiacal=2.1e-5),  # [P]
            psf=TelescopePSF(DIAMETER, OBSCURATION, band=(1850.0, 3200.0), blur_fwhm=0.0888),
        ),
    }
)

LIMITS = CountRateLimits()

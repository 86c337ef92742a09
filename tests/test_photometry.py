"""AB magnitudes against astropy's."""

import astropy.units as u
import numpy as np
import pytest

import napari_issis as ni
from napari_issis.photometry import ab_magnitude, flux_of_ab_magnitude, surface_brightness
from napari_issis.sources import FLUX_UNIT, check_sources


@pytest.mark.parametrize("channel", ["NUV", "FUV"])
def test_magnitudes_are_those_of_the_source_table(channel):
    """Catches another zero point, another wavelength, and a conversion for F_nu."""
    pivot = ni.Observation(channel=channel).channel_data.pivot
    magnitudes = np.array([15.0, 20.0, 27.5])
    table = ni.random_sources("point", 3, seed=1)
    table["flux"] = magnitudes * u.ABmag
    fluxes = check_sources(table, pivot=pivot).flux
    assert flux_of_ab_magnitude(magnitudes, pivot) == pytest.approx(fluxes, rel=1e-12, abs=0)
    assert ab_magnitude(fluxes, pivot) == pytest.approx(magnitudes, abs=1e-12)


def test_no_light_has_no_magnitude():
    assert ab_magnitude([0.0, 1e-14], 2500.0)[0] == np.inf


def test_surface_brightness_of_a_flat_pixel():
    """Catches a pixel's area taken once instead of twice, or multiplied instead of divided."""
    observation = ni.Observation(filters=("NF1", "open"))
    pivot = observation.channel_data.pivot
    flux = (22.0 * u.ABmag).to(FLUX_UNIT, u.spectral_density(pivot * u.AA)).value
    # 22 mag per square arcsec over a pixel of 0.036 arcsec.
    rate = flux * 0.036**2 * observation.cps_per_flux
    shown = surface_brightness(
        [rate, 0.0, -rate],
        cps_per_flux=observation.cps_per_flux,
        pivot=pivot,
        pixel_scale=0.036,
    )
    assert shown[0] == pytest.approx(22.0, abs=1e-9)
    assert shown[1] == np.inf
    assert np.isnan(shown[2])

"""A scene of two stars and two galaxies in a small frame."""

from astropy.table import QTable, vstack

from napari_issis import GaussianPSF, Observation, source

SMALL = Observation(shape=(64, 80), exposure=50.0, psf=GaussianPSF(0.1))


def few_sources() -> QTable:
    return vstack(
        [
            source("point", 20.25, 12.5, 4e-15),
            source("point", 60.0, 50.0, 2e-15),
            source("exponential", 40.0, 30.0, 1e-14, r_half=6.0, ellipticity=0.4, pa=30.0),
            source("sersic", 61.5, 20.25, 5e-15, r_half=5.0, ellipticity=0.2, pa=100.0, n=2.5),
        ]
    )

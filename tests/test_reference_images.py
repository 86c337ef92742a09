"""The renderer against images made by an independent program (tests/data/README.md).

These catch: the sign of the position angle, R sqrt(q) for the major axis, half a pixel, a
missing or doubled pixel integral, a wrapped or truncated PSF wing, a wrong half-light constant.
"""

from pathlib import Path

import numpy as np
import pytest
from astropy.table import QTable

import napari_issis as ni

DATA = Path(__file__).parent / "data"
NAMES = sorted(path.stem for path in DATA.glob("*.npz"))


def load(name):
    with np.load(DATA / f"{name}.npz") as data:
        table = QTable(
            {c: data[c] for c in ("kind", "x", "y", "flux", "r_half", "ellipticity", "pa")}
        )
        psf = {
            "telescope": lambda: ni.TelescopePSF(
                float(data["diameter"]),
                float(data["obscuration"]),
                float(data["wavelength"]),
                float(data["blur_fwhm"]),
            ),
            "gaussian": lambda: ni.GaussianPSF(float(data["fwhm"])),
            "moffat": lambda: ni.MoffatPSF(float(data["fwhm"]), float(data["beta"])),
        }[str(data["psf"])]()
        return table, ni.Observation(psf=psf, shape=data["image"].shape), data["image"]


def test_all_eight_are_there():
    assert len(NAMES) == 8


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-8])
@pytest.mark.parametrize("name", NAMES)
def test_error_is_within_the_tolerance(name, tolerance):
    table, observation, expected = load(name)
    image = ni.count_rate(table, observation, tolerance=tolerance)
    assert np.abs(image - expected).max() <= tolerance * expected.max()


def test_last_digits_of_galaxies():
    """The image whose reference is good to 1e-11 of the peak and that needs rings of galaxies.

    Catches galaxies painted with too few digits where rings have a mesh of their own.
    """
    table, observation, expected = load("exponential100_telescope")
    image = ni.count_rate(table, observation, tolerance=1e-10)
    assert np.abs(image - expected).max() <= 1e-10 * expected.max()


def test_cheap_accuracy_is_cheap():
    """At 1e-3 the digits of 1e-6 are not paid for: the error is that of a coarser render."""
    table, observation, expected = load("mixed9_telescope")
    error = [
        np.abs(ni.count_rate(table, observation, tolerance=t) - expected).max() / expected.max()
        for t in (1e-3, 1e-6)
    ]
    assert error[0] > 10 * error[1]

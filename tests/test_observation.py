"""The instrument's numbers and the set-up's checks."""

import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from scipy.integrate import trapezoid

import napari_issis as ni
from napari_issis.instruments import ISSIS
from napari_issis.limits import count_rate_warnings
from napari_issis.source_counts import signal_to_noise


def test_numbers_of_the_paper():
    """Conversion, filters, sky; area per pixel and band from the paper's section 2."""
    nuv = ni.Observation(filters=("NF1", "NF2"))
    assert nuv.cps_per_flux == pytest.approx(1.14e17 * 1e-3)
    assert nuv.sky_rate == pytest.approx(3.5e-4 * 1e-3)
    fuv = ni.Observation(channel="FUV")
    assert fuv.cps_per_flux == 3.36e15
    assert fuv.sky_rate == 4.9e-3
    assert fuv.channel_data.sky.geocorona == pytest.approx(4.9e-3 - 7.2e-12)
    assert fuv.pixel_scale * fuv.shape[0] == pytest.approx(18.4, abs=0.05)


def test_pivot_wavelength_by_quadrature():
    """sqrt(int lambda dl / int dl / lambda): catches a band centre in its place."""
    for channel in ISSIS.channels.values():
        w = np.linspace(*channel.band, 200001)
        expected = np.sqrt(trapezoid(w, w) / trapezoid(1 / w, w))
        assert channel.pivot == pytest.approx(expected, rel=1e-8)


def test_central_value_of_the_papers_first_example():
    """An exponential galaxy of 1e-14, R = 20, ellipticity 0.7 has 425.9 counts at its centre."""
    sharp = ni.Observation(shape=(65, 65), psf=ni.GaussianPSF(0.001))
    galaxy = ni.source("exponential", 32.5, 32.5, 1e-14, 20, 0.7, 45)
    h = 20 / 1.6783470
    central = 1140 / (2 * np.pi * h**2 * 0.3) * 100
    assert central == pytest.approx(425.9, abs=0.1)
    # mean over the four pixels about the centre, from the profile by quadrature
    node, weight = np.polynomial.legendre.leggauss(60)
    x = 0.5 * (node + 1)
    along = (x[:, None] + x) / np.sqrt(2)
    across = (x[:, None] - x) / np.sqrt(2) / 0.3
    one = 0.25 * weight @ np.exp(-np.hypot(along, across) / h) @ weight
    other = 0.25 * weight @ np.exp(-np.hypot(across * 0.3, along / 0.3) / h) @ weight
    image = ni.count_rate(galaxy, sharp, tolerance=1e-4)[32:34, 32:34].mean() * 100
    assert image == pytest.approx(central * 0.5 * (one + other), rel=2e-3)


def test_dark_counts(tmp_path):
    """1e-5 cps per pixel behind any filter: catches a dark rate that the filters reduce.

    And one that is left out of B, of the expected counts, of the S/N or of the file.
    """
    observation = ni.Observation(
        filters=("NF2", "NF2"), exposure=1e4, shape=(8, 8), dark=1e-5, background=0.5
    )
    empty = ni.random_sources("point", 0)
    made = ni.simulate(empty, observation)
    each = 1e4 * (0.5 * 1e-4 + 1e-5)
    assert made.expected == pytest.approx(np.full((8, 8), each), rel=1e-12)
    assert made.background == pytest.approx(each, rel=1e-12)
    lit = made.counts > 0
    assert made.snr[lit] == pytest.approx((made.counts[lit] - each) / np.sqrt(made.counts[lit]))
    made.write(tmp_path / "x.fits")
    assert ni.Exposure.read(tmp_path / "x.fits") == made
    assert observation != observation.replace(dark=0.0)
    faint = ni.source("point", 4, 4, 1e-13)
    dark = observation.replace(dark=0.1)
    as_sky = dark.replace(background=0.5 + 0.1 / 1e-4, dark=0.0)
    assert signal_to_noise(faint, dark) == pytest.approx(signal_to_noise(faint, as_sky), rel=1e-9)


def test_equal_and_hashable():
    array = np.ones((3, 3))
    first = ni.Observation(psf=ni.ImagePSF(array, 0.01), pointing=SkyCoord(1 * u.deg, 2 * u.deg))
    second = ni.Observation(
        psf=ni.ImagePSF(array.copy(), 0.01), pointing=SkyCoord(1 * u.deg, 2 * u.deg)
    )
    assert first == second
    assert hash(first) == hash(second)
    assert first != second.replace(roll=1)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"channel": "XUV"}, "channel is 'XUV'"),
        ({"filters": ("open", "NF3")}, "filter is 'NF3'"),
        ({"filters": "open"}, "filters is 'open'"),
        ({"filters": None}, "filters is None"),
        ({"exposure": 0}, "exposure is 0"),
        ({"exposure": np.nan}, "exposure is nan"),
        ({"exposure": -5}, "exposure is -5"),
        ({"exposure": "long"}, "exposure is 'long'"),
        ({"shape": (0, 5)}, "shape is"),
        ({"shape": 512}, "shape is 512"),
        ({"shape": (5.5, 5)}, "shape is"),
        ({"background": -1}, "background is -1"),
        ({"dark": -1e-6}, "dark is -1e-06"),
        ({"dark": "low"}, "dark is 'low'"),
        ({"roll": np.inf}, "roll is inf"),
        ({"roll": "up"}, "roll is 'up'"),
        ({"psf": 3}, "psf is 3"),
        ({"pointing": (3, 4)}, "pointing is"),
        ({"instrument": "HST"}, "instrument is 'HST'"),
    ],
)
def test_bad_set_ups_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        ni.Observation(**options)


def test_count_rate_limits():
    """The paper's own 500 stars exceed 2e5 cps; NF1 cures both limits."""
    stars = ni.random_sources("point", 500, seed=1)
    with pytest.warns(ni.CountRateWarning) as caught:
        ni.simulate(stars)
    messages = [str(w.message) for w in caught if w.category is ni.CountRateWarning]
    assert len(messages) == 2
    assert "2e+05 cps" in messages[0]
    assert "22 cps" in messages[1]
    assert "NF1 would cure" not in messages[0]
    assert messages[1].endswith("The neutral filter NF1 would cure it.")
    assert count_rate_warnings(np.full((10, 10), 21.9), 0.0) == []
    assert len(count_rate_warnings(np.full((10, 10), 22.1), 0.0)) == 1
    assert len(count_rate_warnings(np.full((200, 200), 5.01), 0.0)) == 1


def test_exposure_time_and_seed_render_nothing(monkeypatch):
    from napari_issis import exposure

    observation = ni.Observation(shape=(32, 32))
    star = ni.source("point", 16, 16, 1e-16)
    rate, clipped = exposure.noise_ready_rate(star, observation)
    monkeypatch.setattr(exposure, "render", None)
    longer = observation.replace(exposure=1000)
    made = exposure.expose(rate, star, longer, seed=3, clipped=clipped)
    monkeypatch.undo()
    assert made == ni.simulate(star, longer, seed=3)
    assert made.background == pytest.approx(0.35)
    lit = made.counts > 0
    expected = (made.counts[lit] - 0.35) / np.sqrt(made.counts[lit])
    assert made.snr[lit] == pytest.approx(expected)
    assert not made.snr[~lit].any()


def test_import_loads_neither_napari_nor_qt():
    code = (
        "import sys, napari_issis; "
        "assert not {'napari', 'qtpy', 'magicgui', 'PyQt6'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)

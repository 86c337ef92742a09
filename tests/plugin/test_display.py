"""Brightness scales, limits and the colour bar: the layer holds counts whatever it looks like."""

from __future__ import annotations

import numpy as np
import pytest
from napari.utils.notifications import notification_manager
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from small_scene import SMALL, few_sources

from napari_issis import Detector, simulate
from napari_issis.plugin.brightness import SCALES, counts_at, scaled_colormap, stretched
from napari_issis.plugin.display_form import DisplayForm
from napari_issis.plugin.scene import open_scene

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")

LOW, HIGH, SKY = 2.0, 8000.0, 9.0
# by the definitions, written out
FORMULAS = {
    "linear": lambda c: (c - LOW) / (HIGH - LOW),
    "log": lambda c: np.log10(c / LOW) / np.log10(HIGH / LOW),
    "sqrt": lambda c: (np.sqrt(c) - np.sqrt(LOW)) / (np.sqrt(HIGH) - np.sqrt(LOW)),
    "asinh": lambda c: np.arcsinh((c - LOW) / 9) / np.arcsinh((HIGH - LOW) / 9),
    "snr": lambda c: np.maximum(c - SKY, 0) / np.sqrt(c) / ((HIGH - SKY) / np.sqrt(HIGH)),
}


@pytest.fixture
def form(scene, qtbot):
    form = DisplayForm(scene)
    qtbot.addWidget(form)
    form.resume()
    form.show()
    yield form
    form.pause()


@pytest.mark.parametrize("scale", SCALES)
def test_scales_by_their_formulas(scale):
    """Catches another base or softening, and limits that are not black and white."""
    counts = np.array([LOW, 3.0, 9.0, 10.0, 55.5, 1234.0, HIGH])
    expected = FORMULAS[scale](counts)
    assert stretched(scale, counts, (LOW, HIGH), SKY) == pytest.approx(expected, abs=1e-12)
    assert list(stretched(scale, [0.0, 1e6], (LOW, HIGH), SKY)) == [0.0, 1.0]
    lit = expected > 0
    back = counts_at(scale, expected[lit], (LOW, HIGH), SKY)
    assert back == pytest.approx(counts[lit], rel=2e-3)


@pytest.mark.parametrize("scale", SCALES)
def test_degenerate_limits(scale):
    """Catches a division by zero where all counts are alike or below the sky."""
    for limits in ((0.0, 1.0), (0.0, 0.0), (3.0, 4.0)):
        level = stretched(scale, np.arange(6.0), limits, 100.0)
        assert np.all((level >= 0) & (level <= 1))


@pytest.mark.needs_gl
@pytest.mark.parametrize("scale", SCALES)
def test_the_grey_levels_on_the_screen(scale, make_napari_viewer):
    """Catches a colour table too coarse for faint pixels: within 1.5 of 255 from 2 to 8000 ct."""
    viewer = make_napari_viewer(show=True)
    viewer.window.resize(900, 700)
    counts = np.round(np.geomspace(LOW, HIGH, 900)).astype(np.int64).reshape(30, 30)
    layer = viewer.add_image(counts, contrast_limits=(LOW, HIGH), interpolation2d="nearest")
    base = layer.colormap
    layer.colormap, layer.gamma = scaled_colormap(base, scale, (LOW, HIGH), SKY)
    viewer.reset_view(margin=0)
    image = viewer.screenshot(canvas_only=True, flash=False)[..., 0].astype(float)
    zoom, centre = viewer.scene.camera.zoom, viewer.scene.camera.center[-2:]
    rows = np.rint((np.arange(30) - centre[0]) * zoom + image.shape[0] / 2).astype(int)
    columns = np.rint((np.arange(30) - centre[1]) * zoom + image.shape[1] / 2).astype(int)
    shown = image[np.ix_(rows, columns)]
    expected = 255 * np.clip(FORMULAS[scale](counts), 0, 1)
    assert np.abs(shown - expected).max() < 1.5


@pytest.mark.parametrize("scale", SCALES)
def test_the_layer_holds_counts(scene, scale):
    """Catches a picture whose stretched values are taken for counts."""
    scene.counts.scale = scale
    fresh = simulate(few_sources(), SMALL, seed=scene.seed)
    assert np.array_equal(scene.counts.layer.data, fresh.counts)
    low, high = scene.counts.limits
    assert 0 <= low < high <= fresh.counts.max()


def test_limits_follow_the_scale_and_the_user(scene):
    """Catches limits of the user's that an edit overwrites, and a stale colour table."""
    layer, counts = scene.counts.layer, scene.counts
    counts.scale = "log"
    assert layer.contrast_limits[0] == pytest.approx(max(0.5, scene.exposure.background))
    layer.contrast_limits = (5, 50)
    controls = np.array(layer.colormap.controls)
    want, _ = scaled_colormap(counts._base, "log", (5, 50), scene.exposure.background)
    assert np.array_equal(controls, want.controls)
    scene.undo()
    scene.add(few_sources()[:1])
    scene.wait()
    assert tuple(layer.contrast_limits) == (5, 50)


def test_the_users_colours_are_kept(scene):
    """Catches a scale that goes back to grey, or is lost when a colormap is chosen."""
    scene.counts.scale = "asinh"
    scene.counts.layer.colormap = "viridis"
    assert scene.counts.layer.colormap.name == "viridis (asinh C)"
    scene.counts.scale = "linear"
    assert scene.counts.layer.colormap.name == "viridis"
    assert scene.counts.layer.gamma == 1.0
    scene.counts.scale = "log"
    colors = scene.counts.layer.colormap.map(np.array([0.0, 1.0]))
    np.testing.assert_allclose(colors[0][:3], [0.267, 0.005, 0.329], atol=0.01)
    np.testing.assert_allclose(colors[1][:3], [0.993, 0.906, 0.144], atol=0.01)


def test_expected_and_difference(scene, form):
    """Catches a layer that stays on noise, or keeps the expectation of an older scene."""
    layer = scene.counts.layer
    form.shows.value = "expected"
    assert np.array_equal(layer.data, scene.exposure.expected)
    scene.add(few_sources()[:1])
    scene.wait()
    assert np.array_equal(layer.data, scene.exposure.expected)
    form.shows.value = "difference"
    assert np.array_equal(layer.data, scene.exposure.counts - scene.exposure.expected)
    low, high = layer.contrast_limits
    assert low == -high
    assert not form.scale.enabled
    form.shows.value = "counts"
    assert np.array_equal(layer.data, scene.exposure.counts)


def test_limits_are_typed(scene, form):
    """Catches limits that are swapped, and wrong ones that are taken."""
    notification_manager.records.clear()
    for field, text in ((form.low, "3"), (form.high, "77")):
        field.native.selectAll()
        QTest.keyClicks(field.native, text)
        QTest.keyClick(field.native, Qt.Key.Key_Return)
    assert tuple(scene.counts.layer.contrast_limits) == (3, 77)
    form.low.native.selectAll()
    QTest.keyClicks(form.low.native, "80")
    QTest.keyClick(form.low.native, Qt.Key.Key_Return)
    assert "must be below" in notification_manager.records[-1].message
    assert tuple(scene.counts.layer.contrast_limits) == (3, 77)
    QTest.mouseClick(form.auto.native, Qt.MouseButton.LeftButton)
    assert tuple(scene.counts.layer.contrast_limits) != (3, 77)


@pytest.mark.parametrize("scale", SCALES)
def test_labels_of_the_colour_bar_are_counts(scene, form, scale):
    """Catches labels of stretched values: each stands where its counts have their grey."""
    form.scale.value = scale
    ticks = form.bar.ticks()
    assert len(ticks) >= 3
    limits, sky = scene.counts.limits, scene.exposure.background
    for place, label in ticks:
        assert stretched(scale, float(label), limits, sky) == pytest.approx(place, abs=0.006)
    if scale not in ("log", "snr"):
        # rounded up, the label of the upper limit stays
        scene.counts.set_limits((0.0, 721.6))
        assert form.bar.ticks()[-1] == (1.0, "722")


def test_magnitudes_beside_the_logarithm(scene, form):
    """Catches a forgotten exposure time, pixel area or sky: 2.5 mag for a factor of ten."""
    form.scale.value = "log"
    assert form.bar.has_magnitudes
    scene.counts.set_limits((1.0, 1000.0))
    ticks = dict(form.bar.magnitude_ticks())
    # by hand: counts to flux per square arcsec, flux to AB at the pivot wavelength
    rate = (1000.0 - scene.exposure.background) / 50.0
    flux = rate / (scene.observation.channel_data.cps_per_flux * 0.036**2)
    pivot = scene.observation.channel_data.pivot
    magnitude = -2.5 * np.log10(flux * pivot**2 / 2.99792458e18) - 48.6
    assert ticks[1.0] == f"{magnitude:.1f}"
    assert form.grab().width() > 0


def test_magnitudes_are_of_the_sources_spectrum(scene, form):
    """Catches a flat spectrum's magnitudes beside sources that have another, unsaid.

    By hand: of F = (wavelength / 1500 A)^-6 the photons are
    1500^6 (a^-4 - b^-4) / 4 / ((b^2 - a^2) / 2) of those of a flat spectrum of 1 over the band
    from a to b.
    """
    low, high = 1850.0, 3200.0
    form.scale.value = "log"
    table = scene.sources
    table["spectrum"] = ["powerlaw(-6, at=1500)"] * 4
    scene.sources = table
    scene.wait()
    scene.counts.set_limits((1.0, 1000.0))
    rate = (1000.0 - scene.exposure.background) / 50.0
    photons = 1500.0**6 * (low**-4 - high**-4) / 4 / (0.5 * (high**2 - low**2))
    flux = rate / (1.14e17 * photons * 0.036**2)
    magnitude = -2.5 * np.log10(flux * 1500.0**2 / 2.99792458e18) - 48.6
    assert dict(form.bar.magnitude_ticks())[1.0] == f"{magnitude:.1f}"
    assert "powerlaw(-6, at=1500)" in form.bar.toolTip()
    assert form.units.text().endswith("AB mag/″²")
    table["spectrum"][0] = "flat"
    scene.sources = table
    scene.wait()
    scene.counts.set_limits((1.0, 1000.0))
    flux = rate / (1.14e17 * 0.036**2)
    pivot = np.sqrt(0.5 * (high**2 - low**2) / np.log(high / low))
    magnitude = -2.5 * np.log10(flux * pivot**2 / 2.99792458e18) - 48.6
    assert dict(form.bar.magnitude_ticks())[1.0] == f"{magnitude:.1f}"
    assert form.units.text().endswith("AB mag/″² *")
    assert "different ones" in form.units.toolTip()


def test_magnitudes_are_of_the_light_before_coincidence_loss(scene, form):
    """Catches surface brightnesses that a dead time makes fainter: 20 cps of 33 at 0.02 s."""
    form.scale.value = "log"
    scene.observation = SMALL.replace(detector=Detector(0.02), background=1.0)
    scene.wait()
    scene.counts.set_limits((1.0, 1000.0))
    flux = (20.0 / (1 - 20.0 * 0.02) - 1.0) / (1.14e17 * 0.036**2)
    pivot = scene.observation.channel_data.pivot
    magnitude = -2.5 * np.log10(flux * pivot**2 / 2.99792458e18) - 48.6
    assert dict(form.bar.magnitude_ticks())[1.0] == f"{magnitude:.1f}"
    scene.counts.set_limits((1.0, 3000.0))
    assert 1.0 not in dict(form.bar.magnitude_ticks())


def test_an_empty_scene(viewer):
    scene = open_scene(observation=SMALL.replace(background=0.0), viewer=viewer, dock=False)
    scene.wait()
    for scale in SCALES:
        scene.counts.scale = scale
    assert not scene.counts.layer.data.any()

"""What the live scene leaves alone: changes that render nothing, drags that redraw little.

Each test ends with a look at what came out, or with a change that does render, so that it cannot
hold because nothing happens at all.
"""

from __future__ import annotations

import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from qtpy.QtWidgets import QApplication
from small_scene import SMALL, few_sources

from napari_issis import Observation, poisson_quantile, random_sources, render, simulate
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.instrument_form import InstrumentForm
from napari_issis.plugin.picture import HeldSources, PictureMaker
from napari_issis.plugin.source_form import SourceForm
from watching import watch, watch_transforms

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")

FAINT_SKY = 0.0021
RENDERS_NOTHING = {
    "exposure": {"exposure": 777.0},
    "sky": {"background": 4 * FAINT_SKY},
    "filters": {"filters": ("NF1", "NF2")},
    "pointing": {"pointing": SkyCoord(340.1, 3.4, unit="deg")},
    "roll": {"roll": 35.0},
    "all": {"exposure": 5.0, "background": 2 * FAINT_SKY, "filters": ("open", "NF2"), "roll": 1.0},
}
RENDERS = {
    "much brighter sky": {"background": 1000 * FAINT_SKY},
    "channel": {"channel": "FUV"},
    "PSF": {"psf": None},
    "frame": {"shape": (60, 70)},
}


@pytest.fixture
def calm(scene):
    """Return a scene whose sky is in the middle of its decade."""
    scene.observation = SMALL.replace(background=FAINT_SKY)
    scene.wait()
    return scene


@pytest.fixture
def renders(monkeypatch):
    return watch(monkeypatch, render._render)


@pytest.mark.parametrize("change", RENDERS_NOTHING)
def test_a_change_of_the_set_up_renders_nothing(calm, change, renders, monkeypatch):
    transforms = watch_transforms(monkeypatch)
    calm.observation = calm.observation.replace(**RENDERS_NOTHING[change])
    calm.wait()
    assert renders == []
    assert transforms == []
    assert calm.exposure == simulate(few_sources(), calm.observation, seed=calm.seed)


@pytest.mark.parametrize("change", RENDERS)
def test_other_changes_render(calm, change, renders):
    """A rate that is kept though it is another would show here."""
    calm.observation = calm.observation.replace(**RENDERS[change])
    calm.wait()
    assert renders
    assert calm.exposure == simulate(few_sources(), calm.observation, seed=calm.seed)


def test_new_noise_renders_nothing(calm, renders):
    before = calm.exposure
    calm.new_noise()
    calm.wait()
    assert renders == []
    assert not np.array_equal(calm.exposure.counts, before.counts)
    assert np.array_equal(calm.exposure.expected, before.expected)


def test_contrast_and_brightness_draw_no_counts(calm, qtbot, renders, monkeypatch):
    """How the image is shown is the layer's affair: no render, no noise, no new picture."""
    drawn = watch(monkeypatch, poisson_quantile.poisson_quantile)
    image = calm.counts.layer
    image.contrast_limits = (0, 3)
    image.gamma = 0.5
    image.colormap = "magma"
    image.opacity = 0.7
    image.visible = False
    image.visible = True
    qtbot.wait(30)
    calm.wait()
    assert renders == []
    assert drawn == []
    calm.new_noise()
    calm.wait()
    assert drawn


def test_a_click_renders_nothing(calm, mouse, qtbot, renders):
    """A press that moves nothing, released again, leaves the table as it was."""
    mouse.press(20.25, 12.5)
    QApplication.processEvents()
    mouse.release(20.25, 12.5)
    calm.wait()
    qtbot.waitUntil(lambda: not calm._live._jobs.busy, timeout=5000)
    assert renders == []
    mouse.drag((20.25, 12.5), (30.0, 15.0))
    calm.wait()
    assert renders


def test_a_scene_without_layers_makes_no_pictures(calm, qtbot, monkeypatch):
    """Whoever deletes the three layers has stopped the simulation, until a script asks for it."""
    calm.viewer.layers.clear()
    # what was asked for before the last layer went may still be drawn
    qtbot.waitUntil(lambda: not calm._live._jobs.busy)
    qtbot.wait(50)
    drawn = watch(monkeypatch, poisson_quantile.poisson_quantile)
    calm.observation = calm.observation.replace(channel="FUV")
    qtbot.wait(50)
    assert drawn == []
    calm.wait()
    assert drawn


@pytest.fixture
def held():
    """Return a frame of stars, a maker that knows it, and the star that the mouse holds."""
    observation = Observation(shape=(512, 512))
    table = random_sources("point", 100, shape=(512, 512), seed=1)
    table["x"][7], table["y"][7] = 100.0, 200.0
    ids = np.arange(len(table))
    maker = PictureMaker()
    maker.final(table, observation, 5)

    def preview(x):
        moved = table.copy()
        moved["x"][7] = x
        return maker.preview(hold, moved, ids, observation, 5)

    hold = HeldSources(table, ids, frozenset([7]))
    preview(100.0)
    return preview


def test_a_drag_transforms_what_moves_alone(held, renders, monkeypatch):
    transforms = watch_transforms(monkeypatch)
    for x in (103.5, 107.25, 300.0):
        held(x)
    assert renders == []
    # one along each axis
    assert len(transforms) == 6
    assert max(args[0].size for args in transforms) < 512 * 512


def test_a_drag_draws_counts_only_where_light_changes(held, monkeypatch):
    drawn = watch(monkeypatch, poisson_quantile.poisson_quantile)
    before = held(102.0).exposure
    drawn.clear()
    after = held(103.5).exposure
    changed = np.count_nonzero(after.expected != before.expected)
    # the windows where the source was and where it is overlap
    assert changed <= sum(args[1].size for args in drawn) <= 2 * changed
    assert 0 < changed < 0.5 * after.counts.size
    drawn.clear()
    again = held(103.5).exposure
    assert {args[1].size for args in drawn} == {0}
    assert np.array_equal(again.counts, after.counts)


def test_a_hidden_dock_follows_nothing(calm, qtbot, monkeypatch):
    """Neither form looks at the scene until the dock is shown again."""
    shown = []
    for form, name in (
        (InstrumentForm, "show_observation"),
        (InstrumentForm, "show_warnings"),
        (SourceForm, "show_centre"),
        (SourceForm, "show_units"),
    ):
        real = getattr(form, name)

        def watched(self, event=None, real=real, name=name):
            shown.append(name)
            real(self, event)

        monkeypatch.setattr(form, name, watched)
    dock = SimulatorWidget(calm.viewer)
    qtbot.addWidget(dock)
    dock.show()
    dock.hide()
    shown.clear()
    calm.observation = calm.observation.replace(exposure=20.0, shape=(50, 60))
    calm.units.flux = "AB mag"
    calm.wait()
    assert shown == []
    dock.show()
    assert set(shown) == {"show_observation", "show_warnings", "show_centre", "show_units"}
    shown.clear()
    calm.new_noise()
    calm.wait()
    assert {"show_observation", "show_warnings"} <= set(shown)

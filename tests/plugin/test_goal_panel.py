"""The panel that solves for an exposure time: goals, sources, the plot, and what it costs."""

from __future__ import annotations

import astropy.units as u
import pytest
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest

import napari_issis as ni
from napari_issis.plugin import goal_panel
from napari_issis.plugin.goal_panel import GoalPanel
from napari_issis.plugin.trace_colors import trace_colors

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def made(monkeypatch):
    """Observations of which information was summed."""
    calls, real = [], goal_panel.covariance
    monkeypatch.setattr(
        goal_panel, "covariance", lambda sources, where: calls.append(where) or real(sources, where)
    )
    return calls


@pytest.fixture
def panel(scene, qtbot, made):
    widget = GoalPanel(scene.viewer)
    qtbot.addWidget(widget)
    widget.resize(360, 420)
    widget.show()
    qtbot.waitExposed(widget)
    ready(widget, qtbot)
    yield widget
    widget.hide()
    qtbot.waitUntil(lambda: not widget.forecast._jobs.busy, timeout=60_000)


def ready(panel, qtbot):
    qtbot.waitUntil(lambda: not panel.forecast.pending, timeout=60_000)


def choose(panel, name, target):
    panel.kind.setCurrentIndex(panel.kind.findData(name))
    panel.target.native.selectAll()
    QTest.keyClicks(panel.target.native, target)
    QTest.keyClick(panel.target.native, Qt.Key.Key_Return)


@pytest.mark.parametrize(
    ("name", "target", "rows", "goal"),
    [
        ("snr", "35", [1], {"snr": 35}),
        ("snr", "20", [], {"snr": 20}),
        ("flux_ratio", "0.5", [0, 3], {"flux_ratio": 0.005}),
        ("position", "2", [0, 1], {"position": 2 * u.mas}),
    ],
)
def test_time_for_a_goal(scene, panel, qtbot, made, name, target, rows, goal):
    """Catches shares for per cent, arcsec for mas, other rows, and the best for the worst."""
    scene.editor.select(scene.editor.source_id[rows].tolist())
    choose(panel, name, target)
    wanted = ni.exposure_for(
        scene.sources, scene.observation, rows=rows or range(4), **goal
    ).to_value(u.s)
    assert panel.seconds == pytest.approx(wanted, rel=1e-5)
    assert f"{wanted:.4g} s" in panel.answer.text()
    assert panel.plot.curve.solved == pytest.approx(wanted, rel=1e-9)
    QTest.keyClick(panel.button, Qt.Key.Key_Space)
    assert scene.observation.exposure == panel.seconds
    ready(panel, qtbot)
    if name == "snr":
        snr = ni.forecast(scene.sources, scene.observation)["snr"]
        assert min(snr[rows or slice(None)]) == pytest.approx(float(target), rel=1e-5)
        assert f"now {panel.seconds:.6g} s: {target}" in panel.answer.text()
    # neither goals nor selections nor exposure times ask for anything new
    assert len(made) == 1


def test_goals_that_cannot_be_reached_say_why(scene, panel, qtbot):
    """Catches a time that is made up, an old one that can still be used, and a crash."""
    scene.editor.select(scene.editor.source_id[[2]].tolist())
    choose(panel, "flux_ratio", "1")
    assert "takes two different rows" in panel.answer.text()
    assert not panel.button.isEnabled()
    assert panel.plot.curve is None
    choose(panel, "snr", "-3")
    assert "must be above 0" in panel.answer.text()
    scene.add(ni.source("point", 500.0, 500.0))
    scene.editor.select(scene.editor.source_id[[4]].tolist())
    choose(panel, "snr", "3")
    ready(panel, qtbot)
    assert "row 4 cannot be measured" in panel.answer.text()
    panel.use()
    assert scene.observation.exposure == 50.0
    scene.sources = scene.sources[:0]
    ready(panel, qtbot)
    assert panel.chosen.text() == "no source"


def test_count_rate_limits_and_full_memory(scene, panel, qtbot):
    """Catches a time for what the detector cannot count, and a mark at the wrong time."""
    assert panel.warning.isVisible()
    assert "No exposure time cures that" in panel.warning.text()
    expected = scene.exposure.expected.max() / scene.observation.exposure
    assert panel.plot.curve.full == pytest.approx(65536 / expected, rel=1e-6)
    scene.observation = scene.observation.replace(filters=("NF2", "NF1"))
    ready(panel, qtbot)
    assert not panel.warning.isVisible()


def test_hidden_it_costs_nothing(scene, panel, qtbot, made):
    """Catches a closed panel that goes on computing."""
    panel.hide()
    scene.add(ni.source("point", 3, 3))
    scene.wait()
    QTest.qWait(500)
    assert len(made) == 1
    panel.show()
    ready(panel, qtbot)
    assert len(made) == 2


def test_the_plot_shows_curve_goal_and_present_time(panel):
    """Catches marks that do not lie on the curve."""
    curve = panel.plot.curve
    low, high = (10.0**power for power in curve.decades)
    assert low < min(curve.solved, curve.now)
    assert high > max(curve.solved, curve.now)
    assert curve.value(curve.solved) == pytest.approx(curve.goal)
    image = panel.plot.grab().toImage()
    shown = {
        image.pixelColor(x, y).name() for x in range(image.width()) for y in range(image.height())
    }
    colors = trace_colors(panel.scene.viewer.theme)
    assert {colors.counts.name(), colors.expected.name(), colors.text.name()} <= shown

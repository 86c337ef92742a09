"""What is read beside the pointer and in the status line."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import SkyCoord
from qtpy.QtCore import Qt
from qtpy.QtTest import QTest
from qtpy.QtWidgets import QApplication, QToolTip
from small_scene import SMALL, few_sources

from napari_issis.plugin.canvas_geometry import find_canvas
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.readout import pixel_text, sky_offset, source_text
from napari_issis.plugin.units import Units

pytestmark = pytest.mark.filterwarnings("ignore::napari_issis.CountRateWarning")


@pytest.fixture
def over(scene):
    """Puts the pointer over a pixel."""

    def put(x, y):
        scene.viewer.mouse_over_canvas = True
        scene.viewer.cursor.position = (y * 0.036, x * 0.036)
        scene.pointer.describe()
        return scene.pointer.shown

    return put


def test_a_star_and_a_galaxy(scene, over, qtbot):
    """Catches values of a neighbour, exchanged columns, structure told of a star."""
    text = over(60.0, 50.0)
    assert text.splitlines()[:3] == ["point", "x 60.00   y 50.00", "F 2e-15 erg/s/cm²/Å"]
    # 2e-15 x 1.14e17 x 50
    assert text.splitlines()[3].startswith("1.14e+04 counts   S/N 107")
    text = over(62.0, 20.5)
    assert text.splitlines()[:6] == [
        "sersic",
        "x 61.50   y 20.25",
        "F 5e-15 erg/s/cm²/Å",
        "R½ 5 px",
        "ε 0.2   PA 100.0°",
        "n 2.5",
    ]
    assert over(5.0, 5.0) == ""


def test_the_chosen_units(scene, over):
    """Catches labels that do not follow the numbers."""
    scene.units.flux, scene.units.length = "AB mag", "arcsec"
    text = over(40.0, 30.0)
    # -2.5 log10(1e-14 lambda^2 / c) - 48.6 at the pivot wavelength of the NUV channel
    pivot = scene.observation.channel_data.pivot
    magnitude = -2.5 * np.log10(1e-14 * pivot**2 / 2.99792458e18) - 48.6
    assert f"F {magnitude:.2f} AB mag" in text
    assert "R½ 0.216 ″" in text


def test_nothing_is_told_in_a_drag_or_of_hidden_layers(scene, over, mouse):
    """Catches a tooltip that hangs on while the source is dragged away from it."""
    assert over(60.0, 50.0)
    mouse.press(60.0, 50.0)
    assert scene.pointer.shown == ""
    mouse.move(61.0, 50.0)
    assert over(61.0, 50.0) == ""
    mouse.release(61.0, 50.0)
    scene.editor.points.layer.visible = False
    assert over(61.0, 50.0) == ""


@pytest.mark.needs_gl
def test_moving_the_pointer_shows_the_tooltip(scene, over, qtbot):
    """Catches a pointer that nobody listens to."""
    scene.viewer.mouse_over_canvas = True
    scene.viewer.cursor.position = (50.0 * 0.036, 60.0 * 0.036)
    qtbot.waitUntil(lambda: QToolTip.text().startswith("point"), timeout=2000)
    scene.viewer.cursor.position = (5.0 * 0.036, 5.0 * 0.036)
    qtbot.waitUntil(lambda: scene.pointer.shown == "", timeout=2000)


@pytest.mark.needs_gl
def test_fingers_and_pens_are_left_to_qt(make_napari_viewer, qtbot):
    """Catches a canvas that takes touch events: Qt makes mouse events of those left to it."""
    viewer = make_napari_viewer(show=True)
    panel = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(panel)
    # what is done when it has come to the screen counts too
    qtbot.waitUntil(panel.isVisible)
    QTest.qWait(200)
    canvas = find_canvas(panel)
    assert canvas is not None
    while canvas is not None:
        assert not canvas.testAttribute(Qt.WidgetAttribute.WA_AcceptTouchEvents)
        canvas = canvas.parentWidget()
    for attribute in ("Touch", "Tablet"):
        name = f"AA_SynthesizeMouseForUnhandled{attribute}Events"
        assert QApplication.testAttribute(getattr(Qt.ApplicationAttribute, name))


@pytest.mark.needs_gl
def test_fingers_and_pens_drag_as_the_mouse_does(tmp_path):
    """Catches a canvas that takes what fingers do, a drag lost on the way, or two steps for one."""
    script = Path(__file__).with_name("fingers.py")
    environment = {**os.environ, "NAPARI_CONFIG": "", "HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", str(script)],
        capture_output=True, text=True, timeout=300, env=environment, cwd=tmp_path,
    )  # fmt: skip
    if "No module named 'PyQt6'" in done.stderr or done.stdout == "skip\n":
        pytest.skip("this Qt has no functions that take touches")
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    # napari's canvas and Qt's mouse events have whole pixels of the screen
    for (x, y, step, same), wanted in zip(lines, 2 * [(30, 20), (46, 40)], strict=True):
        assert float(x) == pytest.approx(wanted[0], abs=0.2)
        assert float(y) == pytest.approx(wanted[1], abs=0.2)
        assert (step, same) == ("move-1-source", "True")


def test_the_status_line(scene):
    """Catches x and y exchanged, counts per second for counts, a wrong background in the SNR."""
    scene.observation = SMALL.replace(background=0.5)
    scene.wait()
    scene.viewer.cursor.position = (50.0 * 0.036, 61.0 * 0.036)
    scene.viewer.status = "what napari has to say"
    counts = scene.exposure.counts[50, 61]
    background = 50 * 0.5
    snr = (counts - background) / np.sqrt(counts)
    assert scene.viewer.status == (
        f"x 61  y 50   E -0.77″  N +0.67″   C {counts}   {counts / 50:.4g} cps   SNR {snr:.2f}"
    )


def test_the_status_line_follows_the_picture(scene, qtbot):
    """Catches counts of the picture before, told of a pixel of the new one."""
    scene.viewer.cursor.position = (50.0 * 0.036, 60.0 * 0.036)
    scene.viewer.status = "what napari has to say"
    assert scene.exposure.counts[50, 60] > 100
    scene.remove(scene.editor.source_id.tolist())
    scene.wait()
    counts = scene.exposure.counts[50, 60]
    assert counts < 100
    qtbot.waitUntil(lambda: f"   C {counts}   " in scene.viewer.status, timeout=2000)
    scene.viewer.layers.selection.active = scene.viewer.add_points(np.zeros((1, 2)))
    scene.viewer.status = "his"
    scene.undo()
    scene.wait()
    qtbot.wait(150)
    assert scene.viewer.status == "his"


def test_the_status_line_of_others(scene):
    """Catches a status line that is ours while the user works on his own layer."""
    scene.viewer.add_points(np.zeros((1, 2)))
    scene.viewer.cursor.position = (1.0, 1.0)
    scene.viewer.status = "his"
    assert scene.viewer.status == "his"
    scene.viewer.layers.selection.active = scene.counts.layer
    scene.viewer.cursor.position = (-1.0, 1.0)
    scene.viewer.status = "beside the frame"
    assert scene.viewer.status == "beside the frame"


def test_no_count_has_no_noise(scene):
    exposure = scene.exposure
    exposure.counts[:] = 0
    assert pixel_text(exposure, 3, 3).endswith("C 0   0 cps   SNR 0.00")


@pytest.mark.parametrize("roll", [0.0, 35.0, 200.0])
def test_offsets_and_positions_against_the_sky(roll):
    """Catches the sense of the roll and of east: astropy's own offsets on the sphere."""
    from napari_issis import simulate

    pointing = SkyCoord("20h13m15s -60d30m10s")
    observation = SMALL.replace(pointing=pointing, roll=roll)
    x, y = 70.0, 8.0
    exposure = simulate(few_sources(), observation)
    words = pixel_text(exposure, x, y).split("   ")
    shown = SkyCoord(*words[2].split(), unit=("hourangle", "deg"))
    # a step along +y lies at position angle roll, one along +x at roll - 90 (east is left)
    up = (y - 31.5) * 0.036 * u.arcsec
    right = (x - 39.5) * 0.036 * u.arcsec
    truth = pointing.directional_offset_by(roll * u.deg, up)
    truth = truth.directional_offset_by((roll - 90) * u.deg, right)
    assert shown.separation(truth) < 0.01 * u.arcsec
    east, north = (offset.to_value("arcsec") for offset in pointing.spherical_offsets_to(truth))
    assert sky_offset(observation, x, y) == pytest.approx((east, north), abs=1e-4)


def test_every_kind_can_be_described():
    for row in few_sources():
        assert "counts" in source_text(row, SMALL, Units())

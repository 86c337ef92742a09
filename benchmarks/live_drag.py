"""How many pictures a second follow a dragged star: from the mouse event to the layer's new array.

Run it by ``xvfb-run -s "-screen 0 1366x768x24" python benchmarks/live_drag.py``. Without a
canvas nothing is drawn; in a window napari draws as well. ``ours`` is the time of the worker
thread's previews alone, ``longest`` the longest that our own code held the GUI thread.
"""

from __future__ import annotations

import os
import warnings
from time import perf_counter, sleep
from types import SimpleNamespace
from typing import Any

os.environ["NAPARI_CONFIG"] = ""

import napari
import numpy as np
from astropy.table import vstack
from napari.components import ViewerModel
from napari.utils.interactions import (
    mouse_move_callbacks,
    mouse_press_callbacks,
    mouse_release_callbacks,
)
from qtpy.QtWidgets import QApplication

import napari_issis as ni
from napari_issis.plugin.picture import PictureMaker
from napari_issis.plugin.scene import Scene, open_scene

MOVES = 60
SCALE = 0.036


def main() -> None:
    """Print a table of pictures a second."""
    warnings.simplefilter("ignore")
    application = QApplication.instance() or QApplication([])
    assert application is not None
    print("| frame | sources | canvas | pictures/s | median ms | worst ms | ours ms | longest ms |")
    print("|---|---|---|---|---|---|---|---|")
    for side, stars, galaxies in ((512, 450, 50), (2048, 10_000, 0)):
        table = ni.random_sources("point", stars, shape=(side, side), seed=1)
        if galaxies:
            more = ni.random_sources("exponential", galaxies, shape=(side, side), seed=2)
            table = vstack([table, more])
        for window in (False, True):
            measure(side, table, window)


def measure(side: int, table: Any, window: bool) -> None:
    """Drag the first star to and fro and print a line of the table."""
    viewer: Any = napari.Viewer(show=True) if window else ViewerModel()
    scene = open_scene(table, ni.Observation(shape=(side, side)), viewer=viewer, dock=False)
    scene.wait(120)
    previews, held = watch(scene)
    x, y = float(table["x"][0]), float(table["y"][0])
    send(viewer, mouse_press_callbacks, "mouse_press", x, y)
    times = []
    for move in range(MOVES):
        shown = scene.picture
        start = perf_counter()
        step = 10 * np.sin(move / 5)
        send(viewer, mouse_move_callbacks, "mouse_move", x + step, y + move / 10)
        while scene.picture is shown and perf_counter() - start < 1:
            QApplication.processEvents()
            # let go of the interpreter, as Qt's own loop does while it waits
            sleep(2e-4)
        times.append(perf_counter() - start)
    send(viewer, mouse_release_callbacks, "mouse_release", x, y)
    scene.wait(120)
    ms = 1e3 * np.array(times[5:])
    print(
        f"| {side} | {len(table)} | {'window' if window else 'none'} | {1e3 / ms.mean():.0f} "
        f"| {np.median(ms):.1f} | {ms.max():.1f} | {1e3 * np.median(previews):.1f} "
        f"| {1e3 * max(held):.1f} |",
        flush=True,
    )
    viewer.layers.clear()
    if window:
        viewer.close()


def watch(scene: Scene) -> tuple[list[float], list[float]]:
    """Note the times of previews in the worker, and of our look at the layers."""
    previews: list[float] = []
    held: list[float] = [0.0]
    preview, take_over = PictureMaker.preview, scene.editor.take_over

    def timed_preview(*args: Any) -> Any:
        start = perf_counter()
        result = preview(scene._live._maker, *args)
        previews.append(perf_counter() - start)
        return result

    def timed_take_over() -> None:
        start = perf_counter()
        take_over()
        held.append(perf_counter() - start)

    setattr(scene._live._maker, "preview", timed_preview)  # noqa: B010
    setattr(scene.editor, "take_over", timed_take_over)  # noqa: B010
    return previews, held


class Wrapped:
    """An event in which napari puts each later one of the same drag."""

    def __init__(self, **values: Any) -> None:
        self.__wrapped__ = SimpleNamespace(**values)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__wrapped__, name)


def send(viewer: Any, run: Any, kind: str, x: float, y: float) -> None:
    """Hand an event to the viewer and its active layer, as napari's canvas does."""
    position = (y * SCALE, x * SCALE)
    event = Wrapped(
        type=kind,
        position=position,
        pos=np.array([x, y]),
        modifiers=(),
        is_dragging=kind == "mouse_move",
        dims_displayed=[0, 1],
        dims_point=[0, 0],
        view_direction=None,
        up_direction=None,
        button=1,
        handled=False,
    )
    viewer.cursor.position = position
    if isinstance(viewer, ViewerModel) and not isinstance(viewer, napari.Viewer):
        for layer in viewer.layers:
            layer.scale_factor = SCALE / 4
    run(viewer, event)
    run(viewer.layers.selection.active, event)


if __name__ == "__main__":
    main()

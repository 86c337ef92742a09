"""How long our own code holds the GUI thread at a time, for each thing that a user does.

Run it by ``xvfb-run -s "-screen 0 1366x768x24" python benchmarks/gui_thread.py``, with the
frame's side, the number of sources and names of actions behind it if you like.
For each action: the longest that one event or one call spent in our plugin and in what it calls,
less what napari and vispy do in between; in milliseconds of the thread's own time. The profiler
that tells these apart makes Python code about a half slower.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from time import perf_counter, sleep, thread_time
from types import CodeType, FrameType
from typing import Any

os.environ["NAPARI_CONFIG"] = ""

import napari
import numpy as np
from qtpy.QtCore import Qt
from qtpy.QtWidgets import QApplication

import napari_issis as ni
from live_drag import mouse_move_callbacks, mouse_press_callbacks, mouse_release_callbacks, send
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import Scene, open_scene
from napari_issis.plugin.source_list import SourceList
from napari_issis.plugin.trace_docks import show_traces

# what the parts of a file's path say of whose code it is
OURS, THEIRS = f"napari_issis{os.sep}", ("site-packages/napari/", "/vispy/", "/qtpy/", "/psygnal/")


class Clock:
    """Measures the time that our code takes in this thread."""

    def __init__(self) -> None:
        self._whose: dict[CodeType, bool | None] = {}
        self._stack: list[bool] = []
        self._since = self._spent = self._longest = 0.0

    def _look(self, code: CodeType) -> bool | None:
        path = code.co_filename
        if OURS in path:
            return True
        return False if any(part in path for part in THEIRS) else None

    def __call__(self, frame: FrameType, event: str, _: Any) -> None:
        """Follow the calls, as `sys.setprofile` tells of them."""
        if event == "call":
            code = frame.f_code
            if code not in self._whose:
                self._whose[code] = self._look(code)
            before = bool(self._stack and self._stack[-1])
            known = self._whose[code]
            self._stack.append(before if known is None else known)
            self._turn(before, self._stack[-1])
        elif event == "return" and self._stack:
            was = self._stack.pop()
            self._turn(was, bool(self._stack and self._stack[-1]))
            if not self._stack:
                self._longest = max(self._longest, self._spent)
                self._spent = 0.0

    def _turn(self, before: bool, now: bool) -> None:
        if now and not before:
            self._since = thread_time()
        elif before and not now:
            self._spent += thread_time() - self._since

    def measure(self, action: Callable[[], Any]) -> float:
        """Return the longest that our code took in one call from outside, ms."""
        self._stack, self._spent, self._longest = [], 0.0, 0.0
        sys.setprofile(self)
        try:
            action()
        finally:
            sys.setprofile(None)
        return 1e3 * self._longest


def main() -> None:
    """Print a table of actions and times."""
    warnings.simplefilter("ignore")
    application = QApplication.instance() or QApplication([])
    side, count = (int(v) for v in (sys.argv[1:3] or ("2048", "10000")))
    wanted = sys.argv[3:]
    table = ni.random_sources("point", count, shape=(side, side), seed=1)
    viewer = napari.Viewer()
    viewer.window.resize(1366, 740)
    scene = open_scene(table, ni.Observation(shape=(side, side)), viewer=viewer, dock=False)
    viewer.window.add_dock_widget(SimulatorWidget(viewer))
    listed = SourceList(viewer)
    viewer.window.add_dock_widget(listed, area="bottom")
    show_traces(viewer)
    settle(scene)
    clock = Clock()
    print(f"| action ({side} x {side}, {count} sources) | longest ms |\n|---|---|")
    for name, steps in actions(scene, listed).items():
        if wanted and name not in wanted:
            continue
        longest = 0.0
        for step in steps():
            longest = max(longest, clock.measure(step))
            start = perf_counter()
            while perf_counter() - start < 0.3 or not (scene.settled or scene.editor.held):
                longest = max(longest, clock.measure(application.processEvents))
                sleep(1e-3)
        print(f"| {name} | {longest:.1f} |", flush=True)
        settle(scene)
    viewer.layers.clear()
    viewer.close()


def settle(scene: Scene) -> None:
    """Wait until all that follows an action has been done."""
    until = perf_counter() + 1.0
    while perf_counter() < until:
        QApplication.processEvents()
        sleep(1e-3)
    scene.wait(120)


def actions(scene: Scene, listed: SourceList) -> dict[str, Callable[[], Any]]:
    """Return what is done, step by step; each step is followed by its consequences."""
    viewer = scene.viewer
    x, y = float(scene.sources["x"][0]), float(scene.sources["y"][0])

    def press() -> Any:
        yield lambda: send(viewer, mouse_press_callbacks, "mouse_press", x, y)

    def drag() -> Any:
        for move in range(12):
            step = 10 * np.sin(move / 5)
            yield lambda step=step: send(
                viewer, mouse_move_callbacks, "mouse_move", x + step, y + step
            )

    def release() -> Any:
        yield lambda: send(viewer, mouse_release_callbacks, "mouse_release", x, y)

    def hover() -> Any:
        for row in range(5):
            place = scene.sources["y"][row] * 0.036, scene.sources["x"][row] * 0.036
            yield lambda place=place: setattr(viewer.cursor, "position", place)

    def one(action: Callable[[], Any]) -> Callable[[], Any]:
        return lambda: [action]

    def several(*steps: Callable[[], Any]) -> Callable[[], Any]:
        return lambda: steps

    cell = listed.model.index(5, 3)
    descending = Qt.SortOrder.DescendingOrder
    return {
        "press": press,
        "drag": drag,
        "release": release,
        "hover": hover,
        "add a source": one(lambda: scene.add(ni.source("point", 9.0, 9.0))),
        "undo, redo": several(scene.undo, scene.redo),
        "select all in the list": one(listed.view.selectAll),
        "select none": one(listed.view.clearSelection),
        "sort the list": one(lambda: listed.view.sortByColumn(3, descending)),
        "edit a cell": one(lambda: listed.model.setData(cell, "3e-15")),
        "exposure": one(lambda: change(scene, exposure=50.0)),
        "new noise": one(scene.new_noise),
        "neutral filter": one(lambda: change(scene, filters=("NF1", "open"))),
        "logarithmic scale": one(lambda: setattr(scene.counts, "scale", "log")),
        "expected image": several(
            lambda: setattr(scene.counts, "shows", "expected"),
            lambda: setattr(scene.counts, "shows", "counts"),
        ),
        "remove half": one(lambda: scene.remove(scene.editor.source_id[::2].tolist())),
    }


def change(scene: Scene, **values: Any) -> None:
    """Change the instrument."""
    scene.observation = scene.observation.replace(**values)


if __name__ == "__main__":
    main()

"""What the traces cost the GUI thread: each update of titles and plots, and moving the pointer.

Run it by ``xvfb-run -s "-screen 0 1400x1000x24" python benchmarks/trace_cost.py``.
"""

import os
from time import thread_time

# napari as it comes, not as somebody has set it up
os.environ["NAPARI_CONFIG"] = ""

import napari
import numpy as np
from qtpy.QtWidgets import QApplication

import napari_issis as ni
from napari_issis.plugin.brightness import SCALES
from napari_issis.plugin.trace_docks import show_traces, trace_widgets

REPEATS = 40


def main() -> None:
    """Print milliseconds of processor time, median and worst."""
    for side in (512, 2048):
        viewer = napari.Viewer(show=True)
        viewer.window.resize(1366, 738)
        scene = ni.show(
            ni.random_sources("point", 300, shape=(side, side), seed=1),
            ni.Observation(shape=(side, side), exposure=1000),
            viewer=viewer,
        )
        scene.wait(120)
        show_traces(viewer)
        settle()
        widgets = trace_widgets(viewer)
        traces = widgets[0].traces
        for scale in SCALES:
            scene.counts.scale = scale
            settle()
            times = []
            for number in range(REPEATS):
                start = thread_time()
                traces.pixel = (side // 3 + number, side // 2 + number)
                for widget in widgets:
                    widget.plot.grab()
                times.append(thread_time() - start)
            report(f"{side} px, {scale}: titles and both plots", times)
        settle()
        layer = scene.counts.layer
        assert layer is not None
        times = []
        for number in range(REPEATS):
            place = layer.data_to_world((side // 4 + number, side // 4))
            start = thread_time()
            viewer.cursor.position = place
            times.append(thread_time() - start)
        report(f"{side} px: the pointer moves; the plots follow later", times)
        show_traces(viewer, False)
        settle()
        times = []
        for number in range(REPEATS):
            place = layer.data_to_world((side // 5 + number, side // 4))
            start = thread_time()
            viewer.cursor.position = place
            times.append(thread_time() - start)
        report(f"{side} px: the same with the traces hidden", times)
        viewer.close()


def settle() -> None:
    """Let Qt draw what is pending."""
    for _ in range(30):
        QApplication.processEvents()


def report(name: str, seconds: list[float]) -> None:
    """Print one line."""
    milliseconds = 1e3 * np.array(seconds)
    print(f"{name:55s} {np.median(milliseconds):6.2f}  worst {milliseconds.max():6.2f} ms")


if __name__ == "__main__":
    main()

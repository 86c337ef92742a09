"""Make the pictures of the README.

Run it by ``xvfb-run -s "-screen 0 1366x768x24" python docs/make_pictures.py``.
"""

import os
import tempfile
import warnings
from pathlib import Path
from time import sleep

# the pictures show napari as it comes, not as somebody has set it up
os.environ["NAPARI_CONFIG"] = str(Path(tempfile.mkdtemp()) / "settings.yaml")

import napari
from qtpy.QtWidgets import QApplication

import napari_issis as ni
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.scenes import example_scene

PICTURES = Path(__file__).parent / "pictures"


def settle() -> None:
    """Let Qt draw what is pending."""
    for _ in range(30):
        QApplication.processEvents()


def show_off(name: str, panel: SimulatorWidget) -> None:
    """Set the view so that a picture shows what there is."""
    view, display = panel.view, panel.display
    if name == "blend":
        # as in the paper: zoom 4x and log(C)
        panel.pages.setCurrentIndex(1)
        display.scale.value = "log"
        view.zoom.to(4)
    elif name == "stars500":
        panel.pages.setCurrentIndex(1)
        view.frames.enabled = True
    elif name == "galaxies100":
        panel.toggle_list()
    else:
        view.trace.value = view.compass.value = view.scale_bar.value = True
        panel.pages.setCurrentIndex(1)


def main() -> None:
    """Write one screenshot of the window for each built-in scene."""
    warnings.simplefilter("ignore", ni.CountRateWarning)
    PICTURES.mkdir(exist_ok=True)
    for name in ("blend", "stars500", "galaxies100", "q2237"):
        example = example_scene(name)
        viewer = napari.Viewer(show=False)
        scene = ni.show(example.sources, example.observation, viewer=viewer)
        viewer.window.show()
        viewer.window.resize(1366, 768)
        scene.wait(60)
        settle()
        viewer.reset_view()
        (panel,) = viewer.window._qt_window.findChildren(SimulatorWidget)
        show_off(name, panel)
        for _ in range(20):
            settle()
            sleep(0.05)
        viewer.screenshot(PICTURES / f"{name}.png", canvas_only=False, flash=False)
        viewer.close()


if __name__ == "__main__":
    main()

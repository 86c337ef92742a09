"""Make the pictures of `examples.md`: the paper's examples, by the controls of the panel.

Run it by ``xvfb-run -s "-screen 0 1366x768x24" python docs/make_example_pictures.py``.
"""

import warnings
from time import sleep

from make_pictures import PICTURES, settle  # first: it sets napari's settings aside

# isort: split
import napari

import napari_issis as ni
from napari_issis.plugin.dock import SimulatorWidget


class Window:
    """A window with an empty frame of 512 x 512 pixels, as each example starts."""

    def __init__(self) -> None:
        self.viewer = napari.Viewer(show=False)
        self.scene = ni.show(viewer=self.viewer)
        self.viewer.window.show()
        self.viewer.window.resize(1366, 768)
        self.scene.wait()
        (self.panel,) = self.viewer.window._qt_window.findChildren(SimulatorWidget)
        self.form, self.display = self.panel.sources, self.panel.display

    def add(self) -> None:
        """Click "Add source(s)"."""
        self.form.button.native.click()

    def save(self, name: str) -> None:
        """Save a picture of the window."""
        self.scene.wait()
        for _ in range(15):
            settle()
            sleep(0.05)
        self.viewer.screenshot(PICTURES / f"{name}.png", canvas_only=False, flash=False)


def blended_galaxies() -> None:
    """Two galaxies that are blended together."""
    window = Window()
    window.form.ellipticity.native.setText("0.7")
    window.add()
    window.save("example1-first")
    window.form.pa.native.setText("135")
    window.add()
    window.panel.pages.setCurrentIndex(1)
    window.panel.view.zoom.to(4)
    window.display.scale.value = "log"
    window.save("example1-log")
    window.display.scale.value = "sqrt"
    window.scene.observation = window.scene.observation.replace(exposure=10)
    window.save("example1-10s")
    window.viewer.close()


def random_stars() -> None:
    """500 random stars."""
    window = Window()
    window.form.kind.value = "point"
    window.form.mode.value = "random"
    window.form.number.number = 100
    for _ in range(5):
        window.add()
    window.save("example2")
    window.viewer.close()


def random_galaxies() -> None:
    """100 random galaxies."""
    window = Window()
    window.form.mode.value = "random"
    window.form.number.number = 100
    window.add()
    window.panel.toggle_list()
    window.save("example3")
    window.viewer.close()


if __name__ == "__main__":
    warnings.simplefilter("ignore", ni.CountRateWarning)
    PICTURES.mkdir(exist_ok=True)
    blended_galaxies()
    random_stars()
    random_galaxies()

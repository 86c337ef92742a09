"""Pictures as PNG files: the final image as it is shown, the source model, RGBA data."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from napari.utils.notifications import show_error, show_info
from numpy.typing import NDArray
from qtpy.QtWidgets import QFileDialog, QMenu, QWidget

from ..png import write_png, write_side_by_side_png, write_source_png
from ..rgba import write_rgba
from .brightness import SCALES, stretched
from .scene import Scene

# Side in PNG pixels from which a picture is not magnified any more.
LARGE = 512


class PngMenu(QMenu):  # type: ignore[misc]
    """A menu of what can be saved as a PNG file.

    Parameters
    ----------
    scene : Scene
        The live scene.
    parent : QWidget
        The widget over which the file dialog opens.
    """

    def __init__(self, scene: Scene, parent: QWidget) -> None:
        super().__init__(parent)
        self.scene = scene
        self.setToolTipsVisible(True)
        for text, name, tooltip, write in (
            (
                "Final &image…",
                "image.png",
                "In the brightness scale, limits and colours that are shown",
                self.write_image,
            ),
            (
                "Source &model…",
                "sources.png",
                "Stars, and ellipses that hold half of the light",
                self.write_model,
            ),
            (
                "&Both side by side…",
                "both.png",
                "The source model at the left, the final image as it is shown at the right",
                self.write_both,
            ),
            (
                "&RGBA data…",
                "counts.png",
                "Counts in the colours: C = R + 256 G + 65536 B",
                self.write_data,
            ),
        ):
            action = self.addAction(text)
            action.setToolTip(tooltip)
            action.triggered.connect(
                lambda _=False, name=name, write=write: self._save(name, write)
            )

    def write_image(self, path: str) -> None:
        """Write the final image as it is shown, one pixel a PNG pixel, small ones magnified."""
        level, look = self._as_shown()
        write_png(path, level, **look)

    def write_both(self, path: str) -> None:
        """Write the source model and, at its right, the final image as it is shown."""
        level, look = self._as_shown()
        step = self.scene.observation.pixel_scale
        write_side_by_side_png(path, self.scene.sources, level, **look, pixel_scale=step)

    def _as_shown(self) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Return the levels of the final image on the screen, and how they are written."""
        counts, exposure = self.scene.counts, self.scene.exposure
        layer = counts.layer
        if layer is None:
            raise ValueError("the layer of the final image was deleted; restore it in the panel.")
        scale, limits = counts.effective_scale, counts.limits
        level = stretched(scale, layer.data, limits, exposure.background)
        colors = (255 * counts.base_colormap.map(np.arange(256) / 255)[:, :3]).round()
        return level, {
            "limits": (0.0, 1.0),
            "colormap": colors.astype(np.uint8),
            "zoom": self._zoom,
            "words": {
                "Image": counts.shows,
                "Scale": SCALES[scale],
                "Limits": f"{limits[0]:g} {limits[1]:g}",
                "Colormap": counts.base_colormap.name,
            },
            "overwrite": True,
        }

    def write_model(self, path: str) -> None:
        """Draw the sources, magnified as the final image is."""
        scene = self.scene
        observation = scene.observation
        write_source_png(
            path,
            scene.sources,
            observation.shape,
            zoom=self._zoom,
            overwrite=True,
            pixel_scale=observation.pixel_scale,
        )

    def write_data(self, path: str) -> None:
        """Write the counts as RGBA data."""
        write_rgba(path, self.scene.exposure.counts, overwrite=True)

    @property
    def _zoom(self) -> int:
        return max(LARGE // max(self.scene.observation.shape), 1)

    def _save(self, name: str, write: Any) -> None:
        path = self.ask_path(name)
        if path is None:
            return
        try:
            write(path)
        except (OSError, ValueError, RuntimeError) as error:
            show_error(str(error))
        else:
            show_info(f"Saved {path}")

    def ask_path(self, name: str) -> str | None:
        """Ask for the file to write, and before one that exists is replaced."""
        dialog = QFileDialog(self.parentWidget(), "Save picture", name, "PNG (*.png)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("png")
        return os.fspath(dialog.selectedFiles()[0]) if dialog.exec() else None

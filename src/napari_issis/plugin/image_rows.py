"""The rows of a form that choose an image as a source."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from magicgui.widgets import CheckBox, LineEdit, PushButton
from napari.utils.notifications import show_error, show_info
from qtpy.QtWidgets import QFileDialog

from ..fits_image import read_image
from ..fits_pixel_scale import stated_pixel_scale
from ..psf import positive
from .form import Form
from .number_field import NumberField

PLAIN_SCALE = 0.04


class ImageRows:
    """File of an image, its pixel scale and whether it is mirrored, in rows of a form.

    Parameters
    ----------
    form : Form
        The rows are added to it.
    """

    def __init__(self, form: Form) -> None:
        self._form = form
        self.path = LineEdit(
            tooltip="FITS file whose first image is the source's light, sky subtracted; it is "
            "scaled to the flux, and the blur that it has stays in it"
        )
        self.choose = PushButton(text="Choose…", tooltip="Choose the FITS file of the image")
        self.pixel_scale = NumberField(
            "pixel scale",
            PLAIN_SCALE,
            "Spacing of the image's samples, arcsec; taken from the file where it says so",
            lambda scale: positive("pixel_scale", scale, "arcsec per pixel"),
        )
        self.mirrored = CheckBox(
            text="mirrored", tooltip="Exchange left and right: for an image with east on the right"
        )
        self._rows = (
            form.add("Image", self.path, self.choose),
            form.add("Pixel (″)", self.pixel_scale, self.mirrored),
        )
        self.choose.changed.connect(self._ask)
        self.path.native.editingFinished.connect(self._show_scale)

    def show(self, applies: bool) -> None:
        """Show the rows, or hide them where they do not apply."""
        for row in self._rows:
            self._form.show_row(row, applies)

    def options(self) -> dict[str, Any]:
        """Return arguments of `image_source`.

        Raises
        ------
        ValueError
            If no file is chosen or the scale is no valid number.
        """
        if not self.path.value.strip():
            raise ValueError("no image is chosen; give its FITS file.")
        return {
            "image": Path(self.path.value.strip()),
            "pixel_scale": self.pixel_scale.number,
            "mirrored": self.mirrored.value,
        }

    def ask_path(self) -> str | None:
        """Ask for the file; None if the user changed his mind."""
        path, _ = QFileDialog.getOpenFileName(
            self._form, "Image as a source", "", "FITS (*.fits *.fit *.fts *.gz);;All files (*)"
        )
        return path or None

    def _ask(self, event: Any = None) -> None:
        path = self.ask_path()
        if path is not None:
            self.path.value = path
            self._show_scale()

    def _show_scale(self) -> None:
        """Show the pixel scale that the file states."""
        path = self.path.value.strip()
        if not path:
            return
        try:
            scale = stated_pixel_scale(read_image(path).header)
        except (OSError, ValueError) as error:
            show_error(str(error))
            return
        if scale is None:
            show_info(f"{path} does not say its pixel scale; type it.")
        else:
            self.pixel_scale.number = float(f"{scale:.10g}")

"""The display panel: what the image shows, its brightness scale and limits."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import ComboBox, PushButton
from napari.utils.notifications import show_error
from qtpy.QtWidgets import QLabel

from .brightness import SCALES
from .color_bar import ColorBar
from .counts_layer import SHOWN
from .form import Form
from .number_field import NumberField
from .scene import Scene

SHOWN_TEXT = {
    "counts": "counts",
    "expected": "expected counts (no noise)",
    "difference": "counts − expected",
}


class DisplayForm(Form):
    """Changes how the picture is shown; saved files always hold counts.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__("Display")
        self.scene = scene
        self.shows = ComboBox(
            choices=[(SHOWN_TEXT[what], what) for what in SHOWN],
            value=scene.counts.shows,
            tooltip="Counts with noise, their expectation, or the difference; files hold counts",
        )
        self.scale = ComboBox(
            choices=[(label, scale) for scale, label in SCALES.items()],
            value=scene.counts.scale,
            tooltip="Brightness scale: counts C, log C, √C, asinh C or SNR = (C − B)/√C",
        )
        self.low = NumberField("lower limit", 0.0, "Counts that are black; Enter to apply")
        self.high = NumberField("upper limit", 1.0, "Counts that are white; Enter to apply")
        self.auto = PushButton(text="Auto", tooltip="Choose the limits by the picture")
        self.bar = ColorBar(scene)
        self.add("Ima&ge", self.shows)
        self.add("Bright&ness", self.scale)
        self.add("Li&mits (ct)", self.low, self.high, self.auto)
        self.units = QLabel()
        self.add_native(self.units, self.bar)
        self.shows.changed.connect(self._set_shows)
        self.scale.changed.connect(self._set_scale)
        self.auto.changed.connect(self._choose_limits)
        for field in (self.low, self.high):
            field.native.editingFinished.connect(self._apply_limits)
        self._layer: Any = None
        self.show_display()

    def resume(self) -> None:
        """Follow the scene."""
        self.scene.events.picture.connect(self.show_display)
        self.show_display()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.picture.disconnect(self.show_display)
        self._listen(None)

    def show_display(self, event: Any = None) -> None:
        """Show how the image is displayed now."""
        counts = self.scene.counts
        self._listen(counts.layer)
        for widget, value in ((self.shows, counts.shows), (self.scale, counts.scale)):
            with widget.changed.blocked():
                widget.value = value
        self.scale.enabled = counts.shows != "difference"
        self.show_limits()

    def show_limits(self, event: Any = None) -> None:
        """Show the present limits and colours."""
        for field, value in zip((self.low, self.high), self.scene.counts.limits, strict=True):
            if not field.native.hasFocus():
                field.number = float(f"{value:.4g}")
        self.bar.show_scale()
        self.units.setToolTip(self.bar.toolTip())
        magnitudes = "AB mag/″²" if self.bar.spectrum else "AB mag/″² *"
        self.units.setText(f"\nct/px\n{magnitudes}" if self.bar.has_magnitudes else "\nct/px")

    def _listen(self, layer: Any) -> None:
        if self._layer is layer:
            return
        for old, connect in ((self._layer, False), (layer, True)):
            if old is not None:
                for event in (old.events.contrast_limits, old.events.colormap):
                    (event.connect if connect else event.disconnect)(self.show_limits)
        self._layer = layer

    def _set_shows(self, what: str) -> None:
        self.scene.counts.shows = what
        self.show_display()

    def _set_scale(self, scale: str) -> None:
        self.scene.counts.scale = scale
        self.show_display()

    def _choose_limits(self, event: Any = None) -> None:
        self.scene.counts.set_limits(None)
        self.show_display()

    def _apply_limits(self) -> None:
        try:
            limits = self.low.number, self.high.number
            shown = tuple(float(f"{value:.4g}") for value in self.scene.counts.limits)
            if limits != shown:
                self.scene.counts.set_limits(limits)
        except ValueError as error:
            show_error(str(error))

"""The view panel: how the frames are laid out, zoom, scale bar, compass and traces."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import CheckBox, ComboBox, PushButton

from .canvas_geometry import find_canvas
from .compass import Compass
from .form import Form
from .keys import shown
from .scene import Scene
from .side_by_side import SideBySide
from .trace_docks import FREEZE_KEY, show_traces, traces_shown
from .traces import traces_of
from .whole_frame import WholeFrame
from .zoom import FACTORS, FIT_KEY, KEYS, Zoom

# Width of napari's check boxes without their text, pixels on the screen.
CHECK_BOX = 34


class ViewForm(Form):
    """Changes how the scene is looked at; nothing of it changes the picture.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__("View")
        self.scene = scene
        self.zoom, self.frames = Zoom(scene), SideBySide(scene)
        self.whole = WholeFrame(self.zoom)
        self.traces = traces_of(scene)
        self._compass: Compass | None = None

        self.layout_ = ComboBox(
            choices=[("source model on the image", False), ("side by side", True)],
            value=self.frames.enabled,
            tooltip="Source model and final image in one frame, or in two that zoom together",
        )
        self.fit = PushButton(text="Fit", tooltip=f"Show the whole frame ({shown(FIT_KEY)})")
        self.factors = {
            factor: PushButton(
                text=f"{factor}×",
                tooltip=f"Let 1/{factor} of the frame fill the canvas ({shown(KEYS[factor])})",
            )
            for factor in FACTORS
        }
        self.centre = ComboBox(
            choices=[("frame", "frame"), ("selected sources", "selected")],
            tooltip="About what to zoom; the frame, while no source is selected",
        )
        self.scale_bar = CheckBox(text="Scale &bar", tooltip="napari's scale bar, in arcsec")
        self.compass = CheckBox(text="N, E", tooltip="Mark north and east, by the roll")
        self.trace = CheckBox(
            text="T&races",
            tooltip="Plot the row and the column under the pointer "
            f"({shown(FREEZE_KEY)} freezes them)",
        )
        self.add("Frames", self.layout_)
        self.add("&Zoom", self.fit, *self.factors.values())
        for button in (self.fit, *self.factors.values()):
            button.native.setMinimumWidth(30)
            button.native.setStyleSheet("padding: 2px;")
        self.add("About", self.centre)
        self.add("Show", self.scale_bar, self.compass, self.trace)
        for box in (self.scale_bar, self.compass, self.trace):
            text = box.native.fontMetrics().horizontalAdvance(box.text.replace("&", ""))
            box.native.setMinimumWidth(text + CHECK_BOX)

        self.layout_.changed.connect(self._lay_out)
        self.fit.changed.connect(self._fit)
        for factor, button in self.factors.items():
            button.changed.connect(lambda _, factor=factor: self.zoom.to(factor))
        self.centre.changed.connect(self._set_centre)
        self.scale_bar.changed.connect(self._show_scale_bar)
        self.compass.changed.connect(self._show_compass)
        self.trace.changed.connect(self._show_traces)
        for layer in scene.layers:
            self._bind_keys(layer)
        scene.viewer.layers.events.inserted.connect(self._layer_inserted)
        self.show_view()

    def resume(self) -> None:
        """Follow the viewer."""
        self._scale_bar.events.visible.connect(self.show_view)
        self.frames.events.enabled.connect(self.show_view)
        self.traces.events.watched.connect(self.show_view)
        self.whole.resume()
        self.show_view()

    def pause(self) -> None:
        """Stop following the viewer."""
        self._scale_bar.events.visible.disconnect(self.show_view)
        self.frames.events.enabled.disconnect(self.show_view)
        self.traces.events.watched.disconnect(self.show_view)
        self.whole.pause()

    def show_view(self, event: Any = None) -> None:
        """Show how the viewer is set."""
        for widget, value in (
            (self.layout_, self.frames.enabled),
            (self.scale_bar, self._scale_bar.visible),
            (self.compass, self._compass is not None and not self._compass.isHidden()),
            (self.trace, self._has_window and traces_shown(self.scene.viewer)),
        ):
            with widget.changed.blocked():
                widget.value = value

    @property
    def _scale_bar(self) -> Any:
        return self.scene.viewer.canvas.overlays.scale_bar

    @property
    def _has_window(self) -> bool:
        return hasattr(self.scene.viewer, "window")

    def _lay_out(self, beside: bool) -> None:
        self.frames.enabled = beside
        self.show_view()

    def _fit(self, event: Any = None) -> None:
        self.zoom.fit()

    def _set_centre(self, centre: Any) -> None:
        self.zoom.centre = centre

    def _show_scale_bar(self, visible: bool) -> None:
        self._scale_bar.visible = visible

    def _show_compass(self, visible: bool) -> None:
        if self._compass is None:
            canvas = find_canvas(self)
            if canvas is None:
                self.show_view()
                return
            self._compass = Compass(self.scene, canvas)
        self._compass.setVisible(visible)

    def _show_traces(self, visible: bool) -> None:
        if self._has_window:
            show_traces(self.scene.viewer, visible)
        self.show_view()

    def _layer_inserted(self, event: Any) -> None:
        if any(event.value is layer for layer in self.scene.layers):
            self._bind_keys(event.value)

    def _bind_keys(self, layer: Any) -> None:
        self.zoom.bind_keys(layer)
        traces = self.traces

        def freeze(_: Any) -> None:
            traces.frozen = not traces.frozen

        layer.bind_key(FREEZE_KEY, freeze, overwrite=True)

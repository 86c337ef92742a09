"""The instrument panel: channel, filter wheels, exposure, frame, noise, and what to expect."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import ComboBox, Container, FloatSpinBox, Label, PushButton, SpinBox
from napari.utils.notifications import show_error

from ..instrument import CHANNELS, FILTERS, FRAME_SIZES, PIXEL_SCALE, PSF_NOTE
from ..observation import Observation
from .scene import Scene

WARNING_STYLE = "color: #111; background: #ffcf5c; padding: 3px; border-radius: 3px;"


class InstrumentForm(Container[Any]):
    """Edits the scene's observation and seed.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.channel = ComboBox(
            label="channel",
            choices=[(_channel_text(name), name) for name in CHANNELS],
            tooltip="Channel of the camera and its spectral range",
        )
        wheel = "Filter wheel: open, or a neutral filter that passes 0.1 (NF1) or 0.01 (NF2)"
        self.wheel1 = ComboBox(choices=list(FILTERS), tooltip=wheel, label="wheel 1")
        self.wheel2 = ComboBox(choices=list(FILTERS), tooltip=wheel, label="wheel 2")
        self.wheels = Container(
            widgets=[self.wheel1, self.wheel2], layout="horizontal", labels=False, label="wheels 1, 2"
        )
        self.exposure = FloatSpinBox(
            label="exposure (s)",
            min=0.001,
            max=1e7,
            step=None,
            value=100.0,
            tooltip="Exposure time in seconds",
        )
        self.frame = ComboBox(
            label="frame",
            choices=_frames((512, 512)),
            tooltip="Size of the frame in pixels; the sources stay where they are",
        )
        self.seed = SpinBox(
            label="noise seed", min=0, max=2**31 - 1, tooltip="Seed of the Poisson noise"
        )
        self.new_noise = PushButton(text="&New noise", tooltip="Draw the noise anew (next seed)")
        self.noise = Container(
            widgets=[self.seed, self.new_noise], layout="horizontal", labels=False, label="noise seed"
        )
        self.sky = Label(label="sky")
        self.psf = Label(label="PSF")
        self.warning = Label(value="")
        super().__init__(
            widgets=[
                self.channel,
                self.wheels,
                self.exposure,
                self.frame,
                self.noise,
                self.sky,
                self.psf,
                self.warning,
            ]
        )
        self.margins = (4, 2, 4, 2)
        for row in (self.wheels, self.noise):
            row.margins = (0, 0, 0, 0)
        # A value that is being typed takes effect with Enter or when the field is left.
        for box in (self.exposure, self.seed):
            box.native.setKeyboardTracking(False)
        for label in (self.sky, self.psf, self.warning):
            label.native.setWordWrap(True)
        self.warning.native.setStyleSheet(WARNING_STYLE)
        self.psf.tooltip = PSF_NOTE
        self.show_observation()
        self.show_warnings()
        for widget in (self.channel, self.wheel1, self.wheel2, self.exposure, self.frame):
            widget.changed.connect(self._apply)
        self.seed.changed.connect(self._apply_seed)
        self.new_noise.changed.connect(self._draw_noise)

    def resume(self) -> None:
        """Follow the scene."""
        self.scene.events.observation.connect(self.show_observation)
        self.scene.events.picture.connect(self.show_warnings)
        self.show_observation()
        self.show_warnings()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.observation.disconnect(self.show_observation)
        self.scene.events.picture.disconnect(self.show_warnings)

    def show_observation(self, event: Any = None) -> None:
        """Show the scene's observation and seed."""
        observation = self.scene.observation
        with self.changed.blocked():
            for widget, value in (
                (self.channel, observation.channel),
                (self.wheel1, observation.filters[0]),
                (self.wheel2, observation.filters[1]),
                (self.exposure, observation.exposure),
                (self.seed, self.scene.seed),
            ):
                with widget.changed.blocked():
                    widget.value = value  # type: ignore[attr-defined]
            with self.frame.changed.blocked():
                self.frame.choices = _frames(observation.shape)
                self.frame.value = observation.shape
        self.sky.value = _sky_text(observation)
        self.psf.value = (
            "assumed, about 0.10″ FWHM (none is published)"
            if observation.psf_assumed
            else f"{type(observation.psf).__name__}, given by a script"
        )

    def show_warnings(self, event: Any = None) -> None:
        """Show the count-rate limits that the present picture breaks."""
        picture = self.scene.picture
        text = "" if picture is None else "\n".join(picture.warnings)
        self.warning.value = text
        self.warning.visible = bool(text)

    def _apply(self, event: Any = None) -> None:
        try:
            self.scene.observation = self.scene.observation.replace(
                channel=self.channel.value,
                filters=(self.wheel1.value, self.wheel2.value),
                exposure=self.exposure.value,
                shape=self.frame.value,
            )
        except ValueError as error:
            show_error(str(error))
        self.show_observation()

    def _apply_seed(self, seed: int) -> None:
        self.scene.seed = seed

    def _draw_noise(self, event: Any = None) -> None:
        self.scene.new_noise()
        self.show_observation()


def _channel_text(name: str) -> str:
    low, high = CHANNELS[name].band
    return f"{name}  {low:.0f}–{high:.0f} Å"


def _frames(shape: tuple[int, int]) -> list[tuple[str, tuple[int, int]]]:
    sizes = [(n, n) for n in FRAME_SIZES]
    if shape not in sizes:
        sizes.append(shape)
    return [
        (f"{nx} × {ny} px  ({nx * PIXEL_SCALE:.1f}″ × {ny * PIXEL_SCALE:.1f}″)", (ny, nx))
        for ny, nx in sizes
    ]


def _sky_text(observation: Observation) -> str:
    total = f"{observation.sky_rate:.2g} cps/px"
    counts = f"{observation.sky_rate * observation.exposure:.3g} ct/px in this exposure"
    if observation.background is not None:
        return f"{total}, set by a script; {counts}"
    sky, passed = observation.channel_data.sky, observation.transmittance
    return (
        f"{total} = {sky.earthshine_and_zodiacal * passed:.2g} earthshine + zodiacal light, "
        f"{sky.geocorona * passed:.2g} geocorona; {counts}"
    )

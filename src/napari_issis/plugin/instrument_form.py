"""The instrument panel: channel, filter wheels, exposure, frame, noise, and what to expect."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from typing import Any

from magicgui.widgets import CheckBox, ComboBox, PushButton
from napari.utils.notifications import show_error
from qtpy.QtWidgets import QFileDialog, QLabel

from ..filters import Filter
from ..instrument import Instrument
from ..instruments import INSTRUMENTS, instrument_named
from ..observation import Observation, passes
from ..psf_blurs import with_blurs_of
from ..sky import SKIES
from .form import Form
from .number_field import NumberField, SeedField
from .position_field import PositionField
from .psf_rows import PsfRows
from .scene import Scene

# What the last entry of a wheel stands for.
LOAD = "load"
# Black on amber is readable in napari's dark and light themes.
WARNING_NOTE = "The limits are those of HST ACS/SBC, the nearest analogue."
WARNING_STYLE = "color: #111; background: #ffcf5c; padding: 0px; border-radius: 3px;"


def style_warning(label: QLabel) -> None:
    """Let a label stand out.

    Its margin is Qt's own: of a style sheet's padding a label that wraps its text knows nothing
    when it is asked for its height, and the labels around it are squeezed.
    """
    label.setStyleSheet(WARNING_STYLE)
    label.setMargin(3)


class InstrumentForm(Form):
    """Edits the scene's observation and seed.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__("Instrument")
        self.scene = scene
        self.channel = ComboBox(
            choices=_channels(scene.observation),
            tooltip="Channel of the camera and its spectral range",
        )
        self.camera = ComboBox(
            choices=_cameras(scene.observation),
            tooltip="Camera: ISSIS, others for comparison, or one of your own from a TOML file",
        )
        wheel = "Filter wheels: open, a neutral filter, or a curve. Those marked * are illustrative"
        self.wheel1 = ComboBox(choices=_filters(scene.observation), tooltip=wheel)
        self.wheel2 = ComboBox(choices=_filters(scene.observation), tooltip=wheel)
        self.exposure = NumberField(
            "exposure",
            scene.observation.exposure,
            "Exposure time in seconds; takes effect with Enter",
            check=lambda seconds: Observation(exposure=seconds),
        )
        self.frame = ComboBox(
            choices=_frames(scene.observation),
            tooltip="Frame in pixels (and its width); the sources stay where they are",
        )
        self.position = PositionField()
        self.roll = NumberField(
            "roll",
            scene.observation.roll,
            "Roll: position angle of the frame's +y axis, degrees from north through east",
        )
        self.seed = SeedField(
            "seed", scene.seed, "Seed of the Poisson noise of the picture; takes effect with Enter"
        )
        self.new_noise = PushButton(text="&New noise", tooltip="Draw the noise anew (next seed)")
        self.add("Came&ra", self.camera)
        # in a row of its own, the band can be read
        self.add("Channel", self.channel)
        self.sky_model = ComboBox(
            choices=_skies(scene.observation),
            tooltip="Sky: the paper's constants (CIS), HST's levels, or that of a high orbit",
        )
        self.add("Wheels &1, 2", self.wheel1, self.wheel2)
        self.add("E&xposure (s)", self.exposure)
        self.add("Frame (px)", self.frame)
        self.add("RA Dec, roll", self.position, self.roll)
        self.add("Noise seed", self.seed, self.new_noise)
        self.add("Sky", self.sky_model)
        self.loss = CheckBox(
            text="Losses",
            tooltip="Coincidence loss: photons lost in bright pixels to the dead time of the "
            "camera's detector (ISSIS: assumed as in ACS/SBC, 1 % at 22 cps)",
        )
        self.rollover = CheckBox(
            text="16 bits",
            tooltip="Rollover: a pixel's memory has 16 bits: it holds the counts modulo 65536",
        )
        self.add("Detector", self.loss, self.rollover)
        self.sky = self.add_text("Background with the filters in place, by parts")
        self.psf = PsfRows(self, scene)
        self.warning = self.add_text(WARNING_NOTE)
        style_warning(self.warning)
        self._labelled: tuple[Any, ...] = ()
        self._shown: tuple[Any, ...] = (
            scene.observation.exposure,
            scene.seed,
            None,
            scene.observation.roll,
        )
        self._position_text = ""
        self.show_observation()
        self.show_warnings()
        self.camera.changed.connect(self._apply_camera)
        self.channel.changed.connect(self._apply_channel)
        self.sky_model.changed.connect(lambda sky: self._apply(sky=sky))
        for wheel_box in (self.wheel1, self.wheel2):
            wheel_box.changed.connect(self._apply_filters)
        self.loss.changed.connect(self._apply_loss)
        self.rollover.changed.connect(
            lambda on: self._apply(detector=replace(self.scene.observation.detector, rollover=on))
        )
        self.frame.changed.connect(lambda shape: self._apply(shape=shape))
        # What is being typed takes effect with Enter or when the field is left.
        self.exposure.native.editingFinished.connect(self._apply_exposure)
        self.seed.native.editingFinished.connect(self._apply_seed)
        for field in (self.position, self.roll):
            field.native.editingFinished.connect(self._apply_position)
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
        self.psf.pause()

    def show_observation(self, event: Any = None) -> None:
        """Show the scene's observation and seed."""
        observation = self.scene.observation
        camera = observation.instrument
        # the labels depend on the camera too
        if self._labelled != (camera, observation.channel, observation.shape):
            self._labelled = (camera, observation.channel, observation.shape)
            for widget, choices in (
                (self.frame, _frames(observation)),
                (self.channel, _channels(observation)),
            ):
                _offer(widget, choices)
            bands = ", ".join(label for label, _ in _channels(observation))
            self.channel.tooltip = f"Channel of the camera and its spectral range: {bands}"
        for widget, choices in (
            (self.camera, _cameras(observation)),
            (self.wheel1, _filters(observation)),
            (self.wheel2, _filters(observation)),
            (self.sky_model, _skies(observation)),
        ):
            if tuple(widget.choices) != tuple(value for _, value in choices):
                _offer(widget, choices)
        for widget, value in (
            (self.camera, camera),
            (self.channel, observation.channel),
            (self.sky_model, observation.sky),
            (self.wheel1, observation.filters[0]),
            (self.wheel2, observation.filters[1]),
            (self.frame, observation.shape),
        ):
            with widget.changed.blocked():
                widget.value = value
        for box, on in (
            (self.loss, observation.detector.dead_time > 0),
            (self.rollover, observation.detector.rollover),
        ):
            with box.changed.blocked():
                box.value = on
        # What the user is typing, or has to correct, stays unless the value itself changed.
        exposure, seed, pointing, roll = self._shown
        self._shown = (
            observation.exposure,
            self.scene.seed,
            observation.pointing,
            observation.roll,
        )
        if pointing is not observation.pointing:
            self.position.position = observation.pointing
            self._position_text = self.position.value
        if roll != observation.roll:
            self.roll.number = observation.roll
        if exposure != observation.exposure:
            self.exposure.number = observation.exposure
        if seed != self.scene.seed:
            self.seed.number = self.scene.seed
        self.sky.setText(_sky_text(observation))
        self.psf.show_observation()

    def show_warnings(self, event: Any = None) -> None:
        """Show the count-rate limits that the present picture breaks."""
        picture = self.scene.picture
        text = "" if picture is None else picture.warning
        self.warning.setText(text)
        if picture is not None:
            lines = (*picture.warnings, WARNING_NOTE)
            self.warning.setToolTip("".join(f"<p>{escape(line)}</p>" for line in lines))
        self.show_row(self.warning, bool(text))

    def _apply(self, **change: Any) -> None:
        before = self.scene.observation
        try:
            # blurs that were edited stay when channel or filters change the rest of the PSF
            self.scene.observation = with_blurs_of(before.replace(**change), before)
        except ValueError as error:
            show_error(str(error))
        self.show_observation()

    def _apply_camera(self, camera: Instrument | str) -> None:
        """Change the camera; what it lacks of channel, filters and sky gives way to its own."""
        if camera == LOAD:
            path, camera = self.ask_camera_path(), self.scene.observation.instrument
            try:
                camera = camera if path is None else Instrument.read(path)
            except (OSError, ValueError) as error:
                show_error(str(error))
        self._apply(instrument=camera)

    def _apply_channel(self, channel: str) -> None:
        """Change the channel; a filter that passes nothing of it is taken out of its wheel."""
        observation = self.scene.observation
        filters = tuple(
            one if passes(observation.instrument, channel, one) else "open"
            for one in observation.filters
        )
        self._apply(channel=channel, filters=filters)

    def _apply_loss(self, on: bool) -> None:
        """Switch the dead time of the camera on, or any dead time off."""
        dead_time = self.scene.observation.channel_data.dead_time if on else 0.0
        if dead_time is None:
            show_error("The dead time of this camera's detector is not known: its file has none.")
            self.show_observation()
            return
        self._apply(detector=replace(self.scene.observation.detector, dead_time=dead_time))

    def _apply_filters(self, event: Any = None) -> None:
        chosen = [self.wheel1.value, self.wheel2.value]
        if LOAD in chosen:
            loaded = self._load_filter()
            if loaded is None:
                self.show_observation()
                return
            chosen[chosen.index(LOAD)] = loaded
        self._apply(filters=tuple(chosen))

    def _load_filter(self) -> Filter | None:
        """Ask for a file with a filter's curve and read it; None, after a message, if it fails."""
        path = self.ask_path()
        if path is None:
            return None
        try:
            return Filter.read(path)
        except (OSError, ValueError) as error:
            show_error(str(error))
            return None

    def ask_camera_path(self) -> str | None:
        """Ask for the file of a camera; None if the user changed his mind."""
        kinds = "Cameras (*.toml);;All files (*)"
        path, _ = QFileDialog.getOpenFileName(self, "Camera", "", kinds)
        return path or None

    def ask_path(self) -> str | None:
        """Ask for the file of a filter; None if the user changed his mind."""
        path, _ = QFileDialog.getOpenFileName(
            self, "Curve of a filter", "", "Tables of wavelength and transmission (*)"
        )
        return path or None

    def _apply_exposure(self) -> None:
        if (exposure := _valid(self.exposure)) is not None:
            self._apply(exposure=exposure)

    def _apply_position(self) -> None:
        observation = self.scene.observation
        pointing, roll = observation.pointing, _valid(self.roll)
        # what is shown is rounded: it is taken only if it was typed
        if self.position.value != self._position_text:
            try:
                pointing = self.position.position
            except ValueError:
                return
        if roll is not None and (pointing is not observation.pointing or roll != observation.roll):
            self._apply(pointing=pointing, roll=roll)

    def _apply_seed(self) -> None:
        if (seed := _valid(self.seed)) is not None:
            self.scene.seed = int(seed)
            self.show_observation()

    def apply_typed(self) -> None:
        """Take over what was typed and not confirmed yet, as before saving by a key."""
        self._apply_exposure()
        self._apply_position()
        self._apply_seed()
        self.psf.apply_typed()

    def _draw_noise(self, event: Any = None) -> None:
        self.scene.new_noise()
        self.show_observation()


def _valid(field: NumberField) -> float | None:
    """Read a field; an invalid one stays as it is, marked red."""
    try:
        return field.number
    except ValueError:
        return None


def _offer(widget: ComboBox, choices: list[tuple[str, Any]]) -> None:
    """Put choices into a box in this order; what it held before would stay first."""
    with widget.changed.blocked():
        widget.choices = ()
        widget.choices = choices


def _cameras(observation: Observation) -> list[tuple[str, Any]]:
    """Labels and values of the cameras that come with the program, and the one in use."""
    cameras = [instrument_named(name) for name in INSTRUMENTS]
    if observation.instrument not in cameras:
        cameras.append(observation.instrument)
    return [*((one.name, one) for one in cameras), ("load a file…", LOAD)]


def _channels(observation: Observation) -> list[tuple[str, str]]:
    return [
        ("{}  {:.0f}–{:.0f} Å".format(name, *channel.band), name)
        for name, channel in observation.instrument.channels.items()
    ]


def _frames(observation: Observation) -> list[tuple[str, tuple[int, int]]]:
    shape, scale = observation.shape, observation.pixel_scale
    sizes = [(n, n) for n in observation.channel_data.frame_sizes]
    if shape not in sizes:
        sizes.append(shape)
    return [(f"{nx} × {ny} ({nx * scale:.1f}″)", (ny, nx)) for ny, nx in sizes]


def _filters(observation: Observation) -> list[tuple[str, Any]]:
    """Labels and values of the filters that pass light of the channel, and those in use."""
    camera = observation.instrument
    filters: list[tuple[str, Any]] = [
        (f"{name} *" if camera.is_illustrative(name) else name, name)
        for name in camera.filter_names
        if passes(camera, observation.channel, name)
    ]
    own = dict.fromkeys(one for one in observation.filters if isinstance(one, Filter))
    return [*filters, *((one.name, one) for one in own), ("load a curve…", LOAD)]


def _skies(observation: Observation) -> list[tuple[str, Any]]:
    """Labels and values of the skies, and the one in use if a script made it."""
    skies: list[tuple[str, Any]] = list(SKIES.items())
    if observation.sky not in SKIES.values():
        skies.append(("set by a script", observation.sky))
    return skies


def _sky_text(observation: Observation) -> str:
    total = f"Sky {observation.sky_rate:.2g} cps/px"
    counts = (
        f"{observation.sky_rate * observation.exposure:.3g} ct/px in {observation.exposure:g} s"
    )
    if observation.background is not None:
        return f"{total}, set by a script; {counts}"
    parts = ", ".join(f"{name} {rate:.2g}" for name, rate in observation.sky_components.items())
    return f"{total}: {parts}; {counts}"

"""The rows of a form that plan a monitoring."""

from __future__ import annotations

from functools import partial

from magicgui.widgets import ComboBox, LineEdit

from ..monitoring_settings import CURVES, MonitoringSettings
from ..psf import positive
from .count_field import CountField
from .form import Form
from .number_field import NumberField, SeedField, read_number

# Exposures in all; more take minutes to plan, and much memory.
MOST = 10_000


class MonitoringForm(Form):
    """Epochs, dithers, roll, light curve and delays."""

    def __init__(self) -> None:
        super().__init__("Plan")
        start = MonitoringSettings()
        self.epochs = CountField(
            "epochs", start.epochs, (10, 20, 50, 100, 200), "Number of epochs, from time 0 on"
        )
        self.cadence = NumberField(
            "cadence",
            start.cadence,
            "Days from an epoch to the next",
            partial(positive, "cadence", unit="days"),
        )
        self.exposures = CountField(
            "exposures",
            start.exposures,
            (1, 2, 3, 4, 6, 9),
            "Exposures at each epoch, each as long as in the instrument's form; they are added",
        )
        self.dither = NumberField(
            "dither",
            start.dither,
            "By how many pixels the pointing moves between the exposures of an epoch",
            partial(positive, "dither", unit="pixels", zero=True),
        )
        self.roll = NumberField("roll", start.roll, "By how much the roll grows at each epoch")
        self.curve = ComboBox(
            choices=list(CURVES),
            value=start.curve,
            tooltip="How all point sources vary, each with its own delay; extended sources do not",
        )
        self.amplitude = NumberField(
            "amplitude",
            start.amplitude,
            "Magnitudes: of the sinusoid from the mean to the brightest, of the walk its standard "
            "deviation over long times",
            partial(positive, "amplitude", unit="magnitudes", zero=True),
        )
        self.time_scale = NumberField(
            "time scale",
            start.time_scale,
            "Days: the sinusoid's period, or the time after which the walk forgets",
            partial(positive, "time scale", unit="days"),
        )
        self.delays = LineEdit(
            tooltip="Days by which each point source lags, in the order of the list of sources, "
            "such as 0 8.8 0.6 13.8; empty for none"
        )
        self.seed = SeedField("seed", start.seed, "Of the walk and of the exposures' noise")
        self.add("&Epochs", self.epochs, self.exposures).setToolTip("Epochs, and exposures of each")
        self.add("Each (days)", self.cadence)
        self.add("Dither (px)", self.dither)
        self.add("Roll (°)", self.roll)
        self.add("Light curve", self.curve)
        self._varying = [
            self.add("Amplitude (mag)", self.amplitude),
            self.add("Scale (days)", self.time_scale),
            self.add("Delays (days)", self.delays),
        ]
        self.add("Seed", self.seed)
        self.curve.changed.connect(self._show_rows)

    def settings(self) -> MonitoringSettings:
        """Return what the fields hold; a ValueError names the field that holds nothing valid."""
        epochs, exposures = self.epochs.number, self.exposures.number
        if epochs * exposures > MOST:
            raise ValueError(
                f"{epochs} epochs of {exposures} exposures are {epochs * exposures}, more than "
                f"{MOST}; plan them in parts, or from a script."
            )
        words = self.delays.value.replace(",", " ").split()
        return MonitoringSettings(
            epochs=epochs,
            cadence=self.cadence.number,
            exposures=exposures,
            dither=self.dither.number,
            roll=self.roll.number,
            curve=self.curve.value,
            amplitude=self.amplitude.number,
            time_scale=self.time_scale.number,
            delays=tuple(read_number("a delay", word) for word in words),
            seed=self.seed.number,
        )

    def _show_rows(self, curve: str) -> None:
        for row in self._varying:
            self.show_row(row, curve != "constant")

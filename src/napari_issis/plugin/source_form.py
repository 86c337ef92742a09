"""The form that adds sources: one with given parameters, or a random population."""

from __future__ import annotations

from typing import Any

from astropy.table import QTable
from magicgui.widgets import ComboBox, PushButton
from napari.utils.notifications import show_error
from qtpy.QtWidgets import QWidget

from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    KINDS,
    random_sources,
    source,
)
from .form import Form
from .number_field import NumberField, SeedField
from .scene import Scene

KIND_TEXT = {
    "point": "point (star)",
    "devaucouleurs": "de Vaucouleurs",
    "gaussian": "Gaussian",
    "sersic": "Sérsic",
}
FLUX_LABEL = "F (erg/s/cm²/Å)"
FLUX_HELP = "Flux F in erg s⁻¹ cm⁻² Å⁻¹, averaged over the channel"
R_HELP = "Semi-major axis of the ellipse that holds half of the light, pixels (0.036″ each)"
E_HELP = "Ellipticity 1 − b/a, from 0 to below 1"
PA_HELP = "Position angle of the major axis, degrees from up, counter-clockwise"
N_HELP = "Sérsic index, 0.5 to 8"


class Limits:
    """Lower and upper limit of a quantity, typed as numbers."""

    def __init__(self, name: str, label: str, low: float, high: float, tooltip: str) -> None:
        self.low = _field(name, low, f"Lower limit. {tooltip}", f"{label}, lower limit")
        self.high = _field(name, high, f"Upper limit. {tooltip}", f"{label}, upper limit")

    @property
    def numbers(self) -> tuple[float, float]:
        """The limits."""
        return self.low.number, self.high.number


class SourceForm(Form):
    """Adds sources to the scene, and says what sources drawn by hand are.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__("Add sources")
        self.scene = scene
        self.kind = ComboBox(
            choices=[(KIND_TEXT.get(kind, kind), kind) for kind in KINDS],
            value="exponential",
            tooltip="Profile; also that of ellipses drawn by hand",
        )
        self.mode = ComboBox(
            choices=[("specific object", "specific"), ("random distribution", "random")],
            value="specific",
            tooltip="One source with these parameters, or a random population over the frame",
        )
        self.x = _field("x", 256.0, "x, column of the centre, pixels (first pixel: 0)")
        self.y = _field("y", 256.0, "y, row of the centre, pixels (first pixel: 0)")
        self.flux = _field("flux", DEFAULT_FLUX, FLUX_HELP)
        self.r_half = _field("r_half", DEFAULT_R_HALF, R_HELP)
        self.ellipticity = _field("ellipticity", DEFAULT_ELLIPTICITY, E_HELP)
        self.pa = _field("pa", DEFAULT_PA, PA_HELP)
        self.n = _field("n", 2.0, N_HELP)

        self.number = ComboBox(choices=[1, 10, 100], value=100, tooltip="Number of sources")
        self.distribution = ComboBox(
            choices=["uniform", "log"],
            tooltip="Fluxes uniform between the limits, or their logarithms",
        )
        self.flux_limits = Limits("flux", "flux", 1e-15, 1e-14, FLUX_HELP)
        self.r_limits = Limits("r_half", "half-light radius", 10, 30, R_HELP)
        self.e_limits = Limits("ellipticity", "ellipticity", 0, 0.8, E_HELP)
        self.pa_limits = Limits("pa", "position angle", 0, 180, PA_HELP)
        self.n_limits = Limits("n", "Sersic index", 0.5, 4, N_HELP)
        self.seed = SeedField(
            "seed",
            1,
            "Seed of the population; goes up by one with each, so that none is repeated",
        )
        # The dock shows it below the forms, where it is never scrolled out of sight.
        self.button = PushButton(text="&Add source(s)", tooltip="Add to the scene")

        self.add("Kind", self.kind)
        self.add("Mode", self.mode)
        self._rows_of = {
            ("specific", "all"): [
                self.add("x, y (px)", self.x, self.y),
                self.add(FLUX_LABEL, self.flux),
            ],
            ("specific", "extended"): [
                self.add("R½ (px)", self.r_half),
                self.add("Ellipticity", self.ellipticity),
                self.add("PA (°)", self.pa),
            ],
            ("specific", "sersic"): [self.add("Sérsic n", self.n)],
            ("random", "all"): [
                self.add("Number", self.number),
                self.add("Distribution", self.distribution),
                self._add_limits(FLUX_LABEL, self.flux_limits),
            ],
            ("random", "extended"): [
                self._add_limits("R½ (px)", self.r_limits),
                self._add_limits("Ellipticity", self.e_limits),
                self._add_limits("PA (°)", self.pa_limits),
            ],
            ("random", "sersic"): [self._add_limits("Sérsic n", self.n_limits)],
        }
        self._rows_of["random", "all"].append(self.add("Seed", self.seed))
        self._centre = self.x.value, self.y.value
        self.show_centre()

        for widget in (self.mode, self.kind):
            widget.changed.connect(self._show_fields)
        for field in (self.flux, self.r_half, self.ellipticity, self.pa, self.n):
            field.changed.connect(self._describe_drawn)
        self.button.changed.connect(self.add_sources)
        self._show_fields()

    def resume(self) -> None:
        """Follow the scene's frame."""
        self.scene.events.observation.connect(self.show_centre)
        self.show_centre()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.observation.disconnect(self.show_centre)

    def show_centre(self, event: Any = None) -> None:
        """Offer the centre of the frame as the place of the next source, unless one was typed."""
        ny, nx = self.scene.observation.shape
        if (self.x.value, self.y.value) == self._centre:
            self.x.number, self.y.number = nx // 2, ny // 2
            self._centre = self.x.value, self.y.value

    def _add_limits(self, label: str, limits: Limits) -> QWidget:
        return self.add(label, limits.low, limits.high)

    def table(self) -> QTable:
        """Return the sources that the form describes.

        Raises
        ------
        ValueError
            If a value is no number or out of range.
        """
        kind = self.kind.value
        if self.mode.value == "specific":
            return source(x=self.x.number, y=self.y.number, **self._one())
        ranges: dict[str, Any] = {}
        if kind != "point":
            ranges.update(
                r_half=self.r_limits.numbers,
                ellipticity=self.e_limits.numbers,
                pa=self.pa_limits.numbers,
            )
        if kind == "sersic":
            ranges["index"] = self.n_limits.numbers
        return random_sources(
            kind,
            self.number.value,
            shape=self.scene.observation.shape,
            flux=self.flux_limits.numbers,
            flux_distribution=self.distribution.value,
            seed=self.seed.number,
            **ranges,
        )

    def add_sources(self, event: Any = None) -> None:
        """Add the sources; an error is shown and changes nothing."""
        try:
            self.scene.add(self.table())
        except ValueError as error:
            show_error(str(error))
            return
        if self.mode.value == "random":
            self.seed.number += 1

    def _one(self) -> dict[str, Any]:
        kind = self.kind.value
        one: dict[str, Any] = {"kind": kind, "flux": self.flux.number}
        if kind != "point":
            one.update(
                r_half=self.r_half.number,
                ellipticity=self.ellipticity.number,
                pa=self.pa.number,
                n=self.n.number if kind == "sersic" else None,
            )
        return one

    def _describe_drawn(self, event: Any = None) -> None:
        try:
            one = self._one()
        except ValueError:
            # Half typed: what was valid last stays.
            return
        self.scene.new_source = {**self.scene.new_source, "n": None, **one}

    def _show_fields(self, event: Any = None) -> None:
        kind = self.kind.value
        applies = {"all": True, "extended": kind != "point", "sersic": kind == "sersic"}
        for (mode, kinds), rows in self._rows_of.items():
            for row in rows:
                self.show_row(row, mode == self.mode.value and applies[kinds])
        self._describe_drawn()


def _field(name: str, value: float, tooltip: str, label: str = "") -> NumberField:
    """Make a field for one of the numbers of `source`, with its limits."""
    default: dict[str, Any] = {"x": 0.0, "y": 0.0, "n": 2.0}
    return NumberField(
        label or name,
        value,
        tooltip,
        check=lambda number: source("sersic", **{**default, name: number}),
    )

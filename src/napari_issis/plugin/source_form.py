"""The form that adds sources: one with given parameters, or a random population."""

from __future__ import annotations

from typing import Any

from astropy.table import QTable
from magicgui.widgets import (
    ComboBox,
    Container,
    FloatSpinBox,
    LineEdit,
    PushButton,
    RadioButtons,
    SpinBox,
)
from napari.utils.notifications import show_error

from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    KINDS,
    random_sources,
    source,
)
from .scene import Scene

KIND_TEXT = {
    "point": "point (star)",
    "devaucouleurs": "de Vaucouleurs",
    "gaussian": "Gaussian",
    "sersic": "Sérsic",
}
FLUX_LABEL = "F (erg/s/cm²/Å)"
FLUX_HELP = "Flux in erg s⁻¹ cm⁻² Å⁻¹, averaged over the channel"
R_HELP = "Semi-major axis of the ellipse that holds half of the light, pixels (0.036″ each)"
E_HELP = "Ellipticity 1 − b/a, from 0 to below 1"
PA_HELP = "Position angle of the major axis, degrees from up, counter-clockwise"
N_HELP = "Sérsic index, 0.5 to 8"


class Limits(Container[Any]):
    """Lower and upper limit of a quantity, typed as numbers."""

    def __init__(self, label: str, low: float, high: float, tooltip: str) -> None:
        self.low = LineEdit(value=f"{low:g}", tooltip=f"Lower limit. {tooltip}")
        self.high = LineEdit(value=f"{high:g}", tooltip=f"Upper limit. {tooltip}")
        super().__init__(
            widgets=[self.low, self.high], layout="horizontal", labels=False, label=label
        )
        self.margins = (0, 0, 0, 0)

    @property
    def numbers(self) -> tuple[float, float]:
        """The limits."""
        return number(f"{self.label}, lower limit", self.low.value), number(
            f"{self.label}, upper limit", self.high.value
        )


class SourceForm(Container[Any]):
    """Adds sources to the scene, and says what sources drawn by hand are.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.kind = ComboBox(
            label="kind",
            choices=[(KIND_TEXT.get(kind, kind), kind) for kind in KINDS],
            value="exponential",
            tooltip="Profile; also that of ellipses drawn by hand",
        )
        self.mode = RadioButtons(
            label="",
            choices=["specific", "random"],
            value="specific",
            orientation="horizontal",
            tooltip="One source with these parameters, or a random population over the frame",
        )
        self.x = _real("x", 256.0, -1e6, 1e6, "Column of the centre, pixels (first pixel: 0)")
        self.y = _real("y", 256.0, -1e6, 1e6, "Row of the centre, pixels (first pixel: 0)")
        self.position = Container(
            widgets=[self.x, self.y], layout="horizontal", labels=False, label="x, y (px)"
        )
        self.position.margins = (0, 0, 0, 0)
        self.flux = LineEdit(label=FLUX_LABEL, value=f"{DEFAULT_FLUX:g}", tooltip=FLUX_HELP)
        self.r_half = _real("R½ (px)", DEFAULT_R_HALF, 0.01, 1e5, R_HELP)
        self.ellipticity = _real("ellipticity", DEFAULT_ELLIPTICITY, 0.0, 0.99, E_HELP, 0.05)
        self.pa = _real("PA (°)", DEFAULT_PA, -360.0, 360.0, PA_HELP, 5.0)
        self.n = _real("Sérsic n", 2.0, 0.5, 8.0, N_HELP, 0.5)

        self.number = ComboBox(
            label="number", choices=[1, 10, 100], value=100, tooltip="Number of sources"
        )
        self.flux_limits = Limits(FLUX_LABEL, 1e-15, 1e-14, FLUX_HELP)
        self.distribution = ComboBox(
            label="F spread",
            choices=[("uniform", "uniform"), ("log-uniform", "log")],
            tooltip="Uniform in flux or in its logarithm",
        )
        self.r_limits = Limits("R½ (px)", 10, 30, R_HELP)
        self.e_limits = Limits("ellipticity", 0, 0.8, E_HELP)
        self.pa_limits = Limits("PA (°)", 0, 180, PA_HELP)
        self.n_limits = Limits("Sérsic n", 0.5, 4, N_HELP)
        self.seed = SpinBox(
            label="seed",
            min=0,
            max=2**31 - 1,
            value=1,
            tooltip="Seed of the population; goes up by one with each, so that none is repeated",
        )
        self.button = PushButton(text="&Add source(s)", tooltip="Add to the scene")
        self._specific = [
            self.position,
            self.flux,
            self.r_half,
            self.ellipticity,
            self.pa,
            self.n,
        ]
        self._random = [
            self.number,
            self.flux_limits,
            self.distribution,
            self.r_limits,
            self.e_limits,
            self.pa_limits,
            self.n_limits,
            self.seed,
        ]
        super().__init__(
            widgets=[self.kind, self.mode, *self._specific, *self._random, self.button]
        )
        self.margins = (4, 2, 4, 2)
        self.mode.changed.connect(self._show_fields)
        self.kind.changed.connect(self._show_fields)
        self.changed.connect(self._describe_drawn)
        self.button.changed.connect(self.add)
        self._show_fields()

    def table(self) -> QTable:
        """Return the sources that the form describes.

        Raises
        ------
        ValueError
            If a value is no number or out of range.
        """
        kind = self.kind.value
        if self.mode.value == "specific":
            return source(x=self.x.value, y=self.y.value, **self._one())
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
            seed=self.seed.value,
            **ranges,
        )

    def add(self, event: Any = None) -> None:
        """Add the sources; an error is shown and changes nothing."""
        try:
            self.scene.add(self.table())
        except ValueError as error:
            show_error(str(error))
            return
        if self.mode.value == "random":
            self.seed.value += 1

    def _one(self) -> dict[str, Any]:
        kind = self.kind.value
        return {
            "kind": kind,
            "flux": number("flux", self.flux.value),
            "r_half": self.r_half.value,
            "ellipticity": self.ellipticity.value,
            "pa": self.pa.value,
            "n": self.n.value if kind == "sersic" else None,
        }

    def _describe_drawn(self, event: Any = None) -> None:
        try:
            one = self._one()
            source(x=0, y=0, **one)
        except ValueError:
            # Half typed: what was valid last stays.
            return
        self.scene.new_source = one

    def _show_fields(self, event: Any = None) -> None:
        specific = self.mode.value == "specific"
        for widget in self._specific:
            widget.visible = specific
        for widget in self._random:
            widget.visible = not specific
        extended, sersic = self.kind.value != "point", self.kind.value == "sersic"
        for widget in (
            self.r_half,
            self.ellipticity,
            self.pa,
            self.r_limits,
            self.e_limits,
            self.pa_limits,
        ):
            widget.enabled = extended
        self.n.enabled = self.n_limits.enabled = sersic
        self._describe_drawn()


def number(name: str, text: str) -> float:
    """Read a number that was typed.

    Raises
    ------
    ValueError
        If it is none; the message names the field.
    """
    try:
        return float(text.strip().replace(",", "."))
    except ValueError:
        raise ValueError(f"{name} is {text!r}; it must be a number such as 1e-14.") from None


def _real(
    label: str, value: float, low: float, high: float, tooltip: str, step: float = 1.0
) -> FloatSpinBox:
    return FloatSpinBox(label=label, value=value, min=low, max=high, step=step, tooltip=tooltip)

"""The form that adds sources: a given one, a random population, a cluster, a lensed quasar."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from astropy.table import QTable
from magicgui.widgets import ComboBox, PushButton
from napari.utils.notifications import show_error
from qtpy.QtWidgets import QWidget

from ..image_source import image_source
from ..lensed_quasars import lensed_quasar
from ..populations import CLUSTER_FLUX, random_sources, star_cluster
from ..source_rates import cps_per_flux, flux_pivot
from ..sources import (
    DEFAULT_ELLIPTICITY,
    DEFAULT_FLUX,
    DEFAULT_PA,
    DEFAULT_R_HALF,
    KINDS,
    source,
)
from .cluster_rows import ClusterRows
from .count_field import CountField
from .flux_rows import FluxRows
from .form import Field, Form
from .image_rows import ImageRows
from .lens_rows import LensRows
from .limit_fields import Limits, QuantityLimits
from .number_field import NumberField, SeedField
from .quantity_field import QuantityField
from .scene import Scene
from .spectrum_field import SpectrumField
from .table import put
from .units import FluxScale, LengthScale

KIND_TEXT = {
    "point": "point (star)",
    "devaucouleurs": "de Vaucouleurs",
    "gaussian": "Gaussian",
    "sersic": "Sérsic",
}
MODES = (
    ("specific object", "specific"),
    ("random distribution", "random"),
    ("star cluster", "cluster"),
    ("lensed quasar", "lens"),
    ("image from a file", "image"),
)
FLUX_HELP = "Flux F, averaged over the channel, or AB magnitude"
R_HELP = "Semi-major axis of the ellipse that holds half of the light"
E_HELP = "Ellipticity 1 − b/a, from 0 to below 1"
PA_HELP = "Position angle of the major axis, degrees from up, counter-clockwise"
N_HELP = "Sérsic index, 0.5 to 8"
# Kinds of sources that a row applies to.
ALL_KINDS = frozenset(KINDS)
EXTENDED = ALL_KINDS - {"point"}
SERSIC = frozenset({"sersic"})


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
        self._rows_where: list[tuple[QWidget, frozenset[str], frozenset[str]]] = []
        self._make_choices()
        self._make_object()
        self._make_population()
        self._lay_out()
        self._centre = self.x.value, self.y.value
        self.show_centre()
        self.show_units()

        for widget in (self.mode, self.kind):
            widget.changed.connect(self._show_fields)
        for field in (self.flux, self.r_half, self.ellipticity, self.pa, self.n):
            field.changed.connect(self._describe_drawn)
        # also which magnitude a flux is
        self.spectrum.native.editTextChanged.connect(self.show_units)
        self.flux_unit.changed.connect(lambda unit: setattr(self.scene.units, "flux", unit))
        self.length_unit.changed.connect(lambda unit: setattr(self.scene.units, "length", unit))
        self.button.changed.connect(self.add_sources)
        self._show_fields()

    def _make_choices(self) -> None:
        self.flux_unit = ComboBox(
            choices=[("Fλ cgs", "flux"), ("AB mag", "AB mag")],
            tooltip="Show and type fluxes in erg s⁻¹ cm⁻² Å⁻¹, or as AB magnitudes "
            "at the channel's pivot wavelength",
        )
        self.length_unit = ComboBox(
            choices=[("px", "px"), ("arcsec", "arcsec")],
            tooltip="Show and type radii in pixels or in arcsec; positions are always in pixels",
        )
        self.mode = ComboBox(
            choices=list(MODES),
            value="specific",
            tooltip="One source with these parameters, a random population over the frame, "
            "the stars of a cluster, a known lensed quasar, or an image as a source",
        )
        self.kind = ComboBox(
            choices=[(KIND_TEXT.get(kind, kind), kind) for kind in KINDS],
            value="exponential",
            tooltip="Profile; also that of ellipses drawn by hand",
        )
        # The dock shows it below the forms, where it is never scrolled out of sight.
        self.button = PushButton(text="&Add source(s)", tooltip="Add to the scene")

    def _make_object(self) -> None:
        self.x = NumberField(
            "x", 256.0, "x, column of the centre, pixels (first pixel: 0)", _is("x")
        )
        self.y = NumberField("y", 256.0, "y, row of the centre, pixels (first pixel: 0)", _is("y"))
        self.flux = QuantityField("flux", DEFAULT_FLUX, FLUX_HELP, FluxScale(), _is("flux"))
        self.r_half = QuantityField("r_half", DEFAULT_R_HALF, R_HELP, LengthScale(), _is("r_half"))
        self.ellipticity = NumberField(
            "ellipticity", DEFAULT_ELLIPTICITY, E_HELP, _is("ellipticity")
        )
        self.pa = NumberField("pa", DEFAULT_PA, PA_HELP, _is("pa"))
        self.n = NumberField("n", 2.0, N_HELP, _is("n"))
        self.spectrum = SpectrumField(
            check=lambda spectrum: cps_per_flux(spectrum, self.scene.observation)
        )

    def _make_population(self) -> None:
        self.number = CountField(
            "number of sources",
            100,
            (1, 10, 100),
            "Number of sources: type any, or choose one of the list",
        )
        self.r_limits = QuantityLimits(
            "half-light radius", 10, 30, R_HELP, LengthScale(), _is("r_half")
        )
        self.e_limits = Limits("ellipticity", 0, 0.8, E_HELP, _is("ellipticity"))
        self.pa_limits = Limits("position angle", 0, 180, PA_HELP, _is("pa"))
        self.n_limits = Limits("Sersic index", 0.5, 4, N_HELP, _is("n"))
        self.seed = SeedField(
            "seed",
            1,
            "Seed of the population; goes up by one with each, so that none is repeated. "
            "Type one again to have its population again",
        )

    def _lay_out(self) -> None:
        units = self.add("&Units", self.flux_unit, self.length_unit)
        units.layout().setStretch(0, 5)
        units.layout().setStretch(1, 4)
        self.add("&Mode", self.mode)
        self._add_row("&Kind", self.kind, modes="specific random")
        self._add_row("Num&ber", self.number, modes="random cluster")
        self._add_row("x, y (px)", self.x, self.y, modes="specific cluster lens image")
        self._flux_row = self._add_row("F", self.flux, modes="specific image")
        self._r_row = self._add_row("R½", self.r_half, modes="specific", kinds=EXTENDED)
        self._add_row("Ellipticity", self.ellipticity, modes="specific", kinds=EXTENDED)
        self._add_row("PA (°)", self.pa, modes="specific image", kinds=EXTENDED)
        self._add_row("Sérsic n", self.n, modes="specific", kinds=SERSIC)
        self.cluster = ClusterRows(self)
        self.lens = LensRows(self)
        self.image = ImageRows(self)
        self.fluxes = FluxRows(self, "uniform", (1e-15, 1e-14), _is("flux"))
        self.cluster_fluxes = FluxRows(self, "power", CLUSTER_FLUX, _is("flux"))
        self._r_limits_row = self._add_limits("R½", self.r_limits, EXTENDED)
        self._add_limits("Ellipticity", self.e_limits, EXTENDED)
        self._add_limits("PA (°)", self.pa_limits, EXTENDED)
        self._add_limits("Sérsic n", self.n_limits, SERSIC)
        self._add_row("Spectrum", self.spectrum, modes="specific random cluster")
        self._add_row("See&d", self.seed, modes="random cluster")

    def _add_row(
        self, label: str, *widgets: Field, modes: str, kinds: frozenset[str] = ALL_KINDS
    ) -> QWidget:
        row = self.add(label, *widgets)
        self._rows_where.append((row, frozenset(modes.split()), kinds))
        return row

    def _add_limits(
        self, label: str, limits: Limits | QuantityLimits, kinds: frozenset[str]
    ) -> QWidget:
        return self._add_row(label, limits.low, limits.high, modes="random", kinds=kinds)

    def resume(self) -> None:
        """Follow the scene's frame, channel and units."""
        # Magnitudes are at the channel's wavelength.
        self.scene.events.observation.connect(self.show_centre)
        self.scene.events.observation.connect(self.show_units)
        self.scene.units.events.changed.connect(self.show_units)
        self.show_centre()
        self.show_units()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.observation.disconnect(self.show_centre)
        self.scene.events.observation.disconnect(self.show_units)
        self.scene.units.events.changed.disconnect(self.show_units)

    def show_centre(self, event: Any = None) -> None:
        """Offer the centre of the frame as the place of the next source, unless one was typed."""
        ny, nx = self.scene.observation.shape
        if (self.x.value, self.y.value) == self._centre:
            self.x.number, self.y.number = nx // 2, ny // 2
            self._centre = self.x.value, self.y.value

    def show_units(self, event: Any = None) -> None:
        """Convert all fluxes and lengths to the scene's units."""
        units, observation = self.scene.units, self.scene.observation
        self.spectrum.mark()
        for box, unit in ((self.flux_unit, units.flux), (self.length_unit, units.length)):
            with box.changed.blocked():
                box.value = unit
        flux_scale = units.flux_scale(self._pivot())
        lens_scale = units.flux_scale(observation.pivot)
        length_scale = units.length_scale(observation.pixel_scale)
        self.flux.show_in(flux_scale)
        self.relabel(self._flux_row, f"F ({units.flux_label})")
        for rows in (self.fluxes, self.cluster_fluxes):
            rows.show_in(flux_scale, units.flux_label)
        self.lens.show_in(lens_scale, units.flux_label)
        for row, name, field in (
            (self._r_row, "R½", self.r_half),
            (self._r_limits_row, "R½", self.r_limits),
        ):
            field.show_in(length_scale)
            self.relabel(row, f"{name} ({units.length_label})")
        self.cluster.show_in(length_scale, units.length_label)
        self._describe_drawn()

    def table(self) -> QTable:
        """Return the sources that the form describes.

        Raises
        ------
        ValueError
            If a value is no number or out of range, or the spectrum is none.
        """
        if self.mode.value == "specific":
            return source(x=self.x.number, y=self.y.number, **self._one())
        if self.mode.value == "cluster":
            return self._with_spectrum(
                star_cluster(
                    self.number.number,
                    centre=(self.x.number, self.y.number),
                    seed=self.seed.number,
                    **self.cluster.options(),
                    **self.cluster_fluxes.options(),
                )
            )
        if self.mode.value == "lens":
            return lensed_quasar(
                observation=self.scene.observation,
                centre=(self.x.number, self.y.number),
                **self.lens.options(),
            )
        if self.mode.value == "image":
            return image_source(
                x=self.x.number,
                y=self.y.number,
                flux=self.flux.number,
                pa=self.pa.number,
                frame_pixel_scale=self.scene.observation.pixel_scale,
                **self.image.options(),
            )
        kind = self.kind.value
        ranges: dict[str, Any] = {}
        if kind != "point":
            ranges.update(
                r_half=self.r_limits.numbers,
                ellipticity=self.e_limits.numbers,
                pa=self.pa_limits.numbers,
            )
        if kind == "sersic":
            ranges["index"] = self.n_limits.numbers
        return self._with_spectrum(
            random_sources(
                kind,
                self.number.number,
                shape=self.scene.observation.shape,
                seed=self.seed.number,
                **self.fluxes.options(),
                **ranges,
            )
        )

    def _with_spectrum(self, table: QTable) -> QTable:
        for name, text in self.spectrum.options.items():
            put(table, name, slice(None), text)
        return table

    def _pivot(self) -> float:
        """Wavelength at which a magnitude of the form is a flux, angstrom."""
        observation = self.scene.observation
        try:
            return flux_pivot(self.spectrum.text, observation)
        except ValueError:
            # half typed
            return observation.pivot

    def add_sources(self, event: Any = None) -> None:
        """Add the sources; an error is shown and changes nothing."""
        try:
            self.scene.add(self.table())
        except (OSError, ValueError) as error:
            show_error(str(error))
            return
        if self.mode.value in ("random", "cluster"):
            self.seed.number += 1

    def _one(self) -> dict[str, Any]:
        kind = self.kind.value
        one: dict[str, Any] = {"kind": kind, "flux": self.flux.number, **self.spectrum.options}
        if kind != "point":
            one.update(
                r_half=self.r_half.number,
                ellipticity=self.ellipticity.number,
                pa=self.pa.number,
                n=self.n.number if kind == "sersic" else None,
            )
        return one

    def _describe_drawn(self, event: Any = None) -> None:
        new = dict(self.scene.new_source)
        # Half typed: what was valid last stays.
        with suppress(ValueError):
            new.update({"n": None, "spectrum": None, **self._one()})
        if not self.spectrum.valid:
            # but it may have no light in another channel
            new["spectrum"] = None
        self.scene.new_source = new

    def _show_fields(self, event: Any = None) -> None:
        mode, kind = self.mode.value, self.kind.value
        for row, modes, kinds in self._rows_where:
            self.show_row(row, mode in modes and (kind in kinds or mode == "image"))
        self.cluster.show(mode == "cluster")
        self.lens.show(mode == "lens")
        self.image.show(mode == "image")
        self.fluxes.show(mode == "random")
        self.cluster_fluxes.show(mode == "cluster")
        self._describe_drawn()


def _is(name: str) -> Callable[[float], object]:
    """Make a check that a number is allowed as one of the arguments of `source`."""
    default: dict[str, Any] = {"x": 0.0, "y": 0.0, "n": 2.0}
    return lambda number: source("sersic", **{**default, name: number})

"""The rows of a form that choose a lensed quasar."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import CheckBox, ComboBox, LineEdit

from ..lensed_quasars import find_quasar, lensed_quasar, quasar_library
from .form import Form
from .quantity_field import QuantityField
from .units import FluxScale

# erg s-1 cm-2 A-1, shown where no flux of a system is known.
PLAIN_FLUX = 1e-15


class LensRows:
    """System, flux of its brightest image, flux ratios and lens galaxy, in rows of a form.

    Parameters
    ----------
    form : Form
        The rows are added to it.
    """

    def __init__(self, form: Form) -> None:
        self._form = form
        self.system = ComboBox(
            choices=list(quasar_library()),
            tooltip="A lensed quasar of known astrometry; x, y is where its lens galaxy stands",
        )
        self.flux = QuantityField(
            "flux",
            PLAIN_FLUX,
            "Flux of the brightest image, averaged over the channel, or AB magnitude. "
            "What is shown at first is illustrative",
            FluxScale(),
            check=lambda flux: lensed_quasar("Q2237+0305", flux=flux),
        )
        self.ratios = LineEdit(tooltip="Fluxes of the images relative to each other")
        self.galaxy = CheckBox(
            text="lens galaxy",
            value=True,
            tooltip="Add the lens galaxy: its position is measured; flux, size and shape are "
            "illustrative",
        )
        self._system_row = form.add("System", self.system)
        self._flux_row = form.add("F", self.flux)
        self._ratios_row = form.add("Ratios", self.ratios)
        self._galaxy_row = form.add("", self.galaxy)
        self.system.changed.connect(self._show_system)
        self._show_system()

    def show(self, applies: bool) -> None:
        """Show the rows, or hide them where they do not apply."""
        for row in (self._system_row, self._flux_row, self._ratios_row, self._galaxy_row):
            self._form.show_row(row, applies)

    def show_in(self, scale: FluxScale, label: str) -> None:
        """Convert the flux to another scale, with the unit's label."""
        self.flux.show_in(scale)
        self._form.relabel(self._flux_row, f"F ({label})")

    def options(self) -> dict[str, Any]:
        """Return arguments of `lensed_quasar`.

        Raises
        ------
        ValueError
            If a field holds no valid number.
        """
        typed = self.ratios.value.replace(",", " ").split()
        return {
            "name": self.system.value,
            "flux": self.flux.number,
            "ratios": typed or None,
            "lens_galaxy": self.galaxy.value,
        }

    def _show_system(self, event: Any = None) -> None:
        system = find_quasar(self.system.value)
        self.flux.number = PLAIN_FLUX if system.flux is None else float(f"{system.flux:.3g}")
        names = ", ".join(system.images)
        self.ratios.value = " ".join(f"{ratio:.3g}" for ratio in system.ratios or ())
        self.ratios.native.setCursorPosition(0)
        self.ratios.native.setPlaceholderText(f"not known: {names}")
        self.ratios.tooltip = f"Fluxes of the images {names} relative to each other"
        known = [
            f"z = {system.z_source:g}, lens {system.z_lens:g}",
            f"From: {'; '.join(system.references)}",
            f"Uncertain: {'; '.join(system.uncertain)}" if system.uncertain else "",
            system.note,
        ]
        self.system.tooltip = "\n".join(line for line in known if line)

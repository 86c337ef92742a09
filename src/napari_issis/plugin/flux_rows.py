"""The rows of a form that say how the fluxes of a population are distributed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from magicgui.widgets import ComboBox, PushButton
from napari.utils.notifications import show_error
from qtpy.QtCore import Qt
from qtpy.QtWidgets import QFileDialog

from ..flux_distribution import DEFAULT_SLOPE
from ..flux_list import SUFFIXES, read_fluxes
from ..populations import star_cluster
from .form import Form
from .limit_fields import QuantityLimits
from .number_field import NumberField
from .units import FluxScale

CHOICES = (
    ("uniform in F", "uniform"),
    ("uniform in log F", "log"),
    ("power law", "power"),
    ("from a table", "table"),
)
# Left and right of the text of a button, pixels.
BUTTON_MARGIN = 16


class FluxRows:
    """Distribution, limits, slope or table of fluxes, in rows of a form.

    Parameters
    ----------
    form : Form
        The rows are added to it.
    distribution : str
        The distribution shown at first.
    limits : (float, float)
        The limits shown at first, erg s-1 cm-2 A-1.
    check : callable
        Raises a ``ValueError`` if a flux is not allowed.
    """

    def __init__(
        self,
        form: Form,
        distribution: str,
        limits: tuple[float, float],
        check: Callable[[float], object],
    ) -> None:
        self._form = form
        self._applies = True
        self._sample: Any = None
        self.distribution = ComboBox(
            choices=list(CHOICES),
            value=distribution,
            tooltip="How the fluxes F are distributed: uniform between the limits, uniform in "
            "their logarithm, by a power law, or drawn from the column flux of a table",
        )
        self.limits = QuantityLimits(
            "flux",
            *limits,
            "Flux averaged over the channel, or AB magnitude (in either order)",
            FluxScale(),
            check,
            ends=("faint", "bright"),
        )
        self.slope = NumberField(
            "slope",
            DEFAULT_SLOPE,
            "Slope α of the power law dN/dF ∝ F^−α: 1 is uniform in log F, "
            "1.4 a main sequence with Salpeter's mass function",
            check=lambda slope: star_cluster(0, flux_slope=slope),
        )
        self.file = PushButton(
            text="Choose…",
            tooltip="A table (ECSV, CSV, FITS) with a column flux, in erg/s/cm²/Å or in the "
            "unit that it names, such as mag(AB)",
        )
        self.file.changed.connect(self.choose)
        self.distribution.changed.connect(self._show_rows)
        self._distribution_row = form.add("Fluxes", self.distribution)
        self._limits_row = form.add("F", self.limits.low, self.limits.high)
        self._slope_row = form.add("Slope α", self.slope)
        self._file_row = form.add("Flux table", self.file)

    def show(self, applies: bool) -> None:
        """Show the rows, or hide them where they do not apply."""
        self._applies = applies
        self._show_rows()

    def show_in(self, scale: FluxScale, label: str) -> None:
        """Convert the limits to another scale, with the unit's label."""
        self.limits.show_in(scale)
        self._form.relabel(self._limits_row, f"F ({label})")

    def options(self) -> dict[str, Any]:
        """Return arguments of `random_sources` and `star_cluster`.

        Raises
        ------
        ValueError
            If a field holds no valid number, or no table was chosen.
        """
        distribution = self.distribution.value
        if distribution == "table":
            if self._sample is None:
                raise ValueError('no flux table is chosen; press "Choose…" to choose one.')
            return {"flux_sample": self._sample}
        options = {"flux": self.limits.numbers, "flux_distribution": distribution}
        if distribution == "power":
            options["flux_slope"] = self.slope.number
        return options

    def choose(self, event: Any = None) -> None:
        """Ask for a table and read its fluxes; an error is shown and changes nothing."""
        path = self.ask_path()
        if path is None:
            return
        try:
            sample = read_fluxes(path)
            star_cluster(0, flux_sample=sample)
        except (OSError, ValueError) as error:
            show_error(str(error))
            return
        self._sample = sample
        button, count = self.file.native, f" ({len(sample)})"
        metrics = button.fontMetrics()
        room = button.width() - metrics.horizontalAdvance(count) - BUTTON_MARGIN
        name = metrics.elidedText(Path(path).name, Qt.TextElideMode.ElideMiddle, max(room, 60))
        # An ampersand would mark a key.
        self.file.text = name.replace("&", "&&") + count
        self.file.tooltip = f"{len(sample)} fluxes of {path}; press to choose another table"

    def ask_path(self) -> str | None:
        """Ask for the file to read; None if the user changed his mind."""
        pattern = " ".join(f"*{suffix}" for suffix in SUFFIXES)
        path, _ = QFileDialog.getOpenFileName(
            self._form, "Table of fluxes", "", f"Tables ({pattern})"
        )
        return path or None

    def _show_rows(self, event: Any = None) -> None:
        distribution = self.distribution.value
        for row, shown in (
            (self._distribution_row, True),
            (self._limits_row, distribution != "table"),
            (self._slope_row, distribution == "power"),
            (self._file_row, distribution == "table"),
        ):
            self._form.show_row(row, self._applies and shown)

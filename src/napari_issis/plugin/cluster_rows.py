"""The rows of a form that say how the stars of a cluster are distributed."""

from __future__ import annotations

from typing import Any

from magicgui.widgets import ComboBox

from ..cluster_profile import ClusterProfile
from .form import Form
from .number_field import NumberField
from .quantity_field import QuantityField
from .units import LengthScale

PROFILES = (("King", "king"), ("Plummer", "plummer"), ("Gaussian", "gaussian"))


class ClusterRows:
    """Profile, concentration, radius, ellipticity and position angle, in rows of a form.

    Parameters
    ----------
    form : Form
        The rows are added to it.
    """

    def __init__(self, form: Form) -> None:
        self._form = form
        self.profile = ComboBox(
            choices=list(PROFILES),
            tooltip="Projected density of the cluster: King (1962; ends at the tidal radius), "
            "Plummer (1911; never ends), or a Gaussian",
        )
        default = ClusterProfile()
        self.concentration = NumberField(
            "concentration",
            default.concentration,
            "King's concentration c, log₁₀ of tidal over core radius, 0 to 4; "
            "globular clusters have 0.5 to 2.5",
            check=lambda concentration: ClusterProfile(concentration=concentration),
        )
        self.radius = QuantityField(
            "radius",
            default.radius,
            "Projected half-number radius: semi-major axis of the ellipse that holds half of the "
            "stars",
            LengthScale(),
            check=lambda radius: ClusterProfile(radius=radius),
        )
        self.ellipticity = NumberField(
            "ellipticity of the cluster",
            default.ellipticity,
            "Ellipticity of the cluster, 1 − b/a, from 0 to below 1",
            check=lambda ellipticity: ClusterProfile(ellipticity=ellipticity),
        )
        self.pa = NumberField(
            "position angle of the cluster",
            default.pa,
            "Position angle of the cluster's major axis, degrees from up, counter-clockwise",
            check=lambda pa: ClusterProfile(pa=pa),
        )
        self._profile_row = form.add("Profile", self.profile, self.concentration)
        self._radius_row = form.add("Radius R½", self.radius)
        self._shape_row = form.add("ε, PA (°)", self.ellipticity, self.pa)
        self.profile.changed.connect(self._show_concentration)
        self._show_concentration()

    def show(self, applies: bool) -> None:
        """Show the rows, or hide them where they do not apply."""
        for row in (self._profile_row, self._radius_row, self._shape_row):
            self._form.show_row(row, applies)

    def show_in(self, scale: LengthScale, label: str) -> None:
        """Convert the radius to another scale, with the unit's label."""
        self.radius.show_in(scale)
        self._form.relabel(self._radius_row, f"Radius R½ ({label})")

    def options(self) -> dict[str, Any]:
        """Return arguments of `star_cluster`.

        Raises
        ------
        ValueError
            If a field holds no valid number.
        """
        options = {
            "profile": self.profile.value,
            "radius": self.radius.number,
            "ellipticity": self.ellipticity.number,
            "pa": self.pa.number,
        }
        if self.profile.value == "king":
            options["concentration"] = self.concentration.number
        return options

    def _show_concentration(self, event: Any = None) -> None:
        king = self.profile.value == "king"
        self.concentration.native.setVisible(king)
        self._form.relabel(self._profile_row, "Profile, c" if king else "Profile")

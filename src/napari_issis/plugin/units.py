"""What quantities are shown in: fluxes or AB magnitudes, pixels or arcsec."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from napari.utils.events import EmitterGroup, Event
from numpy.typing import ArrayLike, NDArray

from ..instruments import PIXEL_SCALE
from ..photometry import ab_magnitude, flux_of_ab_magnitude
from ..sources import BRIGHTEST

Array = NDArray[np.float64]

FLUX_LABELS = {"flux": "erg/s/cm²/Å", "AB mag": "AB mag"}
LENGTH_LABELS = {"px": "px", "arcsec": "″"}
# Fainter than a photon in the age of the universe.
FAINTEST_MAGNITUDE = 99.0


@dataclass(frozen=True)
class FluxScale:
    """Fluxes as numbers in a unit.

    Parameters
    ----------
    unit : {"flux", "AB mag"}
        erg s-1 cm-2 A-1, or AB magnitudes.
    pivot : float or ndarray
        Wavelength in angstrom of the AB magnitudes, that of `check_sources`.
    """

    unit: str = "flux"
    pivot: float | Array = 0.0

    def __post_init__(self) -> None:
        if self.unit == "flux":
            # Two scales of fluxes are equal, whatever the channel.
            object.__setattr__(self, "pivot", 0.0)

    def show(self, flux: ArrayLike) -> Array:
        """Return fluxes (erg s-1 cm-2 A-1) in the unit; a flux of 0 is infinitely faint."""
        values = np.asarray(flux, dtype=np.float64)
        return values if self.unit == "flux" else ab_magnitude(values, self.pivot)

    def show_one(self, flux: float) -> float:
        """Return one flux, rounded to six digits or, as a magnitude, to four decimals.

        Raises
        ------
        ValueError
            If a flux of 0 would have to become a magnitude.
        """
        if self.unit == "flux":
            return float(f"{flux:.6g}")
        if flux <= 0:
            raise ValueError(
                f"flux is {flux:g}, which has no AB magnitude; "
                f"type one, or choose {FLUX_LABELS['flux']} as the unit."
            )
        return round(float(self.show(flux)), 4)

    def read(self, number: float) -> float:
        """Return the flux in erg s-1 cm-2 A-1 of a number in the unit.

        Raises
        ------
        ValueError
            If the number is no magnitude that a source could have.
        """
        if self.unit == "flux":
            return number
        brightest = float(np.min(ab_magnitude(BRIGHTEST, self.pivot)))
        if not brightest <= number <= FAINTEST_MAGNITUDE:
            raise ValueError(
                f"AB magnitude is {number:g}; "
                f"it must be in [{brightest:.1f}, {FAINTEST_MAGNITUDE:g}]."
            )
        return float(flux_of_ab_magnitude(number, self.pivot))

    def text(self, flux: float) -> str:
        """Return a flux as a short text, without the unit."""
        shown = float(self.show(flux))
        if self.unit == "flux":
            return f"{shown:.3g}"
        return f"{shown:.2f}" if isfinite(shown) else "∞"


@dataclass(frozen=True)
class LengthScale:
    """Lengths as numbers in a unit.

    Parameters
    ----------
    unit : {"px", "arcsec"}
        The unit.
    pixel_scale : float
        Arcsec per pixel.
    """

    unit: str = "px"
    pixel_scale: float = PIXEL_SCALE

    def __post_init__(self) -> None:
        if self.unit == "px":
            object.__setattr__(self, "pixel_scale", 1.0)

    def show(self, pixels: ArrayLike) -> Array:
        """Return lengths (pixels) in the unit."""
        return np.asarray(np.asarray(pixels, dtype=np.float64) * self.pixel_scale)

    def show_one(self, pixels: float) -> float:
        """Return one length, rounded to six digits."""
        return float(f"{float(self.show(pixels)):.6g}")

    def read(self, number: float) -> float:
        """Return the pixels of a number in the unit."""
        return number / self.pixel_scale

    def text(self, pixels: float) -> str:
        """Return a length as a short text, without the unit."""
        return f"{float(self.show(pixels)):.4g}"


class Units:
    """The units of what is shown and typed; what is stored stays as it is.

    Parameters
    ----------
    flux : {"flux", "AB mag"}
        erg s-1 cm-2 A-1, or AB magnitudes at the channel's pivot wavelength.
    length : {"px", "arcsec"}
        Of radii; positions are always in pixels.

    Attributes
    ----------
    events : napari.utils.events.EmitterGroup
        ``changed`` after each change.

    Raises
    ------
    ValueError
        If a unit is unknown; the message lists the known ones.
    """

    def __init__(self, flux: str = "flux", length: str = "px") -> None:
        self.events = EmitterGroup(source=self, changed=Event)
        self._flux = _known("flux", flux, FLUX_LABELS)
        self._length = _known("length", length, LENGTH_LABELS)

    @property
    def flux(self) -> str:
        """``flux`` or ``AB mag``; can be set."""
        return self._flux

    @flux.setter
    def flux(self, unit: str) -> None:
        if _known("flux", unit, FLUX_LABELS) != self._flux:
            self._flux = unit
            self.events.changed()

    @property
    def length(self) -> str:
        """``px`` or ``arcsec``; can be set."""
        return self._length

    @length.setter
    def length(self, unit: str) -> None:
        if _known("length", unit, LENGTH_LABELS) != self._length:
            self._length = unit
            self.events.changed()

    @property
    def flux_label(self) -> str:
        """The unit of fluxes, as labels have it."""
        return FLUX_LABELS[self._flux]

    @property
    def length_label(self) -> str:
        """The unit of lengths, as labels have it."""
        return LENGTH_LABELS[self._length]

    def flux_scale(self, pivot: float | Array) -> FluxScale:
        """Return the scale of fluxes for a channel's pivot wavelength (angstrom)."""
        return FluxScale(self._flux, pivot)

    def length_scale(self, pixel_scale: float = PIXEL_SCALE) -> LengthScale:
        """Return the scale of lengths for a pixel scale (arcsec per pixel)."""
        return LengthScale(self._length, pixel_scale)

    def show_flux(self, flux: ArrayLike, pivot: float | Array) -> Array:
        """Return fluxes (erg s-1 cm-2 A-1) as shown; a magnitude of flux 0 is infinite."""
        return self.flux_scale(pivot).show(flux)

    def read_flux(self, number: float, pivot: float) -> float:
        """Return the flux (erg s-1 cm-2 A-1) of a number as shown.

        Raises
        ------
        ValueError
            If the number is no magnitude that a source could have.
        """
        return self.flux_scale(pivot).read(number)

    def flux_text(self, flux: float, pivot: float) -> str:
        """Return a flux (erg s-1 cm-2 A-1) as a short text, without the unit."""
        return self.flux_scale(pivot).text(flux)

    def show_length(self, pixels: ArrayLike, pixel_scale: float = PIXEL_SCALE) -> Array:
        """Return lengths (pixels) as shown."""
        return self.length_scale(pixel_scale).show(pixels)

    def read_length(self, number: float, pixel_scale: float = PIXEL_SCALE) -> float:
        """Return the pixels of a length as shown."""
        return self.length_scale(pixel_scale).read(number)

    def length_text(self, pixels: float, pixel_scale: float = PIXEL_SCALE) -> str:
        """Return a length (pixels) as a short text, without the unit."""
        return self.length_scale(pixel_scale).text(pixels)


def _known(quantity: str, unit: str, units: dict[str, str]) -> str:
    if unit not in units:
        raise ValueError(f"unit of {quantity} is {unit!r}; known: {', '.join(units)}.")
    return unit

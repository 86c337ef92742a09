"""What is observed with: channel, filters, exposure time, frame, PSF and sky."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import astropy.units as u
from astropy.coordinates import SkyCoord

from .instrument import CHANNELS, FILTERS, PIXEL_SCALE, Channel
from .psf import PSF

INSTRUMENTS = ("ISSIS",)
OPEN = ("open", "open")


@dataclass(frozen=True, eq=False)
class Observation:
    """An instrument set-up; immutable and hashable.

    Parameters
    ----------
    channel : {"NUV", "FUV"}
        The channel.
    filters : (str, str)
        One filter for each of the two wheels: ``open``, ``NF1`` or ``NF2``.
    exposure : float
        Exposure time, s.
    shape : (int, int)
        Frame ``(ny, nx)`` in pixels.
    psf : PSF, optional
        Replaces the channel's own, assumed, PSF.
    background : float, optional
        Sky at open-open in cps per pixel; replaces the channel's own. The filters reduce it.
    pointing : astropy.coordinates.SkyCoord, optional
        Sky position of the frame's centre.
    roll : float
        Angle from north to the frame's +y axis, counter-clockwise through east, degrees.
    instrument : str
        The instrument's name.

    Raises
    ------
    ValueError
        If a value is unknown or out of range; the message names it.
    """

    channel: str = "NUV"
    filters: tuple[str, str] = OPEN
    exposure: float = 100.0
    shape: tuple[int, int] = (512, 512)
    psf: PSF | None = None
    background: float | None = None
    pointing: SkyCoord | None = None
    roll: float = 0.0
    instrument: str = "ISSIS"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        if self.instrument not in INSTRUMENTS:
            raise ValueError(f"instrument is {self.instrument!r}; known: {', '.join(INSTRUMENTS)}.")
        if self.channel not in tuple(CHANNELS):
            raise ValueError(f"channel is {self.channel!r}; known: {', '.join(CHANNELS)}.")
        if not isinstance(self.filters, tuple | list) or len(self.filters) != 2:
            raise ValueError(
                f"filters is {self.filters!r}; give one filter for each of the two wheels, "
                'such as ("open", "NF1").'
            )
        set_(self, "filters", tuple(self.filters))
        for name in self.filters:
            if name not in tuple(FILTERS):
                raise ValueError(f"filter is {name!r}; known: {', '.join(FILTERS)}.")
        set_(self, "exposure", _number("exposure", self.exposure, "seconds", positive=True))
        set_(self, "shape", _shape(self.shape))
        if self.background is not None:
            set_(
                self,
                "background",
                _number("background", self.background, "cps per pixel", positive=False),
            )
        try:
            roll = float(u.Quantity(self.roll, u.deg).value)
        except (TypeError, ValueError):
            raise ValueError(f"roll is {self.roll!r}; it must be an angle in degrees.") from None
        if not isfinite(roll):
            raise ValueError(f"roll is {roll}; it must be a finite angle in degrees.")
        set_(self, "roll", roll)
        if self.psf is not None and not hasattr(self.psf, "otf_grid"):
            raise ValueError(
                f"psf is {self.psf!r}; give a TelescopePSF, GaussianPSF, MoffatPSF or ImagePSF."
            )
        if self.pointing is not None:
            if not isinstance(self.pointing, SkyCoord) or not self.pointing.isscalar:
                raise ValueError(f"pointing is {self.pointing!r}; give one SkyCoord.")
            if not (isfinite(self.pointing.icrs.ra.deg) and isfinite(self.pointing.icrs.dec.deg)):
                raise ValueError(f"pointing is {self.pointing!r}; it must be finite.")
            set_(self, "pointing", self.pointing.icrs)

    def replace(self, **changes: Any) -> Observation:
        """Return a copy with some values changed."""
        return replace(self, **changes)

    @property
    def channel_data(self) -> Channel:
        """The channel's numbers."""
        return CHANNELS[self.channel]

    @property
    def transmittance(self) -> float:
        """Product of the two filters' transmittances."""
        first, second = self.filters
        return FILTERS[first] * FILTERS[second]

    @property
    def cps_per_flux(self) -> float:
        """Count rate in cps of 1 erg s-1 cm-2 A-1, filters included."""
        return self.channel_data.cps_per_flux * self.transmittance

    @property
    def sky_rate(self) -> float:
        """Sky background in cps per pixel, filters included."""
        sky = self.channel_data.sky.total if self.background is None else self.background
        return sky * self.transmittance

    @property
    def effective_psf(self) -> PSF:
        """The PSF in use: the given one or the channel's own."""
        return self.channel_data.psf if self.psf is None else self.psf

    @property
    def psf_assumed(self) -> bool:
        """Whether the PSF in use is the channel's own, which is assumed."""
        return self.psf is None

    @property
    def pixel_scale(self) -> float:
        """Arcsec per pixel."""
        return PIXEL_SCALE

    def _key(self) -> tuple[object, ...]:
        position = None
        if self.pointing is not None:
            position = (float(self.pointing.ra.deg), float(self.pointing.dec.deg))
        return (
            self.channel,
            self.filters,
            self.exposure,
            self.shape,
            self.psf,
            self.background,
            position,
            self.roll,
            self.instrument,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Observation) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


def _number(name: str, value: Any, unit: str, *, positive: bool) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {value!r}; it must be a number of {unit}.") from None
    if not isfinite(number) or number < 0 or (positive and number == 0):
        least = "above zero" if positive else "zero or more"
        raise ValueError(f"{name} is {number}; it must be finite and {least} ({unit}).")
    return number


def _shape(shape: Any) -> tuple[int, int]:
    try:
        ny, nx = shape
    except (TypeError, ValueError):
        raise ValueError(f"shape is {shape!r}; give (ny, nx) in pixels.") from None
    for n in (ny, nx):
        if isinstance(n, bool) or not hasattr(n, "__index__") or not 1 <= n <= 16384:
            raise ValueError(f"shape is {shape!r}; sides are whole numbers from 1 to 16384.")
    return int(ny), int(nx)

"""What is observed with: channel, filters, exposure time, frame, PSF and sky."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import isfinite
from types import MappingProxyType
from typing import Any, cast

import astropy.units as u
from astropy.coordinates import SkyCoord

from .detector import IDEAL, Detector, checked_detector
from .filters import Filter
from .instrument import Channel, Instrument
from .instruments import instrument_named
from .passband import Passband
from .psf import PSF
from .sky import CIS, Sky, SkyModel
from .sky_tables import WAVELENGTH

OPEN = ("open", "open")


@dataclass(frozen=True, eq=False)
class Observation:
    """An instrument set-up; immutable and hashable.

    Parameters
    ----------
    channel : str, optional
        A channel of the instrument, by default its `Instrument.default_channel`; for ISSIS
        ``NUV`` (the default) or ``FUV``.
    filters : (str or Filter, str or Filter)
        One filter for each of the two wheels: ``open``, one of the instrument's by name (for
        ISSIS the neutral ``NF1`` and ``NF2``, and illustrative curves), or a `Filter`.
    exposure : float
        Exposure time, s.
    shape : (int, int)
        Frame ``(ny, nx)`` in pixels.
    psf : PSF, optional
        Replaces the channel's own, assumed, PSF.
    background : float, optional
        Sky at open-open in cps per pixel; replaces ``sky``. The filters reduce it as a flat
        spectrum.
    pointing : astropy.coordinates.SkyCoord, optional
        Sky position of the frame's centre.
    roll : float
        Angle from north to the frame's +y axis, counter-clockwise through east, degrees.
    instrument : str or Instrument
        The camera, or the name of one that comes with the program.
    sky : SkyModel, optional
        The sky by components: `napari_issis.sky.CIS`, the constants of the paper, or a
        `napari_issis.sky.Sky`. By default CIS where the instrument has such constants, and
        else ``Sky()``.
    dark : float, optional
        Counts of the detector itself, cps per pixel, which no filter reduces; by default the
        channel's (0 for ISSIS: none is published, and the paper has none).
    detector : Detector
        Coincidence loss and 16-bit rollover; none by default.

    Raises
    ------
    ValueError
        If a value is unknown or out of range, or the filters pass nothing of the channel; the
        message names it.

    Notes
    -----
    Two observations with the same ``background`` are equal whatever their ``sky``.
    """

    channel: str = ""
    filters: tuple[str | Filter, str | Filter] = OPEN
    exposure: float = 100.0
    shape: tuple[int, int] = (512, 512)
    psf: PSF | None = None
    background: float | None = None
    pointing: SkyCoord | None = None
    roll: float = 0.0
    instrument: Instrument = "ISSIS"  # type: ignore[assignment]
    # the instrument's own once the observation is made
    sky: SkyModel = None  # type: ignore[assignment]
    dark: float | None = None
    detector: Detector = IDEAL

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        camera = _camera(self.instrument)
        set_(self, "instrument", camera)
        if not self.channel:
            set_(self, "channel", camera.default_channel)
        if self.channel not in tuple(camera.channels):
            raise ValueError(f"channel is {self.channel!r}; known: {', '.join(camera.channels)}.")
        if not isinstance(self.filters, tuple | list) or len(self.filters) != 2:
            raise ValueError(
                f"filters is {self.filters!r}; give one filter for each of the two wheels, "
                'such as ("open", "NF1").'
            )
        set_(self, "filters", tuple(self.filters))
        for one in self.filters:
            if not isinstance(one, Filter) and one not in camera.filter_names:
                raise ValueError(
                    f"filter is {one!r}; known: {', '.join(camera.filter_names)}; or give a Filter."
                )
        if not self.passband.transmittance > 0:
            low, high = self.passband.band
            curves = self.passband.filters
            names = " and ".join(one.name for one in curves)
            raise ValueError(
                f"{names} {'pass' if len(curves) > 1 else 'passes'} nothing of {self.channel}, "
                f"{low:g} to {high:g} A; choose another filter or channel."
            )
        set_(self, "exposure", _number("exposure", self.exposure, "seconds", positive=True))
        set_(self, "shape", _shape(self.shape))
        if self.background is not None:
            set_(
                self,
                "background",
                _number("background", self.background, "cps per pixel", positive=False),
            )
        if self.dark is not None:
            set_(self, "dark", _number("dark", self.dark, "cps per pixel", positive=False))
        checked_detector(self.detector)
        if cast(object, self.sky) is None:
            set_(self, "sky", _default_sky(self.channel_data))
        if not isinstance(self.sky, SkyModel):
            raise ValueError(f"sky is {self.sky!r}; give a Sky, or one of SKIES by its key.")
        low, high = self.channel_data.band
        if (
            self.background is None
            and isinstance(self.sky, Sky)
            and not (WAVELENGTH[0] <= low and high <= WAVELENGTH[-1])
        ):
            raise ValueError(
                f"the sky is known from {WAVELENGTH[0]:g} to {WAVELENGTH[-1]:g} A, and "
                f"{self.channel} is {low:g} to {high:g} A; give background= in cps per pixel."
            )
        if self.sky == CIS and self.channel_data.sky is None:
            raise ValueError(
                f"sky is CIS, the constants of the paper, and {camera.name} has none; "
                'give a Sky, such as SKIES["HST average"].'
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
        """Return a copy with some values changed.

        With another instrument, its own channel, filters and sky take the place of those that
        it does not have, and a default sky gives way to the other's.
        """
        if "instrument" in changes:
            changes = {**self._kept_with(changes["instrument"], changes), **changes}
        return replace(self, **changes)

    def _kept_with(self, instrument: Any, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Replace what another camera lacks."""
        camera = _camera(instrument)
        channel = changes.get("channel", self.channel)
        if channel not in tuple(camera.channels):
            channel = camera.default_channel
        kept: dict[str, Any] = {"channel": channel}
        own = camera.channels[channel]
        if "filters" not in changes:
            kept["filters"] = tuple(
                one if passes(camera, channel, one) else OPEN[0] for one in self.filters
            )
        if self.sky == _default_sky(self.channel_data) or (own.sky is None and self.sky == CIS):
            kept["sky"] = None
        return kept

    @property
    def channel_data(self) -> Channel:
        """The channel's numbers."""
        return self.instrument.channels[self.channel]

    @property
    def filter_names(self) -> tuple[str, str]:
        """Names of the two filters."""
        first, second = self.filters
        return str(first), str(second)

    @property
    def neutral_transmittance(self) -> float:
        """Product of the neutral filters' transmittances; rates and sky scale with it."""
        neutral = self.instrument.neutral_filters
        first, second = (
            1.0 if isinstance(one, Filter) else neutral.get(one, 1.0) for one in self.filters
        )
        return first * second

    def without_neutral_filters(self) -> Observation:
        """Return a copy with the neutral filters out of the light path."""
        neutral = self.instrument.neutral_filters
        return self.replace(
            filters=tuple(
                "open" if not isinstance(one, Filter) and one in neutral else one
                for one in self.filters
            )
        )

    @property
    def passband(self) -> Passband:
        """The channel's response behind the filters that are curves."""
        named = self.instrument.filter_curves
        curves = tuple(
            one if isinstance(one, Filter) else named[one]
            for one in self.filters
            if isinstance(one, Filter) or one in named
        )
        return _passband(self.channel_data, curves)

    @property
    def transmittance(self) -> float:
        """Share of a flat spectrum's counts that the two filters pass."""
        return self.neutral_transmittance * self.passband.transmittance

    @property
    def cps_per_flux(self) -> float:
        """Count rate in cps of a flat spectrum of 1 erg s-1 cm-2 A-1, filters included."""
        return self.channel_data.cps_per_flux * self.transmittance

    @property
    def pivot(self) -> float:
        """Pivot wavelength of the channel behind the filters, angstrom."""
        return self.passband.pivot if self.passband.filters else self.channel_data.pivot

    @property
    def sky_rate(self) -> float:
        """Sky background in cps per pixel, filters included."""
        if self.background is not None:
            return self.background * self.transmittance
        rate, _ = _sky(self.sky, self.channel_data, self.passband)
        return rate * self.neutral_transmittance

    @property
    def dark_rate(self) -> float:
        """Count rate of the detector itself, cps per pixel: the given one or the channel's."""
        return self.channel_data.dark if self.dark is None else self.dark

    @property
    def background_rate(self) -> float:
        """Sky and dark rate together, cps per pixel."""
        return self.sky_rate + self.dark_rate

    @property
    def sky_components(self) -> Mapping[str, float]:
        """Sky background in cps per pixel, filters included, by the component's name."""
        if self.background is not None:
            return MappingProxyType({"background": self.sky_rate})
        _, components = _sky(self.sky, self.channel_data, self.passband)
        passed = self.neutral_transmittance
        return MappingProxyType({name: rate * passed for name, rate in components.items()})

    @property
    def effective_psf(self) -> PSF:
        """The PSF in use: the given one, or the channel's own in the band that is passed."""
        if self.psf is not None:
            return self.psf
        own = self.channel_data.psf
        return replace(own, band=self.passband.equivalent_band) if self.passband.filters else own

    @property
    def psf_assumed(self) -> bool:
        """Whether the PSF in use is the channel's own, which is assumed."""
        return self.psf is None

    @property
    def pixel_scale(self) -> float:
        """Arcsec per pixel."""
        return self.channel_data.pixel_scale

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
            self.sky if self.background is None else None,
            self.dark_rate,
            self.detector,
            position,
            self.roll,
            self.instrument,
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Observation) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())


@lru_cache(maxsize=64)
def _passband(channel: Channel, curves: tuple[Filter, ...]) -> Passband:
    return Passband(channel.band, channel.cps_per_flux, curves, channel.response)


def _default_sky(channel: Channel) -> SkyModel:
    return Sky() if channel.sky is None else CIS


@lru_cache(maxsize=64)
def _sky(sky: SkyModel, channel: Channel, passband: Passband) -> tuple[float, Mapping[str, float]]:
    return sky.rate(channel, passband), sky.components(channel, passband)


def _camera(instrument: Any) -> Instrument:
    return instrument if isinstance(instrument, Instrument) else instrument_named(instrument)


@lru_cache(maxsize=256)
def passes(camera: Instrument, channel: str, one: str | Filter) -> bool:
    """Whether a camera has a filter that passes light of a channel."""
    if not isinstance(one, Filter):
        if one in camera.neutral_filters:
            return True
        if one not in camera.filter_curves:
            return False
        one = camera.filter_curves[one]
    return _passband(camera.channels[channel], (one,)).transmittance > 0


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

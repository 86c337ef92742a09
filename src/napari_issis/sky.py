"""Sky background by components, behind the filters."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from .instrument import Channel, SkyConstants
from .passband import Passband
from .sky_tables import (
    EARTHSHINE,
    EARTHSHINE_HIGH,
    GALEX,
    GEOCORONA,
    LINES,
    LOWEST_LATITUDE,
    WAVELENGTH,
    ZODIACAL,
    ZODIACAL_HIGH,
    Array,
    Line,
    diffuse_photons,
)

# Wavelengths, angstrom, at which the paper must have taken its continuum: see `paper_estimate`.
PAPER_WAVELENGTHS = MappingProxyType({"FUV": 1400.0, "NUV": 2500.0})


@runtime_checkable
class SkyModel(Hashable, Protocol):
    """What an observation needs to know of a sky."""

    def components(self, channel: Channel, passband: Passband) -> Mapping[str, float]:
        """Count rates in cps per pixel, by the component's name."""

    def rate(self, channel: Channel, passband: Passband) -> float:
        """Count rate of all components, cps per pixel."""


@dataclass(frozen=True)
class Sky:
    """The sky as HST's handbooks have it, integrated over the band.

    Parameters
    ----------
    earthshine : {"none", "high orbit", "average", "high", "extreme"}
        0, 0.0094, 0.5, 1 or 2 times the earthshine 38 degrees from the Earth's bright limb.
        High orbit is HST's average, reduced as the Earth's solid angle.
    zodiacal : {"none", "low", "average", "high"}
        23.3, 22.7 or 22.1 mag arcsec-2 in V.
    geocorona : {"none", "high orbit", "low", "average", "high"}
        Strength of Ly-alpha, O I 1304, O I] 1356 and [O II] 2471. High orbit is 2 kR of
        Ly-alpha alone, which is assumed.
    galactic_latitude : float, optional
        Degrees, from 15 to 90 north or south: adds the diffuse galactic and extragalactic
        light there. Without it there is none, as in HST's handbooks.

    Raises
    ------
    ValueError
        If a level is unknown or the latitude out of range; the message names it.

    Notes
    -----
    Tables, levels and their sources are in `napari_issis.sky_tables`. The continuum is linear
    between the tables' wavelengths; the response is that of `napari_issis.passband.Passband`.
    """

    earthshine: str = "average"
    zodiacal: str = "average"
    geocorona: str = "average"
    galactic_latitude: float | None = None

    def __post_init__(self) -> None:
        for name, levels in (
            ("earthshine", EARTHSHINE),
            ("zodiacal", ZODIACAL),
            ("geocorona", GEOCORONA),
        ):
            level = getattr(self, name)
            if level not in tuple(levels):
                raise ValueError(f"{name} is {level!r}; known levels: {', '.join(levels)}.")
        if self.galactic_latitude is not None:
            object.__setattr__(self, "galactic_latitude", _latitude(self.galactic_latitude))

    def components(self, channel: Channel, passband: Passband) -> Mapping[str, float]:
        """Count rates in cps per pixel, by the component's name.

        A component that is switched off, or a line outside the channel, is left out; one
        that the filters block is 0.
        """
        rates = {}
        area = channel.pixel_scale**2  # arcsec2
        for name, share, high in (
            ("earthshine", EARTHSHINE[self.earthshine], EARTHSHINE_HIGH),
            ("zodiacal light", ZODIACAL[self.zodiacal], ZODIACAL_HIGH),
        ):
            if share:
                rates[name] = area * passband.continuum_rate(WAVELENGTH, share * high)
        if self.galactic_latitude is not None:
            photons = area * diffuse_photons(self.galactic_latitude)
            rates["diffuse galactic light"] = passband.photon_rate(GALEX, photons)
        low, high_ = channel.band
        for line in LINES:
            flux = line.flux(self.geocorona)
            if flux and low <= line.wavelength <= high_:
                rates[line.name] = passband.line_rate(area * flux, line.wavelength)
        return rates

    def rate(self, channel: Channel, passband: Passband) -> float:
        """Count rate of all components, cps per pixel."""
        return sum(self.components(channel, passband).values())


@dataclass(frozen=True)
class PaperSky:
    """The constants of the CIS paper, which are those of HST's sky in low orbit.

    Notes
    -----
    The paper prints two numbers for each channel: all, and earthshine with zodiacal light.
    The rest is the geocorona. Behind a filter with a response the two parts pass as their
    spectra do: average earthshine and zodiacal light over the band, and the lines of
    `paper_estimate` at their wavelengths.
    """

    def components(self, channel: Channel, passband: Passband) -> Mapping[str, float]:
        """Count rates in cps per pixel, by the component's name."""
        sky = _constants(channel)
        lines = continuum = 1.0
        if passband.filters:
            unfiltered = replace(passband, filters=())
            flux = _average_continuum()
            continuum = passband.continuum_rate(WAVELENGTH, flux)
            continuum /= unfiltered.continuum_rate(WAVELENGTH, flux)
            low, high = channel.band
            seen = [line for line in LINES if low <= line.wavelength <= high]
            lines = continuum
            if seen:
                lines = _strength(seen, passband) / _strength(seen, unfiltered)
        return {
            "geocorona": sky.geocorona * lines,
            "earthshine and zodiacal light": sky.earthshine_and_zodiacal * continuum,
        }

    def rate(self, channel: Channel, passband: Passband) -> float:
        """Count rate of all components, cps per pixel; without filters the paper's constant."""
        if not passband.filters:
            return _constants(channel).total
        return sum(self.components(channel, passband).values())


def paper_estimate(channel: Channel) -> dict[str, float]:
    """Sky of a channel of ISSIS in the way that gives the paper's numbers, cps per pixel.

    The paper does not say how it came by them. They follow within 3 % from average earthshine
    and zodiacal light taken at one wavelength, 1400 or 2500 A, and from the high fluxes of the
    geocoronal lines, each counted as a flux spread evenly over the band.
    """
    at = PAPER_WAVELENGTHS[channel.name] == WAVELENGTH
    area = channel.pixel_scale**2
    low, high = channel.band
    lines = sum(line.high for line in LINES if low <= line.wavelength <= high) / (high - low)
    return {
        "geocorona": lines * channel.cps_per_flux * area,
        "earthshine and zodiacal light": (
            float(_average_continuum()[at][0]) * channel.cps_per_flux * area
        ),
    }


def _average_continuum() -> Array:
    return EARTHSHINE["average"] * EARTHSHINE_HIGH + ZODIACAL["average"] * ZODIACAL_HIGH


def _strength(lines: Iterable[Line], passband: Passband) -> float:
    return sum(line.high * float(passband.relative_response(line.wavelength)) for line in lines)


def _constants(channel: Channel) -> SkyConstants:
    if channel.sky is None:
        raise ValueError(f"channel {channel.name} has no constants of the sky; give a Sky.")
    return channel.sky


def _latitude(value: float) -> float:
    try:
        latitude = float(value)
    except (TypeError, ValueError):
        raise ValueError(f"galactic_latitude is {value!r}; give degrees.") from None
    if not (isfinite(latitude) and LOWEST_LATITUDE <= abs(latitude) <= 90):
        raise ValueError(
            f"galactic_latitude is {latitude}; the diffuse light is known from "
            f"{LOWEST_LATITUDE:g} to 90 degrees north or south of the plane."
        )
    return latitude


CIS = PaperSky()
HIGH_ORBIT = Sky("high orbit", "average", "high orbit", galactic_latitude=90.0)
SKIES: Mapping[str, SkyModel] = MappingProxyType(
    {
        "CIS": CIS,
        "HST low": Sky("none", "low", "low"),
        "HST average": Sky(),
        "HST high": Sky("high", "high", "high"),
        "high orbit": HIGH_ORBIT,
    }
)

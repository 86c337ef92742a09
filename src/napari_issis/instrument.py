"""An instrument as data: channels, filters, limits and PSF, each number with its source."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import log, sqrt

import numpy as np

from .facts import Fact, check_numbers, number
from .filter_set import NamedFilter, NeutralFilter
from .filters import Filter
from .passband import HC, Passband
from .psf import BROADEST, WIDEST, TelescopePSF

OPEN = "open"


@dataclass(frozen=True)
class SkyConstants:
    """The paper's sky background at open-open, count rates in cps per pixel.

    The paper prints the total and the sum of earthshine and zodiacal light; the geocorona is
    the difference of the two.
    """

    total: float
    earthshine_and_zodiacal: float

    @property
    def geocorona(self) -> float:
        """Geocoronal emission, cps per pixel."""
        return self.total - self.earthshine_and_zodiacal


@dataclass(frozen=True)
class Channel:
    """One channel of a camera; immutable and hashable.

    Attributes
    ----------
    name : str
        The channel's name.
    band : (float, float)
        Spectral range in angstrom.
    pixel_scale : float
        Arcsec per pixel.
    detector_size : (int, int)
        Pixels of the detector, ``(ny, nx)``.
    frame_sizes : tuple of int
        Sides in pixels of the square frames that the instrument panel offers.
    diameter : float
        Clear aperture, m.
    obscuration : float
        Linear central obscuration, 0 to below 1.
    cps_per_flux : float
        Count rate in cps of a flat spectrum of 1 erg s-1 cm-2 A-1 at open-open. Without it
        that of the effective area.
    effective_area : tuple of float
        In cm2: one number, constant over the band, or those at ``area_wavelength``, linear in
        between. With one alone, or none, the shape of the area over the band is constant.
    area_wavelength : tuple of float
        Wavelengths of the effective area, angstrom, rising.
    blur_fwhm, jitter_fwhm, halo_share, halo_fwhm : float
        Of the PSF that is used when an observation names no other one, see `TelescopePSF`.
    sky_total, sky_earthshine_and_zodiacal : float or None
        Constants of the sky at open-open, cps per pixel; see `SkyConstants`.
    dark : float
        Count rate of the detector itself, cps per pixel.
    local_limit, total_limit : float or None
        Count rates in cps, per pixel and over the detector, above which it is no longer
        linear; None where it always is.
    dead_time : float or None
        Time in s for which a pixel is blind after a count, which an observation has only if
        asked for; see `Detector`.
    facts : mapping of str to Fact
        Unit, status and source of these numbers.
    """

    name: str
    band: tuple[float, float] = number("Angstrom", low=10, high=1e5, count=2, rising=True)
    pixel_scale: float = number("arcsec / pix", high=100, above=True)
    detector_size: tuple[int, int] = number("pix", low=1, high=65536, count=2, whole=True)
    diameter: float = number("m", high=WIDEST, above=True)
    obscuration: float = number(default=0.0, high=0.99)
    frame_sizes: tuple[int, ...] = number(
        "pix", default=(), low=1, high=16384, count=None, rising=True, whole=True
    )
    cps_per_flux: float = number("ct cm2 Angstrom / erg", default=0.0, high=1e25, above=True)
    effective_area: tuple[float, ...] = number("cm2", default=(), high=1e8, count=None)
    area_wavelength: tuple[float, ...] = number(
        "Angstrom", default=(), low=10, high=1e5, count=None, rising=True
    )
    blur_fwhm: float = number("arcsec", default=0.0, high=BROADEST)
    jitter_fwhm: float = number("arcsec", default=0.0, high=BROADEST)
    halo_share: float = number(default=0.0)
    halo_fwhm: float = number("arcsec", default=0.0, high=BROADEST)
    sky_total: float | None = number("ct / (s pix)", default=None, high=1e9)
    sky_earthshine_and_zodiacal: float | None = number("ct / (s pix)", default=None, high=1e9)
    dark: float = number("ct / (s pix)", default=0.0, high=1e9)
    local_limit: float | None = number("ct / (s pix)", default=None, high=1e12, above=True)
    total_limit: float | None = number("ct / s", default=None, high=1e15, above=True)
    dead_time: float | None = number("s", default=None, high=1e3, above=True)
    facts: Mapping[str, Fact] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_numbers(self)
        if not self.frame_sizes:
            object.__setattr__(self, "frame_sizes", (min(self.detector_size),))
        if max(self.frame_sizes) > max(self.detector_size):
            raise ValueError(
                f"frame_sizes: value has {max(self.frame_sizes)}, and the longer side of the "
                f"detector has {max(self.detector_size)} pixels (detector_size)."
            )
        self._check_area()
        if (self.sky_total is None) != (self.sky_earthshine_and_zodiacal is None):
            raise ValueError(
                "sky_total and sky_earthshine_and_zodiacal go together: give both or neither."
            )
        if self.sky_total is not None and self.sky.geocorona < 0:  # type: ignore[union-attr]
            raise ValueError(
                f"sky_earthshine_and_zodiacal: value is {self.sky_earthshine_and_zodiacal:g}, "
                f"more than the whole sky (sky_total, {self.sky_total:g})."
            )
        # what is wrong with the halo is told now rather than with the first image
        _ = self.psf

    def _check_area(self) -> None:
        area, wavelength = self.effective_area, self.area_wavelength
        if not area and not self.cps_per_flux:
            raise ValueError("cps_per_flux is missing; give it or effective_area.")
        if len(area) != max(len(wavelength), min(len(area), 1)):
            raise ValueError(
                f"effective_area: value has {len(area)} numbers and area_wavelength "
                f"{len(wavelength)}; give as many of both, or one area without a wavelength."
            )
        if not area:
            return
        low, high = self.band
        if len(area) > 1 and not (wavelength[0] <= low and wavelength[-1] >= high):
            raise ValueError(
                f"area_wavelength: value reaches from {wavelength[0]:g} to {wavelength[-1]:g} A; "
                f"it must hold the band, {low:g} to {high:g} A."
            )
        if not max(area) > 0:
            raise ValueError("effective_area: value is 0 throughout; nothing would be counted.")
        shape = Passband(self.band, 1.0, response=self.response).unfiltered_moment
        if not shape > 0:
            raise ValueError("effective_area: value is 0 over the band (band).")
        derived = max(area) * shape / HC
        if self.cps_per_flux and abs(self.cps_per_flux / derived - 1) > 1e-9:
            raise ValueError(
                f"cps_per_flux: value is {self.cps_per_flux:g}, and effective_area gives "
                f"{derived:g}; give one of the two."
            )
        object.__setattr__(self, "cps_per_flux", derived)
        unit = "ct cm2 Angstrom / erg"
        fact = Fact(derived, unit, "derived", "from effective_area, for a flat spectrum")
        object.__setattr__(self, "facts", {**self.facts, "cps_per_flux": fact})

    @cached_property
    def response(self) -> Filter | None:
        """Effective area over its largest value; None where it is constant over the band."""
        if len(self.effective_area) < 2:
            return None
        area = np.array(self.effective_area)
        return Filter("effective area", np.array(self.area_wavelength), area / area.max())

    @property
    def sky(self) -> SkyConstants | None:
        """The constants of the paper's sky at open-open; None where there are none."""
        if self.sky_total is None or self.sky_earthshine_and_zodiacal is None:
            return None
        return SkyConstants(self.sky_total, self.sky_earthshine_and_zodiacal)

    @cached_property
    def psf(self) -> TelescopePSF:
        """The PSF used when an observation names no other one."""
        band = self.band
        if self.response is not None:
            band = Passband(band, self.cps_per_flux, response=self.response).equivalent_band
        return TelescopePSF(
            self.diameter,
            self.obscuration,
            band=band,
            blur_fwhm=self.blur_fwhm,
            jitter_fwhm=self.jitter_fwhm,
            halo_share=self.halo_share,
            halo_fwhm=self.halo_fwhm,
        )

    @property
    def pivot(self) -> float:
        """Pivot wavelength without filters, angstrom.

        For response 1, lambda_p^2 = int R lambda dlambda / int R dlambda / lambda
        (Bessell & Murphy 2012, PASP 124, 140, eq. A15).
        """
        if self.response is not None:
            return Passband(self.band, self.cps_per_flux, response=self.response).pivot
        low, high = self.band
        return sqrt(0.5 * (high**2 - low**2) / log(high / low))

    def __hash__(self) -> int:
        return hash((self.name, self.band, self.cps_per_flux, self.pixel_scale, self.blur_fwhm))


@dataclass(frozen=True)
class Instrument:
    """A camera: its channels, and the filters that its wheels can hold.

    Attributes
    ----------
    name : str
        The name, as FITS headers have it.
    channels : mapping of str to Channel
        The channels by name.
    filters : mapping of str to NamedFilter
        The filters by name, beside ``open``; see `napari_issis.filter_set`.
    telescope : str
        The telescope's name.
    default_channel : str
        The channel of observations that name none; the first one unless given.
    psf_note, filter_note : str
        Sentences on the PSF and on illustrative filters, for FITS headers and tooltips.
    limits_note : str
        Of what detector the count-rate limits are, as warnings call it.
    sources : mapping of str to str
        What the short names of sources stand for.

    Notes
    -----
    Two instruments with the same name, numbers and filters are equal, wherever the numbers
    come from.
    """

    name: str
    channels: Mapping[str, Channel]
    filters: Mapping[str, NamedFilter] = field(default_factory=dict)
    telescope: str = ""
    default_channel: str = ""
    psf_note: str = field(default="", compare=False)
    filter_note: str = field(default="", compare=False)
    limits_note: str = field(default="", compare=False)
    sources: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not self.channels:
            raise ValueError("an instrument needs a channel; give one in [channels.NAME].")
        if len({one.sky is None for one in self.channels.values()}) > 1:
            raise ValueError("sky_total: some channels have it and some not; give all or none.")
        if not self.default_channel:
            object.__setattr__(self, "default_channel", next(iter(self.channels)))
        if self.default_channel not in self.channels:
            raise ValueError(
                f"default_channel is {self.default_channel!r}; known: {', '.join(self.channels)}."
            )

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Instrument:
        """Read an instrument; see `napari_issis.instrument_file.read_instrument`."""
        from .instrument_file import read_instrument

        return read_instrument(path)

    def write(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write the instrument to a file that `read` reads.

        Raises
        ------
        OSError
            If the file cannot be written; `FileExistsError` if it exists.
        ValueError
            If the name does not end in ``.toml``.
        """
        from .instrument_text import instrument_text
        from .safe_write import replacing

        with replacing(path, (".toml",), overwrite=overwrite) as file:
            file.write(instrument_text(self).encode())

    @cached_property
    def neutral_filters(self) -> Mapping[str, float]:
        """Transmittance of open (1) and the neutral filters, by name."""
        own = self.filters.values()
        neutral = {one.name: one.transmittance for one in own if isinstance(one, NeutralFilter)}
        return {OPEN: 1.0, **neutral}

    @cached_property
    def filter_curves(self) -> Mapping[str, Filter]:
        """The filters that are curves, by name."""
        own = self.filters.values()
        return {one.name: one.curve for one in own if not isinstance(one, NeutralFilter)}

    @property
    def filter_names(self) -> tuple[str, ...]:
        """Names of all filters, open first, then the neutral ones."""
        return (*self.neutral_filters, *self.filter_curves)

    def is_illustrative(self, name: str) -> bool:
        """Whether a filter was made up to show what such a filter does."""
        return name in self.filters and self.filters[name].illustrative

    def __str__(self) -> str:
        return self.name

    def __hash__(self) -> int:
        return hash((self.name, *self.channels.values()))

"""The filters that an instrument's wheels can hold: neutral ones, and curves by a few numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from .facts import Fact, check_numbers, facts_of, number
from .filters import Filter

# Where long-pass filters end, angstrom: beyond every band.
FAR_END = 1e5


@dataclass(frozen=True)
class _Named:
    name: str

    def __post_init__(self) -> None:
        check_numbers(self)

    @property
    def illustrative(self) -> bool:
        """Whether it was made up to show what such a filter does."""
        return any(one.status == "illustrative" for one in facts_of(self).values())


@dataclass(frozen=True)
class NeutralFilter(_Named):
    """A filter that passes the same share at all wavelengths."""

    transmittance: float = number(low=0.0, above=True)
    facts: Mapping[str, Fact] = field(default_factory=dict, compare=False, repr=False)


@dataclass(frozen=True)
class NarrowBand(_Named):
    """A Gaussian narrow-band filter.

    Attributes
    ----------
    centre, fwhm : float
        Central wavelength and full width at half maximum, angstrom.
    peak : float
        Largest transmission.
    """

    centre: float = number("Angstrom", low=10, high=1e5)
    fwhm: float = number("Angstrom", high=1e4, above=True)
    peak: float = number(above=True)
    facts: Mapping[str, Fact] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.centre <= 2.5 * self.fwhm:
            raise ValueError(
                f"fwhm: value is {self.fwhm:g}; it must be below 0.4 of the centre, "
                f"{self.centre:g} A, or the filter would reach wavelength 0."
            )

    @cached_property
    def curve(self) -> Filter:
        """The curve."""
        offset = np.linspace(-2.5, 2.5, 81)
        transmission = self.peak * np.exp(-4 * np.log(2) * offset**2)
        return Filter(self.name, self.centre + self.fwhm * offset, transmission)


@dataclass(frozen=True)
class LongPass(_Named):
    """A long-pass filter.

    Attributes
    ----------
    edge : float
        Wavelength of half the largest transmission, angstrom.
    width : float
        Range over which the transmission rises linearly from 0, angstrom.
    peak : float
        Transmission beyond.
    """

    edge: float = number("Angstrom", low=10, high=5e4)
    width: float = number("Angstrom", high=1e4, above=True)
    peak: float = number(above=True)
    facts: Mapping[str, Fact] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.width >= 2 * self.edge:
            raise ValueError(
                f"width: value is {self.width:g}; it must be below twice the edge, "
                f"{self.edge:g} A, or the filter would reach wavelength 0."
            )

    @cached_property
    def curve(self) -> Filter:
        """The curve."""
        wavelength = np.array([self.edge - self.width / 2, self.edge + self.width / 2, FAR_END])
        return Filter(self.name, wavelength, np.array([0.0, self.peak, self.peak]))


@dataclass(frozen=True)
class CurveFilter(_Named):
    """A filter given by samples of its transmission, linear in between, 0 outside them.

    Attributes
    ----------
    wavelength : tuple of float
        In angstrom, rising.
    transmission : tuple of float
        As many.
    """

    wavelength: tuple[float, ...] = number("Angstrom", low=1, high=1e6, count=None, rising=True)
    transmission: tuple[float, ...] = number(count=None)
    facts: Mapping[str, Fact] = field(default_factory=dict, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        # it says what is wrong with a curve
        _ = self.curve

    @cached_property
    def curve(self) -> Filter:
        """The curve."""
        return Filter(self.name, np.array(self.wavelength), np.array(self.transmission))


NamedFilter = NeutralFilter | NarrowBand | LongPass | CurveFilter
FILTER_KINDS = (NeutralFilter, NarrowBand, LongPass, CurveFilter)

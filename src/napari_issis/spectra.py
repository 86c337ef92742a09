"""Spectra of sources: shapes in wavelength, and the text that names them in a source table."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .extinction import EXTINCTION_RANGE, transmitted
from .spectrum_curves import curve_stamp, read_spectrum_curve

Array = NDArray[np.float64]

# Second radiation constant h c / k, angstrom K (SI 2019, exact to the digits given).
C2 = 1.438776877e8
SIGMA_OF_FWHM = 1 / np.sqrt(8 * np.log(2))
# Pieces of an emission line's profile for integrals end at these multiples of its FWHM: beyond
# the last it is below 1e-50 of its peak.
LINE_KNOTS = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.5)
LONGEST = 1e7
LONGEST_TEXT = 1000
LARGEST_REDSHIFT = 30.0
LARGEST_EBV = 10.0

KNOWN = 'flat, powerlaw(-1.5), blackbody(30000 K), line(1550 A, 10 A), table("star.ecsv")'
OPTIONS = "z, ebv and at, such as z=1.7, ebv=0.05, at=1500"
_CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*(?:\((.*)\))?\s*", re.DOTALL)
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)")
_UNITS = {"K": ("K",), "A": ("A", "AA", "Angstrom", "angstrom"), "": ()}


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """What all spectra have; use one of its kinds.

    Parameters
    ----------
    z : float
        Redshift, -0.5 to 30: the shape is taken at the wavelength over 1 + z.
    ebv : float
        Reddening E(B-V) in magnitudes, 0 to 10, by dust of the Milky Way in front of the source:
        Fitzpatrick (1999, PASP 111, 63) with R_V = 3.1.
    at : float, optional
        Observed wavelength in angstrom at which the flux of the source table is the flux density.
        Without it that is the mean flux density over the channel's band.

    Raises
    ------
    ValueError
        If a value is out of range; the message names it.
    ImportError
        If there is reddening and ``dust_extinction`` is not installed.

    Notes
    -----
    The flux of the source table is what arrives, redshifted and reddened: ``z`` and ``ebv`` change
    the shape of the spectrum only.
    """

    name: ClassVar[str] = ""

    z: float = 0.0
    ebv: float = 0.0
    at: float | None = None

    def __post_init__(self) -> None:
        _check("z", self.z, -0.5, LARGEST_REDSHIFT)
        _check("ebv", self.ebv, 0.0, LARGEST_EBV)
        if self.at is not None:
            low, high = (10.0, LONGEST) if self.ebv == 0 else EXTINCTION_RANGE
            _check("at", self.at, low, high, "A" if self.ebv == 0 else "A with reddening")
        if self.ebv > 0:
            # tells early what is not installed
            transmitted([2500.0], self.ebv)

    def __call__(self, wavelength: ArrayLike) -> Array:
        """Flux density per wavelength, in no particular unit.

        Parameters
        ----------
        wavelength : array_like
            Observed wavelengths, angstrom.

        Returns
        -------
        ndarray
            Of the same shape.
        """
        wavelength = np.asarray(wavelength, dtype=np.float64)
        value = self.emitted(wavelength / (1 + self.z))
        return value * transmitted(wavelength, self.ebv) if self.ebv > 0 else value

    def __str__(self) -> str:
        arguments = [*self.arguments(), *self._options()]
        return f"{self.name}({', '.join(arguments)})" if arguments else self.name

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust, in no particular unit."""
        raise NotImplementedError

    def arguments(self) -> list[str]:
        """Text of the values that only this kind of spectrum has."""
        raise NotImplementedError

    def knots(self) -> Array:
        """Observed wavelengths, angstrom, between which the spectrum is smooth."""
        return np.empty(0)

    @property
    def flux_at(self) -> float | None:
        """Wavelength at which the flux is given, angstrom; None for the channel's band."""
        return self.at

    @property
    def stamp(self) -> tuple[int, ...]:
        """Changes where the spectrum does although it equals itself, as a file's."""
        return ()

    def _options(self) -> list[str]:
        options = [("z", self.z), ("ebv", self.ebv)]
        texts = [f"{name}={_text(value)}" for name, value in options if value != 0]
        return texts if self.at is None else [*texts, f"at={_text(self.at)}"]


@dataclass(frozen=True)
class Flat(Spectrum):
    """A constant flux density per wavelength: the paper's spectrum, and the default."""

    name: ClassVar[str] = "flat"

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust."""
        return np.ones_like(wavelength)

    def arguments(self) -> list[str]:
        """Text of this kind's own values."""
        return []


@dataclass(frozen=True)
class PowerLaw(Spectrum):
    """A flux density per wavelength that is a power of the wavelength.

    Parameters
    ----------
    index : float
        Of F_lambda, -10 to 10. F_nu is then a power of the frequency with -2 - ``index``.
    """

    name: ClassVar[str] = "powerlaw"

    index: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _check("index", self.index, -10.0, 10.0)

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust."""
        return np.asarray((wavelength / 2000.0) ** self.index)

    def arguments(self) -> list[str]:
        """Text of this kind's own values."""
        return [_text(self.index)]


@dataclass(frozen=True)
class BlackBody(Spectrum):
    """Planck's law.

    Parameters
    ----------
    temperature : float
        1000 to 1e9 K.
    """

    name: ClassVar[str] = "blackbody"

    temperature: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _check("temperature", self.temperature, 1e3, 1e9, "K")

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust."""
        x = C2 / (wavelength * self.temperature)
        # 1 / (exp(x) - 1) without overflow
        return np.asarray((wavelength / 2000.0) ** -5.0 * np.exp(-x) / -np.expm1(-x))

    def arguments(self) -> list[str]:
        """Text of this kind's own values."""
        return [f"{_text(self.temperature)} K"]


@dataclass(frozen=True)
class Line(Spectrum):
    """An emission line with a Gaussian profile.

    Its flux in the source table is the flux density at the peak, unless ``at`` says otherwise;
    `line_flux` converts.

    Parameters
    ----------
    wavelength : float
        Of the peak at rest, 10 to 1e7 A.
    fwhm : float
        Full width at half maximum at rest, A; at least 0.01, at most half of the wavelength.
    """

    name: ClassVar[str] = "line"

    wavelength: float
    fwhm: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _check("wavelength", self.wavelength, 10.0, LONGEST, "A")
        _check("fwhm", self.fwhm, 0.01, 0.5 * self.wavelength, "A")
        low, high = EXTINCTION_RANGE
        if self.ebv > 0 and self.at is None and not low <= self.flux_at <= high:
            raise ValueError(
                f"the line at {self.flux_at:g} A cannot be reddened: the extinction curve runs "
                f"from {low:g} to {high:g} A; leave ebv out."
            )
        if (
            self.at is not None
            and not float(self.emitted(np.asarray(self.at / (1 + self.z)))) > 1e-6
        ):
            raise ValueError(
                f"the line has hardly any light at {self.at:g} A, and its peak at "
                f"{self.wavelength * (1 + self.z):g} A; give another at, or none for the peak."
            )

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust."""
        sigma = self.fwhm * SIGMA_OF_FWHM
        return np.asarray(np.exp(-0.5 * ((wavelength - self.wavelength) / sigma) ** 2))

    def arguments(self) -> list[str]:
        """Text of this kind's own values."""
        return [f"{_text(self.wavelength)} A", f"{_text(self.fwhm)} A"]

    def knots(self) -> Array:
        """Observed wavelengths, angstrom, between which the spectrum is smooth."""
        steps = self.fwhm * np.array(LINE_KNOTS)
        rest = self.wavelength + np.concatenate([-steps[:0:-1], steps])
        return np.asarray(rest * (1 + self.z))

    @property
    def flux_at(self) -> float:
        """Observed wavelength at which the flux is given, angstrom."""
        return self.wavelength * (1 + self.z) if self.at is None else self.at

    def peak_of(self, line_flux: float) -> float:
        """Flux for the source table of a line of ``line_flux`` erg s-1 cm-2, observed.

        erg s-1 cm-2 A-1, with no ``at``: the area of a Gaussian is its peak times
        sqrt(2 pi) sigma.
        """
        return float(line_flux / (np.sqrt(2 * np.pi) * SIGMA_OF_FWHM * self.fwhm * (1 + self.z)))


@dataclass(frozen=True)
class TableSpectrum(Spectrum):
    """A spectrum in a file, linear between its samples and 0 outside them.

    Parameters
    ----------
    path : str
        An ECSV, CSV or FITS table with columns ``wavelength`` (with a unit) and ``flux``, per
        wavelength if it has no unit; see `napari_issis.filter_file.read_curve`. A relative path
        is one from the working directory. Where there is no such file, the curve that a FITS
        file with a scene brought along serves instead.

    Raises
    ------
    ValueError
        If the file cannot be read or holds no spectrum; the message names it.
    """

    name: ClassVar[str] = "table"

    path: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.path or '"' in self.path or not self.path.isprintable():
            raise ValueError(f'the file is {self.path!r}; give its name, without ".')
        wavelength, _ = self._curve
        if self.at is not None and not float(self(self.at)) > 0:
            raise ValueError(
                f"{self.path} has no light at {self.at:g} A; it runs from "
                f"{wavelength[0] * (1 + self.z):g} to {wavelength[-1] * (1 + self.z):g} A."
            )

    @property
    def _curve(self) -> tuple[Array, Array]:
        return read_spectrum_curve(self.path, self.stamp)

    @property
    def stamp(self) -> tuple[int, ...]:
        """Time of change and size of the file, or a checksum of what is kept of it."""
        return curve_stamp(self.path)

    def emitted(self, wavelength: Array) -> Array:
        """Flux density before redshift and dust."""
        at, flux = self._curve
        return np.asarray(np.interp(wavelength, at, flux, left=0.0, right=0.0))

    def arguments(self) -> list[str]:
        """Text of this kind's own values."""
        return [f'"{self.path}"']

    def knots(self) -> Array:
        """Observed wavelengths, angstrom, between which the spectrum is smooth."""
        return np.asarray(self._curve[0] * (1 + self.z))


KINDS: dict[str, tuple[Callable[..., Spectrum], tuple[tuple[str, str], ...]]] = {
    "flat": (Flat, ()),
    "powerlaw": (PowerLaw, (("index", ""),)),
    "blackbody": (BlackBody, (("temperature", "K"),)),
    "line": (Line, (("wavelength", "A"), ("fwhm", "A"))),
    "table": (TableSpectrum, (("path", ""),)),
}


def parse_spectrum(text: str) -> Spectrum:
    """Read a spectrum from the text that a source table holds.

    Parameters
    ----------
    text : str
        Such as ``flat``, ``powerlaw(-1.5, z=1.7, ebv=0.05)``, ``blackbody(30000 K)``,
        ``line(1550 A, 10 A)`` or ``table("star.ecsv", at=1500)``. Units may be left out; no text
        is the flat spectrum. ``str`` of a spectrum is such a text, with all digits.

    Raises
    ------
    ValueError
        If it is no such text, or a value is out of range; the message says what is allowed.
    ImportError
        If there is reddening and ``dust_extinction`` is not installed.
    """
    if not text.strip():
        return FLAT
    if len(text) > LONGEST_TEXT:
        raise ValueError(f"it has {len(text)} characters; {LONGEST_TEXT} at most.")
    match = _CALL.fullmatch(text)
    if match is None or match[1].lower() not in KINDS:
        raise ValueError(f"{text[:60]!r} is unknown; known: {KNOWN}.")
    kind, names = KINDS[match[1].lower()]
    try:
        return kind(**_arguments(match[2] or "", names))
    except ValueError as error:
        raise ValueError(f"{text[:60]!r}: {error}") from None


def table_file(text: str) -> str | None:
    """Return the file that the text of a spectrum names, which is not read; None for others."""
    match = _CALL.fullmatch(text)
    if match is None or match[1].lower() != TableSpectrum.name:
        return None
    return str(_arguments(match[2] or "", KINDS[TableSpectrum.name][1])["path"])


def with_table_file(text: str, path: str) -> str:
    """Return the text of a spectrum from a file with another file in its place."""
    match = _CALL.fullmatch(text)
    assert match is not None
    options = _arguments(match[2] or "", KINDS[TableSpectrum.name][1])
    del options["path"]
    return (
        ", ".join(
            [
                f'table("{path}"',
                *(f"{name}={_text(float(value))}" for name, value in options.items()),
            ]
        )
        + ")"
    )


def _arguments(text: str, names: tuple[tuple[str, str], ...]) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    options = {"z": "", "ebv": "", "at": "A"}
    parts = _split(text) if text.strip() else []
    if not all(part.strip() for part in parts):
        raise ValueError("a value is missing beside a comma.")
    place = 0
    for part in parts:
        option = re.fullmatch(r"\s*([A-Za-z_]\w*)\s*=(.*)", part, re.DOTALL)
        if option is not None:
            name, value = option[1], option[2]
            if name not in options and name not in dict(names):
                raise ValueError(f"{name} is unknown; known: {OPTIONS}.")
            unit = {**options, **dict(names)}[name]
        elif place < len(names):
            (name, unit), value = names[place], part
            place += 1
        else:
            raise ValueError(f"{part.strip()[:40]!r} is too much; options are {OPTIONS}.")
        if name in found:
            raise ValueError(f"{name} is given twice.")
        found[name] = _path(value) if name == "path" else _number(name, value, unit)
    for name, unit in names:
        if name not in found:
            raise ValueError(f"{name} is missing{f' ({unit})' if unit else ''}.")
    return found


def _split(text: str) -> list[str]:
    """Parts between commas, but for those within double quotes."""
    parts, quoted = [""], False
    for letter in text:
        quoted ^= letter == '"'
        if letter == "," and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _path(text: str) -> str:
    text = text.strip()
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else text


def _number(name: str, text: str, unit: str) -> float:
    match = _NUMBER.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"{name} is {text.strip()[:40]!r}; it must be a number.")
    if match[2] and match[2] not in _UNITS[unit]:
        raise ValueError(f"{name} is in {match[2]}; it must be in {unit or 'no unit'}.")
    return float(match[1])


def _check(name: str, value: float, low: float, high: float, unit: str = "") -> None:
    if not isfinite(value) or not low <= value <= high:
        raise ValueError(
            f"{name} is {value:g}; it must be in [{low:g}, {high:g}]{f' {unit}' if unit else ''}."
        )


def _text(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


FLAT = Flat()

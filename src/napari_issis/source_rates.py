"""Count rates of sources by their spectra: flux times what the channel makes of the spectrum."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from astropy.table import Table
from numpy.typing import NDArray

from .extinction import EXTINCTION_KNOTS
from .observation import Observation
from .passband import Passband
from .sources import SourceArrays, SpectraOfRows, check_columns, spectra_of
from .spectra import FLAT, Spectrum, parse_spectrum

Array = NDArray[np.float64]

# Widest piece of a quadrature with 16 nodes, angstrom.
PIECE = 50.0


def sources_and_rates(table: Table, observation: Observation) -> tuple[SourceArrays, Array]:
    """Check a source table and return its values and count rates.

    Parameters
    ----------
    table : astropy.table.Table
        The source table, with or without a column ``spectrum``.
    observation : Observation
        The instrument set-up.

    Returns
    -------
    sources : SourceArrays
        Magnitudes are converted at `flux_pivots`.
    rate : ndarray, shape (n,)
        Counts per second in all, filters included.

    Raises
    ------
    ValueError
        If the table has an error, or a source no light in the band that its flux is the mean
        of; the message names row, column and value.
    """
    # parsed once: 100,000 texts take as long as a small picture
    spectra = spectra_of(table)
    pivot = _pivots(spectra, table, observation)
    arrays = check_columns(table, pivot=pivot, pixel_scale=observation.pixel_scale)
    return arrays, arrays.flux * _rates(spectra, table, observation)


def rates_per_flux(table: Table, observation: Observation) -> float | Array:
    """Count rates in cps of sources whose flux is 1 erg s-1 cm-2 A-1, filters included.

    Returns
    -------
    float or ndarray, shape (n,)
        One number where all spectra are flat.
    """
    return _rates(spectra_of(table), table, observation)


def _rates(spectra: SpectraOfRows, table: Table, observation: Observation) -> float | Array:
    if all(spectrum == FLAT for spectrum, _ in spectra):
        return observation.cps_per_flux
    rates = np.full(len(table), observation.cps_per_flux)
    for spectrum, rows in spectra:
        try:
            rates[rows] = cps_per_flux(spectrum, observation)
        except ValueError as error:
            raise ValueError(f"row {rows[0]}, spectrum: {error}") from None
    return rates


def flux_pivots(table: Table, observation: Observation) -> float | Array:
    """Wavelengths in angstrom at which AB magnitudes of the sources become fluxes.

    Returns
    -------
    float or ndarray, shape (n,)
        Of the flat spectrum the pivot wavelength of the channel behind its filters, of others
        the wavelength at which the flux is given or, where it is the mean over the channel's
        band, the channel's own pivot wavelength. One number where all spectra are flat.
    """
    return _pivots(spectra_of(table), table, observation)


def _pivots(spectra: SpectraOfRows, table: Table, observation: Observation) -> float | Array:
    if all(spectrum == FLAT for spectrum, _ in spectra):
        return observation.pivot
    pivots = np.full(len(table), observation.pivot)
    for spectrum, rows in spectra:
        pivots[rows] = flux_pivot(spectrum, observation)
    return pivots


def flux_pivot(spectrum: Spectrum | str, observation: Observation) -> float:
    """Wavelength in angstrom at which AB magnitudes of a spectrum become fluxes.

    As of `flux_pivots`; an empty text is the flat spectrum.
    """
    if isinstance(spectrum, str):
        spectrum = parse_spectrum(spectrum)
    if spectrum == FLAT:
        return observation.pivot
    at = spectrum.flux_at
    return observation.channel_data.pivot if at is None else at


def cps_per_flux(spectrum: Spectrum | str, observation: Observation) -> float:
    """Count rate in cps of a source whose flux is 1 erg s-1 cm-2 A-1, filters included.

    Parameters
    ----------
    spectrum : Spectrum or str
        The spectrum, or its text.
    observation : Observation
        The instrument set-up.

    Raises
    ------
    ValueError
        If the flux is the mean over the channel's band and the spectrum has no light there.

    Notes
    -----
    The rate of the spectrum F is int A T F lambda / (h c) dlambda, with the channel's effective
    area A and the filters' transmission T. With the flux the mean over the band of a
    photon-counting detector, int A F lambda dlambda / int A lambda dlambda (Bessell & Murphy
    2012, PASP 124, 140, eq. A11), the rate without filters is the same for all spectra.
    """
    if isinstance(spectrum, str):
        spectrum = parse_spectrum(spectrum)
    if spectrum == FLAT:
        return observation.cps_per_flux
    mean, passed = _moments(spectrum, spectrum.stamp, observation.passband)
    at = spectrum.flux_at
    unit = mean if at is None else float(spectrum(at))
    # of the light in the far Wien tail of a cold black body nothing is left in floating point
    if not unit > 1e-290:
        low, high = observation.passband.band
        where = f"{observation.channel}, {low:g} to {high:g} A" if at is None else f"{at:g} A"
        raise ValueError(
            f"{spectrum} has no light in {where}, where its flux is given; "
            "give at=, a wavelength in angstrom where it has some."
        )
    channel = observation.channel_data.cps_per_flux * observation.neutral_transmittance
    # without curves this is exactly 1 for a flux that is the mean over the band
    return channel * (passed / unit)


@lru_cache(maxsize=4096)
def _moments(spectrum: Spectrum, stamp: tuple[int, ...], passband: Passband) -> tuple[float, float]:
    """Mean flux density over the channel's band, without filters and with them.

    ``stamp`` makes the result that of a file's present content.
    """
    low, high = passband.band
    pieces = np.linspace(low, high, 1 + int(np.ceil((high - low) / PIECE)))
    knots = np.concatenate([pieces, spectrum.knots()])
    if spectrum.ebv > 0:
        knots = np.concatenate([knots, EXTINCTION_KNOTS])
    flat = passband.unfiltered_moment
    without = replace(passband, filters=())
    mean = without.moment_of(spectrum, knots) / flat
    passed = passband.moment_of(spectrum, knots) / flat if passband.filters else mean
    return mean, passed

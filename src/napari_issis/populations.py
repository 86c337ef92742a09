"""Random populations: sources all over the frame, or in a cluster."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable

from .cluster_profile import ClusterProfile
from .flux_distribution import DEFAULT_SLOPE, draw_fluxes, sample_fluxes
from .instruments import PIXEL_SCALE
from .sources import FLUX_UNIT, INDEX_RANGE, KINDS, check_sources

# A thousand to one, as crowded fields have; the brightest is the brightest of the paper's.
CLUSTER_FLUX = (1e-17, 1e-14)


def random_sources(
    kind: str,
    n: int,
    *,
    shape: tuple[int, int] = (512, 512),
    flux: tuple[float, float] = (1e-15, 1e-14),
    r_half: tuple[float, float] = (10.0, 30.0),
    ellipticity: tuple[float, float] = (0.0, 0.8),
    pa: tuple[float, float] = (0.0, 180.0),
    index: tuple[float, float] = (0.5, 4.0),
    flux_distribution: str = "uniform",
    flux_slope: float = DEFAULT_SLOPE,
    flux_sample: Any = None,
    positions: ClusterProfile | None = None,
    seed: int | None = None,
) -> QTable:
    """Draw a random population; the default ranges are the paper's.

    Parameters
    ----------
    kind : str
        As for `source`.
    n : int
        Number of sources.
    shape : (int, int)
        Frame ``(ny, nx)`` over which the positions are uniform.
    flux : (float, float)
        Limits in erg s-1 cm-2 A-1.
    r_half, ellipticity, pa : (float, float)
        Limits of the structure parameters (pixels, 1, degrees), each uniform between them.
    index : (float, float)
        Limits of the Sersic index, for kind ``sersic`` only.
    flux_distribution : {"uniform", "log", "power"}
        Uniform in the flux F, in its logarithm, or dN/dF proportional to F^-flux_slope.
    flux_slope : float
        Slope of the power law, for ``power`` only; 1 is the same as ``log``.
    flux_sample : array_like or Quantity or Magnitude, optional
        Fluxes (or AB magnitudes, with their unit) to draw from with replacement, such as the
        flux column of a table; ``flux`` and ``flux_distribution`` are not used then.
    positions : ClusterProfile, optional
        Draws the positions from this profile instead; ``shape`` is not used then, and sources
        may stand outside the frame.
    seed : int, optional
        Seed; the same one draws the same population.

    Returns
    -------
    astropy.table.QTable

    Raises
    ------
    ValueError
        If a limit is out of range or a pair is in the wrong order.
    """
    if isinstance(n, bool) or not hasattr(n, "__index__") or n < 0:
        raise ValueError(f"n is {n!r}; the number of sources is a whole number, 0 or more.")
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; known: {', '.join(KINDS)}.")
    try:
        ny, nx = (int(side) for side in shape)
    except (TypeError, ValueError):
        raise ValueError(f"shape is {shape!r}; give (ny, nx) in pixels.") from None
    if ny < 1 or nx < 1:
        raise ValueError(f"shape is {shape!r}; its sides must be 1 or more.")
    if not isinstance(positions, ClusterProfile | None):
        raise ValueError(f"positions is {positions!r}; give a ClusterProfile.")
    rng = np.random.default_rng(seed)
    count = int(n)
    if positions is None:
        x, y = rng.uniform(-0.5, nx - 0.5, count), rng.uniform(-0.5, ny - 0.5, count)
    else:
        x, y = positions.draw(count, rng)
    if flux_sample is None:
        limits = _limits("flux", flux, 0.0, np.inf)
        fluxes = draw_fluxes(rng, count, limits, flux_distribution, flux_slope) * FLUX_UNIT
    else:
        fluxes = sample_fluxes(rng, count, flux_sample)
    table = QTable(
        {
            "kind": np.full(count, kind, dtype="U13"),
            "x": x,
            "y": y,
            "flux": fluxes,
            "r_half": rng.uniform(*_limits("r_half", r_half, 0.0, np.inf), count) * u.pix,
            "ellipticity": rng.uniform(
                *_limits("ellipticity", ellipticity, 0.0, np.nextafter(1.0, 0.0)), count
            ),
            "pa": rng.uniform(*_limits("pa", pa, -np.inf, np.inf), count) * u.deg,
        }
    )
    if kind == "sersic":
        table["n"] = rng.uniform(*_limits("index", index, *INDEX_RANGE), count)
    check_sources(table)
    return table


def star_cluster(
    n: int,
    *,
    profile: str = "king",
    centre: tuple[float, float] = (256.0, 256.0),
    radius: Any = 50.0,
    concentration: float = 1.0,
    ellipticity: float = 0.0,
    pa: Any = 0.0,
    flux: tuple[float, float] = CLUSTER_FLUX,
    flux_distribution: str = "power",
    flux_slope: float = DEFAULT_SLOPE,
    flux_sample: Any = None,
    seed: int | None = None,
    pixel_scale: float = PIXEL_SCALE,
) -> QTable:
    """Draw the stars of a cluster, its positions from a projected profile.

    Parameters
    ----------
    n : int
        Number of stars.
    profile, centre, radius, concentration, ellipticity, pa
        As for `ClusterProfile`: ``king``, ``plummer`` or ``gaussian``; ``radius`` is the
        projected half-number radius in pixels (or an angle), ``concentration`` King's
        log10 of tidal over core radius.
    flux, flux_distribution, flux_slope, flux_sample
        As for `random_sources`; by default a power law of slope 1.4, that of a main sequence
        with Salpeter's (1955) mass function and F proportional to M^3.5.
    seed : int, optional
        Seed; the same one draws the same cluster.
    pixel_scale : float
        Arcsec per pixel, for a radius given as an angle; by default that of ISSIS.

    Returns
    -------
    astropy.table.QTable
        Points. Stars may stand outside the frame: their wings are simulated too.

    Raises
    ------
    ValueError
        If a value is unknown or out of range; the message names it.

    See Also
    --------
    random_sources : with ``positions=ClusterProfile(...)``, a cluster of galaxies.
    """
    return random_sources(
        "point",
        n,
        positions=ClusterProfile(
            profile, centre, radius, concentration, ellipticity, pa, pixel_scale
        ),
        flux=flux,
        flux_distribution=flux_distribution,
        flux_slope=flux_slope,
        flux_sample=flux_sample,
        seed=seed,
    )


def _limits(name: str, pair: Any, least: float, most: float) -> tuple[float, float]:
    try:
        low, high = (float(v) for v in pair)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {pair!r}; give (lower, upper).") from None
    if not (np.isfinite(low) and np.isfinite(high)):
        raise ValueError(f"{name} limits are ({low}, {high}); they must be finite.")
    if low > high:
        raise ValueError(f"{name} limits are ({low}, {high}); the lower exceeds the upper one.")
    if low < least or high > most:
        raise ValueError(f"{name} limits are ({low}, {high}); allowed is {least} to {most}.")
    return low, high

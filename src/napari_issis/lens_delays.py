"""Time delays between the images of a lensed quasar, estimated from where they lie."""

from __future__ import annotations

import numpy as np

from .lensed_quasars import find_quasar


def isothermal_delays(
    name: str, *, z_lens: float | None = None, z_source: float | None = None
) -> dict[str, float]:
    """Estimate the time delays of a system of the library as those of an isothermal lens.

    Parameters
    ----------
    name : str
        A system of `lensed_quasars`.
    z_lens, z_source : float, optional
        Redshifts; the library's by default.

    Returns
    -------
    dict of str to float
        By image, how many days it lags behind the earliest one.

    Raises
    ------
    ValueError
        If there is no such system, or its redshifts are neither known here nor given.

    Notes
    -----
    For an isothermal potential of any angular shape, delta t_ij = D (r_j^2 - r_i^2) / 2c with r
    the distance of an image from the lens and D = (1 + z_lens) D_l D_s / D_ls: the image
    farthest out is the first (Witt, Mao & Keeton 2000, ApJ 544, 98, eq. 11). External shear
    and other mass profiles change it by tens of per cent, in symmetric systems by more; the
    cosmology is astropy's Planck18.
    """
    import astropy.units as u
    from astropy.constants import c
    from astropy.cosmology import Planck18

    system = find_quasar(name)
    redshifts = []
    for label, given, known in (
        ("z_lens", z_lens, system.z_lens),
        ("z_source", z_source, system.z_source),
    ):
        value = float(known if given is None else given)
        if not (np.isfinite(value) and value > 0):
            raise ValueError(
                f"{label} of {system.name} is {value}; give {label}=, a redshift above 0."
            )
        redshifts.append(value)
    lens, source = redshifts
    if not lens < source:
        raise ValueError(f"z_lens is {lens} and z_source {source}; the lens must be nearer.")
    # angular diameter distances of a flat universe; (1 + z_source) cancels
    to_lens, to_source = (Planck18.comoving_distance(z) for z in (lens, source))
    scale = to_lens * to_source / (to_source - to_lens) / c
    east, north = (np.array(list(system.images.values())) - system.lens).T * u.arcsec
    squared = (east**2 + north**2).to_value(u.rad**2)
    delays = (0.5 * scale).to_value(u.day) * (squared.max() - squared)
    return {image: float(delay) for image, delay in zip(system.images, delays, strict=True)}

"""The blurs and the halo by which a PSF differs from the channel's own one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from .observation import Observation
from .psf import TelescopePSF

BLURS = ("jitter_fwhm", "blur_fwhm", "halo_share", "halo_fwhm")


def blurs_of(observation: Observation) -> dict[str, float] | None:
    """Tell the blurs and the halo that an observation has in place of its channel's own.

    Returns
    -------
    dict or None
        Those of ``jitter_fwhm blur_fwhm halo_share halo_fwhm`` that differ; empty for the
        channel's own PSF. None if the PSF differs in more.
    """
    own = observation.replace(psf=None).effective_psf
    psf = observation.effective_psf
    if not isinstance(psf, TelescopePSF) or not isinstance(own, TelescopePSF):
        return None
    values = {name: getattr(psf, name) for name in BLURS}
    if replace(own, **values) != psf:
        return None
    return {name: value for name, value in values.items() if value != getattr(own, name)}


def with_blurs(observation: Observation, **blurs: Any) -> Observation:
    """Return the observation with its channel's own PSF, but for some blurs or the halo.

    Parameters
    ----------
    observation : Observation
        The instrument set-up; a PSF that it names is replaced.
    **blurs : float
        ``jitter_fwhm``, ``blur_fwhm``, ``halo_fwhm`` in arcsec and ``halo_share`` from 0 to 1,
        as of `TelescopePSF`.

    Raises
    ------
    ValueError
        If a value is out of range; the message names it.
    """
    bare = observation.replace(psf=None)
    own = bare.effective_psf
    assert isinstance(own, TelescopePSF)
    psf = replace(own, **blurs)
    return bare if psf == own else bare.replace(psf=psf)


def with_blurs_of(observation: Observation, other: Observation) -> Observation:
    """Return the observation with the blurs of another one, in the band that is its own.

    If either has a PSF that differs in more than blurs, nothing changes.
    """
    blurs = blurs_of(other)
    if blurs is None or blurs_of(observation.replace(psf=None)) is None:
        return observation
    return with_blurs(observation, **blurs)

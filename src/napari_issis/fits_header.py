"""The header of an exposure: what was observed, with what, and where each pixel lies."""

from __future__ import annotations

from datetime import UTC, datetime
from math import cos, radians, sin
from typing import TYPE_CHECKING

import numpy as np
from astropy.io import fits
from numpy.typing import ArrayLike

from .filters import Filter
from .fits_light_path import sky_description
from .image_psf import ImagePSF
from .observation import Observation
from .psf import PSF, GaussianPSF, MoffatPSF, TelescopePSF
from .sources import spectrum_texts

if TYPE_CHECKING:
    from .exposure import Exposure


def observation_header(exposure: Exposure) -> fits.Header:
    """Cards that describe an exposure as a whole.

    Notes
    -----
    Cards round some floats: they are for people. The exact values stand in the extension
    ``OBSERVATION``.
    """
    from . import __version__

    observation = exposure.observation
    low, high = observation.channel_data.band
    psf = observation.effective_psf
    header = fits.Header()
    if observation.instrument.telescope:
        header["TELESCOP"] = (observation.instrument.telescope, "telescope")
    header["INSTRUME"] = (observation.instrument.name, "camera")
    header["CHANNEL"] = (observation.channel, "channel of the camera")
    header["FILTER1"] = (observation.filter_names[0], "filter in wheel 1")
    header["FILTER2"] = (observation.filter_names[1], "filter in wheel 2")
    header["WAVEMIN"] = (low, "[Angstrom] lower end of the band")
    header["WAVEMAX"] = (high, "[Angstrom] upper end of the band")
    header["EXPTIME"] = (observation.exposure, "[s] exposure time")
    header["OBSTYPE"] = ("SIMULATION", "no real observation")
    header["CPSFLUX"] = (observation.cps_per_flux, "[ct/s] 1 erg/s/cm2/A, flat, with filters")
    header["SKYRATE"] = (observation.sky_rate, "[ct/s/pixel] sky, with filters")
    header["SKYMODEL"] = sky_description(observation)
    header["DARKRATE"] = (observation.dark_rate, "[ct/s/pixel] of the detector itself")
    detector = observation.detector
    header["DEADTIME"] = (detector.dead_time, "[s] of a pixel after each count; 0: no loss")
    header["ROLLOVER"] = (detector.rollover, "T: the counts are modulo 65536")
    header["SKYCOUNT"] = (
        observation.sky_rate * observation.exposure,
        "[ct/pixel] expected sky in the exposure",
    )
    header["PIXSCALE"] = (observation.pixel_scale, "[arcsec] size of a pixel")
    header["PSFTYPE"] = (type(psf).__name__, "kind of point spread function")
    header["PSFASSUM"] = (observation.psf_assumed, "T: the PSF is assumed, not measured")
    header["PSFDESC"] = psf_description(psf)
    header["SEED"] = (exposure.seed, "seed of the Poisson noise")
    header["CLIPPED"] = (exposure.clipped, "[ct] largest ripple below 0, set to 0")
    header["CREATOR"] = (f"napari-issis {__version__}", "program and version")
    header["DATE"] = (
        datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S"),
        "UTC at which this file was written",
    )
    camera = observation.instrument
    if observation.psf_assumed and camera.psf_note:
        header["COMMENT"] = camera.psf_note
    texts = spectrum_texts(exposure.sources)
    if texts is not None and not np.isin(texts, ("", "flat")).all():
        header["COMMENT"] = (
            "CPSFLUX holds for a flat spectrum; sources of this exposure have others, which the "
            "column spectrum of the extension SOURCES names."
        )
    for number, one in enumerate(observation.filters, start=1):
        if not isinstance(one, Filter) and camera.is_illustrative(one) and camera.filter_note:
            header["COMMENT"] = f"FILTER{number}: {camera.filter_note}"
    return header


def psf_description(psf: PSF) -> str:
    """One line of ASCII text on a PSF."""
    if isinstance(psf, TelescopePSF):
        band = psf.band if isinstance(psf.band, tuple) else (psf.band,)
        jitter = f", jitter {psf.jitter_fwhm:g}" if psf.jitter_fwhm else ""
        halo = f", halo {psf.halo_share:g} in {psf.halo_fwhm:g}" if psf.halo_share else ""
        return (
            f"{psf.diameter:g} m, obscuration {psf.obscuration:g}, "
            f"{'-'.join(f'{wavelength:g}' for wavelength in band)} A, "
            f"blur {psf.blur_fwhm:g}{jitter}{halo} arcsec FWHM"
        )
    if isinstance(psf, GaussianPSF):
        return f"Gaussian, FWHM {psf.fwhm:g} arcsec"
    if isinstance(psf, MoffatPSF):
        return f"Moffat, FWHM {psf.fwhm:g} arcsec, beta {psf.beta:g}"
    if isinstance(psf, ImagePSF):
        ny, nx = psf.array.shape
        pixel = "included" if psf.includes_pixel else "not included"
        return f"image of {nx} x {ny} samples, {psf.pixel_scale:g} arcsec apart, pixel {pixel}"
    return type(psf).__name__


def wcs_header(observation: Observation) -> fits.Header:
    """World coordinates of the frame.

    Parameters
    ----------
    observation : Observation
        The frame, and where it points if that is known.

    Returns
    -------
    astropy.io.fits.Header
        Without a pointing, offsets in arcsec from the frame's centre, growing to the left and
        upwards. With one, right ascension and declination in the gnomonic projection
        (Calabretta & Greisen 2002, A&A 395, 1077), the frame's +y axis at position angle
        ``roll``; the offsets are then the alternate description A.
    """
    if observation.pointing is None:
        return _offsets(observation, "")
    ny, nx = observation.shape
    scale = observation.pixel_scale / 3600
    roll = radians(observation.roll)
    header = fits.Header()
    header["WCSAXES"] = 2
    header["CTYPE1"] = ("RA---TAN", "right ascension, gnomonic projection")
    header["CTYPE2"] = ("DEC--TAN", "declination, gnomonic projection")
    header["CUNIT1"] = "deg"
    header["CUNIT2"] = "deg"
    header["CRVAL1"] = (float(observation.pointing.ra.deg), "[deg] at the frame's centre")
    header["CRVAL2"] = (float(observation.pointing.dec.deg), "[deg] at the frame's centre")
    header["CRPIX1"] = ((nx + 1) / 2, "the frame's centre")
    header["CRPIX2"] = ((ny + 1) / 2, "the frame's centre")
    header["CDELT1"] = (-scale, "[deg] east is to the left at roll 0")
    header["CDELT2"] = (scale, "[deg]")
    header["PC1_1"] = cos(roll)
    header["PC1_2"] = -sin(roll)
    header["PC2_1"] = sin(roll)
    header["PC2_2"] = cos(roll)
    header["RADESYS"] = "ICRS"
    header["ROLL"] = (observation.roll, "[deg] position angle of the +y axis")
    header.update(_offsets(observation, "A"))
    return header


def layer_header(to_frame: ArrayLike, observation: Observation) -> fits.Header:
    """World coordinates of an image that lies somewhere in the frame.

    Parameters
    ----------
    to_frame : array_like, shape (3, 3)
        ``to_frame @ [y, x, 1]`` is ``[y, x, 1]`` in the frame, both with (0, 0) at the centre of
        the first pixel.
    observation : Observation
        The frame.

    Returns
    -------
    astropy.io.fits.Header
        The projection of `wcs_header`, exactly: before it both are linear.

    Raises
    ------
    ValueError
        If the image is flattened to a line.
    """
    matrix = np.asarray(to_frame, dtype=np.float64)
    # FITS counts x before y.
    linear, shift = matrix[1::-1, 1::-1], matrix[1::-1, 2]
    if not np.isfinite(matrix).all() or abs(np.linalg.det(linear)) < 1e-12:
        raise ValueError(
            "the image has no width or height in the frame; mend its scale, or save it in a "
            "viewer without the scene."
        )
    header = wcs_header(observation)
    header.remove("ROLL", ignore_missing=True)
    for a in ("",) if observation.pointing is None else ("", "A"):
        turn = [[header.get(f"PC{i}_{j}{a}", float(i == j)) for j in (1, 2)] for i in (1, 2)]
        centre = np.array([header[f"CRPIX1{a}"], header[f"CRPIX2{a}"]]) - 1
        own = np.linalg.solve(linear, centre - shift) + 1
        turned = turn @ linear
        for i in (1, 2):
            header[f"CRPIX{i}{a}"] = float(own[i - 1])
            for j in (1, 2):
                header[f"PC{i}_{j}{a}"] = float(turned[i - 1, j - 1])
    return header


def _offsets(observation: Observation, alternate: str) -> fits.Header:
    ny, nx = observation.shape
    a = alternate
    header = fits.Header()
    header[f"WCSAXES{a}"] = 2
    header[f"WCSNAME{a}"] = "OFFSET"
    header[f"CTYPE1{a}"] = ("XOFFSET", "offset along the rows")
    header[f"CTYPE2{a}"] = ("YOFFSET", "offset along the columns")
    header[f"CUNIT1{a}"] = "arcsec"
    header[f"CUNIT2{a}"] = "arcsec"
    header[f"CRVAL1{a}"] = (0.0, "[arcsec] at the frame's centre")
    header[f"CRVAL2{a}"] = (0.0, "[arcsec] at the frame's centre")
    header[f"CRPIX1{a}"] = ((nx + 1) / 2, "the frame's centre")
    header[f"CRPIX2{a}"] = ((ny + 1) / 2, "the frame's centre")
    header[f"CDELT1{a}"] = (-observation.pixel_scale, "[arcsec] grows to the left")
    header[f"CDELT2{a}"] = (observation.pixel_scale, "[arcsec] grows upwards")
    return header

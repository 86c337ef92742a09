"""Exposures as FITS files, and back, bit for bit.

A file holds, in this order,

* an image in the primary HDU, or compressed without loss in the first extension behind an
  empty primary HDU: the counts as integers, unless another image is asked for;
* ``COUNTS``, where the image is another one;
* ``EXPECTED``, the expected counts as 64-bit floats;
* ``SOURCES``, the source table;
* ``SPECTRA`` and ``SAMPLES``, where sources have spectra from files (`fits_spectra`);
* ``OBSERVATION``, one row with the exact values of the observation, of which the header's
  cards are the readable copy;
* ``INSTRUMENT``, all that is known of the camera, as the bytes of its TOML file;
* ``PSF``, where an image serves as the PSF;
* ``LIGHT1``, ``LIGHT2`` ..., the images that sources are;
* ``FILTER1``, ``FILTER2``, where a curve of the user's serves as a filter.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .detector import Detector
from .exposure import Exposure
from .fits_header import observation_header, wcs_header
from .fits_light_path import filter_hdus, sky_values, stored_filters, stored_sky
from .fits_source_images import image_hdus, keep_images
from .fits_spectra import spectrum_hdus, with_stored_spectra
from .fits_table import open_fits, read_table, table_hdu
from .image_psf import ImagePSF
from .instrument import Instrument
from .instrument_file import parse_instrument
from .instrument_text import instrument_text
from .instruments import instrument_named
from .observation import Observation
from .psf import PSF, GaussianPSF, MoffatPSF, TelescopePSF
from .safe_write import replacing
from .sources import check_sources

# Raised when a file of the new layout can no longer be read by the old program.
LAYOUT = 1
SUFFIXES = (".fits", ".fit", ".fts")
# Units of the images that can stand first, and what they are.
IMAGES = {
    "counts": ("ct", "detected counts per pixel"),
    "rate": ("ct/s", "detected counts per pixel and second"),
    "expected": ("ct", "expected counts per pixel, sources and sky"),
    "snr": ("", "signal-to-noise ratio per pixel, (C - B) / sqrt(C)"),
}
# Numbers of that image, and the counts up to which each holds every whole number.
DTYPES = {"int32": 2**31 - 1, "int64": 2**63 - 1, "float32": 2**24, "float64": 2**53}


def write_exposure(
    exposure: Exposure,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    compress: bool = False,
    image: str = "counts",
    dtype: str | None = None,
    whole: bool = True,
) -> None:
    """Write an exposure to a FITS file.

    Parameters
    ----------
    exposure : Exposure
        What to write.
    path : path-like
        The file; its name ends in ``.fits`` (or ``.fit``, ``.fts``).
    overwrite : bool
        Whether an existing file may be replaced. It is replaced as a whole once the new one
        is complete.
    compress : bool
        Compress the images without loss, tile by tile.
    image : {"counts", "rate", "expected", "snr"}
        The image that other programs see first: detected counts (integers), counts per
        second, expected counts, or the signal-to-noise ratio per pixel (64-bit floats).
    dtype : {"int32", "int64", "float32", "float64"}, optional
        Numbers of that image, where others than those above are wanted: counts as floats for
        programs that take no integers, or half the bytes for the others. What `read_exposure`
        needs stays exact beside it.
    whole : bool
        Whether all that `read_exposure` needs goes into the file, or the image alone.

    Raises
    ------
    ValueError
        If the name does not end as above, the image or the dtype is not one of these, whole
        counts would be rounded, or a column, the PSF or the sky cannot be stored.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.
    """
    if image not in IMAGES:
        raise ValueError(f"image is {image!r}; known: {', '.join(IMAGES)}.")
    wcs = wcs_header(exposure.observation)
    cards = observation_header(exposure) + _unit(image) + wcs
    exact = _image_of(exposure, image)
    first = exact if dtype is None else _as_type(exact, image, dtype)
    # An image of other numbers does not take the place of the one to be read back.
    changed = first.dtype.kind != exact.dtype.kind or first.dtype.itemsize < exact.dtype.itemsize
    if compress:
        name = "image" if changed else image
        hdus = [fits.PrimaryHDU(header=observation_header(exposure)), _packed(first, cards, name)]
    else:
        hdus = [fits.PrimaryHDU(first, cards)]
    if whole:
        for name in ("counts", "expected"):
            # Uncompressed, the first image has no name to be found by; only counts need none.
            if name == image and (compress or name == "counts") and not changed:
                continue
            further = _image_of(exposure, name)
            if compress and name == "counts":
                hdus.append(_packed(further, _unit(name) + wcs, name))
            else:
                hdus.append(fits.ImageHDU(further, _unit(name) + wcs, name.upper()))
        hdus += scene_hdus(exposure.sources, exposure.observation, exposure.seed, exposure.clipped)
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        fits.HDUList(hdus).writeto(file, output_verify="exception", checksum=True)


def scene_hdus(
    sources: Table, observation: Observation, seed: int, clipped: float = 0.0
) -> list[Any]:
    """Make the extensions from which a scene can be told: sources, observation and so on.

    Raises
    ------
    ValueError
        If a column, the PSF or the sky cannot be stored; the message names it.
    """
    record = _record(observation, seed, clipped)
    camera = np.frombuffer(instrument_text(observation.instrument).encode(), np.uint8)
    hdus = [
        table_hdu(sources, "SOURCES"),
        *spectrum_hdus(sources),
        table_hdu(record, "OBSERVATION"),
        fits.ImageHDU(camera, name="INSTRUMENT"),
    ]
    if isinstance(observation.psf, ImagePSF):
        psf = observation.psf
        scale = fits.Header([("PIXELSCL", psf.pixel_scale, "[arcsec] spacing of the samples")])
        hdus.append(fits.ImageHDU(psf.array, scale, "PSF"))
    return hdus + image_hdus(sources) + filter_hdus(observation)


def read_scene(hdus: fits.HDUList) -> tuple[QTable, Observation, int, float]:
    """Read what `scene_hdus` made: the checked sources, observation, seed and clipped counts.

    Raises
    ------
    ValueError
        If an extension is missing or broken.
    """
    names = [hdu.name for hdu in hdus]
    missing = [name for name in ("SOURCES", "OBSERVATION") if name not in names]
    if missing:
        raise ValueError(
            f"the file holds no napari-issis exposure: it has no extension {missing[0]}."
        )
    record = read_table(hdus["OBSERVATION"])
    if len(record) != 1 or "LAYOUT" not in record.colnames:
        raise ValueError("the extension OBSERVATION is not that of a napari-issis exposure.")
    if record["LAYOUT"][0] > LAYOUT:
        raise ValueError("the file was written by a newer napari-issis; update the program.")
    row = {name: record[name][0] for name in record.colnames}
    observation = _observation(row, hdus)
    sources = with_stored_spectra(read_table(hdus["SOURCES"]), hdus)
    keep_images(hdus)
    check_sources(sources)
    return sources, observation, int(row["SEED"]), float(row["CLIPPED"])


def _image_of(exposure: Exposure, image: str) -> NDArray[Any]:
    if image == "counts":
        return _smallest(exposure.counts)
    if image == "rate":
        return np.asarray(exposure.counts / exposure.observation.exposure)
    values = exposure.expected if image == "expected" else exposure.snr
    return np.asarray(values, dtype=np.float64)


def _as_type(values: NDArray[Any], image: str, dtype: str) -> NDArray[Any]:
    """Convert an image to the numbers asked for, unless whole counts would be rounded."""
    if dtype not in DTYPES:
        raise ValueError(f"dtype is {dtype!r}; known: {', '.join(DTYPES)}.")
    whole = values.dtype.kind == "i"
    if not whole and dtype.startswith("int"):
        raise ValueError(
            f"dtype is {dtype!r}, which would round the image {image!r}; use float32 or float64."
        )
    brightest = int(values.max(initial=0)) if whole else 0
    if brightest > DTYPES[dtype]:
        raise ValueError(
            f"dtype is {dtype!r}, which holds whole counts up to {DTYPES[dtype]} only, and the "
            f"brightest pixel has {brightest}; use int64."
        )
    return values.astype(dtype)


def _unit(image: str) -> fits.Header:
    unit, comment = IMAGES[image]
    return fits.Header([("BUNIT", unit, comment)])


def _packed(image: NDArray[Any], header: fits.Header, name: str) -> fits.CompImageHDU:
    """Compress without loss: floats are not rounded, and so shrink less."""
    rice = image.dtype == np.int32
    return fits.CompImageHDU(
        image,
        header,
        name.upper(),
        compression_type="RICE_1" if rice else "GZIP_2",
        quantize_level=0,
    )


def read_exposure(path: str | os.PathLike[str]) -> Exposure:
    """Read an exposure that `write_exposure` wrote.

    Parameters
    ----------
    path : path-like
        The file.

    Returns
    -------
    Exposure
        Equal to the one that was written, floats bit for bit.

    Raises
    ------
    ValueError
        If the file is empty, damaged, truncated, or holds no such exposure.
    OSError
        If it cannot be opened.
    """
    with open_fits(path) as hdus:
        names = [hdu.name for hdu in hdus]
        if "EXPECTED" not in names:
            raise ValueError(
                "the file holds no napari-issis exposure: it has no extension EXPECTED."
            )
        sources, observation, seed, clipped = read_scene(hdus)
        counts = _image(hdus["COUNTS" if "COUNTS" in names else 0], observation.shape, "iu")
        expected = _image(hdus["EXPECTED"], observation.shape, "f")
        return Exposure(
            counts=counts.astype(np.int64),
            expected=expected.astype(np.float64),
            sources=sources,
            observation=observation,
            seed=seed,
            clipped=clipped,
        )


def _smallest(counts: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return counts as 32-bit integers where they fit, else as 64-bit ones."""
    counts = np.asarray(counts)
    fits_32 = counts.size == 0 or counts.max() <= np.iinfo(np.int32).max
    return counts.astype(np.int32 if fits_32 else np.int64)


def _image(hdu: Any, shape: tuple[int, int], dtype_kinds: str) -> NDArray[Any]:
    name = hdu.name or "PRIMARY"
    if not hdu.is_image or tuple(hdu.shape) != shape:
        raise ValueError(f"{name} is not an image of {shape[1]} x {shape[0]} pixels.")
    data = np.asarray(hdu.data)
    if data.dtype.kind not in dtype_kinds:
        raise ValueError(f"{name} holds values of type {data.dtype}.")
    return data


def _record(observation: Observation, seed: int, clipped: float) -> Table:
    """One row with every value that the observation is made of; NaN where there is none."""
    pointing = observation.pointing
    psf = observation.effective_psf
    values: dict[str, Any] = {
        "LAYOUT": LAYOUT,
        "INSTRUME": observation.instrument.name,
        "CHANNEL": observation.channel,
        "FILTER1": observation.filter_names[0],
        "FILTER2": observation.filter_names[1],
        "EXPOSURE": observation.exposure,
        "NY": observation.shape[0],
        "NX": observation.shape[1],
        "DARK": np.nan if observation.dark is None else observation.dark,
        "DEAD_TIME": observation.detector.dead_time,
        "ROLLOVER": observation.detector.rollover,
        "BACKGROUND": np.nan if observation.background is None else observation.background,
        "RA": np.nan if pointing is None else float(pointing.ra.deg),
        "DEC": np.nan if pointing is None else float(pointing.dec.deg),
        "ROLL": observation.roll,
        # as text: a seed may exceed 64 bits
        "SEED": str(seed),
        "CLIPPED": float(clipped),
        "PSF_ASSUMED": observation.psf_assumed,
        "PSF_TYPE": type(psf).__name__,
        **_psf_values(psf),
        **sky_values(observation.sky),
    }
    return Table({name: [value] for name, value in values.items()})


def _observation(row: dict[str, Any], hdus: fits.HDUList) -> Observation:
    pointing = None
    if not np.isnan(row["RA"]):
        pointing = SkyCoord(row["RA"], row["DEC"], unit="deg", frame="icrs")
    background, dark = float(row["BACKGROUND"]), float(row.get("DARK", 0.0))
    return Observation(
        instrument=_instrument(row, hdus),
        channel=str(row["CHANNEL"]),
        filters=stored_filters(row, hdus),
        exposure=float(row["EXPOSURE"]),
        shape=(int(row["NY"]), int(row["NX"])),
        psf=None if row["PSF_ASSUMED"] else _psf(row, hdus),
        background=None if np.isnan(background) else background,
        pointing=pointing,
        roll=float(row["ROLL"]),
        sky=stored_sky(row),
        dark=None if np.isnan(dark) else dark,
        # files written before there were any name none
        detector=Detector(float(row.get("DEAD_TIME", 0.0)), bool(row.get("ROLLOVER", False))),
    )


def _instrument(row: dict[str, Any], hdus: fits.HDUList) -> Instrument:
    """Return the stored camera; files written before there were others name one of ours."""
    if "INSTRUMENT" not in [hdu.name for hdu in hdus]:
        return instrument_named(str(row["INSTRUME"]))
    hdu = hdus["INSTRUMENT"]
    if not hdu.is_image or len(hdu.shape) != 1 or hdu.data.dtype != np.uint8:
        raise ValueError("the extension INSTRUMENT holds no text.")
    return parse_instrument(hdu.data.tobytes(), "the extension INSTRUMENT")


def _psf_values(psf: PSF) -> dict[str, Any]:
    if type(psf) is TelescopePSF:
        low, high = psf.band if isinstance(psf.band, tuple) else (psf.band, psf.band)
        return {
            "DIAMETER": psf.diameter,
            "OBSCURATION": psf.obscuration,
            "BAND_LOW": low,
            "BAND_HIGH": high,
            "BLUR_FWHM": psf.blur_fwhm,
            "JITTER_FWHM": psf.jitter_fwhm,
            "HALO_SHARE": psf.halo_share,
            "HALO_FWHM": psf.halo_fwhm,
        }
    if type(psf) is GaussianPSF:
        return {"FWHM": psf.fwhm}
    if type(psf) is MoffatPSF:
        return {"FWHM": psf.fwhm, "BETA": psf.beta}
    if type(psf) is ImagePSF:
        return {"PIXEL_SCALE": psf.pixel_scale, "INCLUDES_PIXEL": psf.includes_pixel}
    raise ValueError(
        f"a PSF of type {type(psf).__name__} cannot be stored; "
        "use a TelescopePSF, GaussianPSF, MoffatPSF or ImagePSF."
    )


def _psf(row: dict[str, Any], hdus: fits.HDUList) -> PSF:
    kind = str(row["PSF_TYPE"])
    if kind == "TelescopePSF":
        return TelescopePSF(
            float(row["DIAMETER"]),
            float(row["OBSCURATION"]),
            band=(float(row["BAND_LOW"]), float(row["BAND_HIGH"])),
            blur_fwhm=float(row["BLUR_FWHM"]),
            jitter_fwhm=float(row.get("JITTER_FWHM", 0.0)),
            halo_share=float(row.get("HALO_SHARE", 0.0)),
            halo_fwhm=float(row.get("HALO_FWHM", 0.0)),
        )
    if kind == "GaussianPSF":
        return GaussianPSF(float(row["FWHM"]))
    if kind == "MoffatPSF":
        return MoffatPSF(float(row["FWHM"]), float(row["BETA"]))
    if kind == "ImagePSF":
        array = np.asarray(hdus["PSF"].data, dtype=np.float64)
        psf = ImagePSF(array, float(row["PIXEL_SCALE"]), bool(row["INCLUDES_PIXEL"]))
        # The array was scaled to a sum of 1 before; a second time would move its last bits.
        array.setflags(write=False)
        object.__setattr__(psf, "array", array)
        return psf
    raise ValueError(f"the PSF is of the unknown type {kind!r}.")

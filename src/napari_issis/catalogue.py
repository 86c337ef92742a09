"""Catalogues in files: ECSV, FITS, CSV, VOTable and DS9 regions to source tables, and back."""

from __future__ import annotations

import os
import warnings
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from astropy.io import fits
from astropy.table import QTable, Table

from .catalogue_sources import DEFAULT_UNITS, to_sources
from .ds9_regions import SUFFIXES as REGION_SUFFIXES
from .ds9_regions import read_regions
from .fits_io import SUFFIXES as FITS_SUFFIXES
from .fits_source_images import image_hdus, keep_images
from .fits_table import open_fits, read_table, table_hdu
from .observation import Observation
from .reading import one_line
from .safe_write import replacing
from .source_image import check_in_files
from .sources import check_sources
from .text_tables import read_text_table
from .votable import SUFFIXES as VOTABLE_SUFFIXES
from .votable import read_votable, votable_bytes

# Of tables that can be written.
SUFFIXES = (".ecsv", ".csv", *FITS_SUFFIXES, *VOTABLE_SUFFIXES)
PACKED_FITS = tuple(f"{suffix}.gz" for suffix in FITS_SUFFIXES)
READABLE = (*SUFFIXES, *PACKED_FITS, *REGION_SUFFIXES)


@dataclass(frozen=True)
class Catalogue:
    """A catalogue that was read.

    Attributes
    ----------
    sources : astropy.table.QTable
        The checked source table; columns that were not understood are kept in it.
    notes : tuple of str
        What was taken for what, a line each, such as
        ``mag -> flux (taken as AB magnitudes, at the channel's pivot wavelength, 2463 A)``.
        Empty where every column had its own name.
    """

    sources: QTable
    notes: tuple[str, ...] = ()


def read_sources(path: str | os.PathLike[str], observation: Observation | None = None) -> QTable:
    """Read a source table; see `read_catalogue`, which also says what it understood."""
    return read_catalogue(path, observation).sources


def read_catalogue(
    path: str | os.PathLike[str], observation: Observation | None = None
) -> Catalogue:
    """Read a catalogue of any origin as a source table.

    Parameters
    ----------
    path : path-like
        An ECSV (``.ecsv``), CSV (``.csv``), FITS (``.fits``, ``.fit``, ``.fts``, also with
        ``.gz``), VOTable (``.vot``, ``.votable``, ``.xml``) or DS9 region (``.reg``) file. Of
        a FITS file the extension ``SOURCES`` is taken, which every saved exposure has, else
        the first table.
    observation : Observation, optional
        The frame into which positions in right ascension and declination are put; needed
        where a catalogue has no others.

    Returns
    -------
    Catalogue
        The source table, and what was taken for what.

    Raises
    ------
    ValueError
        If the file is empty or broken, its name has an unknown ending, or a column or value
        is missing or out of range; the message names the file, row (from 0), column and value.
    OSError
        If the file cannot be opened.

    Notes
    -----
    Columns are recognised by name and unit: ``x y`` or ``ra dec`` (and the names of VizieR and
    SExtractor); ``flux``, or ``mag`` as AB magnitudes; ``r_half``, ``r_e``, ``r_eff`` or
    ``hlr``; ``ellipticity`` or ``q``; ``pa``, or ``theta`` from +x; ``n``; ``kind``. Without
    a unit they are in pixels, degrees and erg s-1 cm-2 A-1. Beside ``ra dec`` an angle is one
    on the sky, from north through east. Without a ``kind`` a source that has a size is
    exponential, or Sersic where there is an index, and any other a point.
    """
    name = Path(path).name.lower()
    if not name.endswith(READABLE):
        raise ValueError(f"{path} is no source table; its name must end in {', '.join(READABLE)}.")
    if name.endswith((*FITS_SUFFIXES, *PACKED_FITS)):
        with open_fits(path) as hdus:
            hdu = _table_extension(hdus)
            names = hdu.columns.names
            table = read_table(hdu)
            keep_images(hdus)
            left_out = [name for name in names if name not in table.colnames]
            sources, notes = to_sources(table, observation)
            if left_out:
                notes = (f"left out, as they are lists: {', '.join(left_out)}", *notes)
            return Catalogue(sources, notes)
    suffix = Path(name).suffix
    if suffix in REGION_SUFFIXES:
        kind = "region"
    else:
        kind = "VOTable" if suffix in VOTABLE_SUFFIXES else suffix[1:].upper()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            if kind == "region":
                return Catalogue(*read_regions(path, observation))
            table = read_votable(path) if kind == "VOTable" else read_text_table(path, suffix[1:])
        except (OSError, MemoryError):
            raise
        except Exception as error:
            # What astropy raises on a broken table is not restricted to a few types.
            reason = one_line(error)
            if reason.startswith(str(path)):
                raise ValueError(reason) from error
            raise ValueError(f"{path} is not a readable {kind} table: {reason}") from error
        try:
            return Catalogue(*to_sources(table, observation))
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from error


def write_sources(table: Table, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a source table to a file, in the format of the name's ending.

    Parameters
    ----------
    table : astropy.table.Table
        A source table.
    path : path-like
        The file: ``.ecsv``, ``.fits`` (``.fit``, ``.fts``), ``.csv``, or a VOTable (``.vot``,
        ``.votable``, ``.xml``).
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the table is no valid source table, the ending is unknown, or the format cannot
        hold it: CSV has no units, so only the default ones go into it. FITS holds the images
        that sources are; the others name the image's file, so it must have one.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path} is no source table; its name must end in {', '.join(SUFFIXES)}.")
    check_sources(table)
    if suffix in FITS_SUFFIXES:
        hdus = fits.HDUList([fits.PrimaryHDU(), table_hdu(table, "SOURCES"), *image_hdus(table)])
        with replacing(path, SUFFIXES, overwrite=overwrite) as file:
            hdus.writeto(file, output_verify="exception", checksum=True)
        return
    check_in_files(table)
    if suffix in VOTABLE_SUFFIXES:
        content = votable_bytes(table)
        with replacing(path, SUFFIXES, overwrite=overwrite) as file:
            file.write(content)
        return
    text = StringIO()
    if suffix == ".csv":
        _without_units(table).write(text, format="ascii.csv")
    else:
        QTable(table).write(text, format="ascii.ecsv")
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        file.write(text.getvalue().encode())


def _table_extension(hdus: fits.HDUList) -> fits.BinTableHDU:
    tables = [hdu for hdu in hdus if isinstance(hdu, fits.BinTableHDU | fits.TableHDU)]
    if not tables:
        raise ValueError("the file holds no table.")
    return next((hdu for hdu in tables if hdu.name == "SOURCES"), tables[0])


def _without_units(table: Table) -> Table:
    plain = Table()
    for name in table.colnames:
        unit = getattr(table[name], "unit", None)
        if unit is not None and unit != DEFAULT_UNITS.get(name):
            raise ValueError(
                f"column {name} is in {unit}, which a CSV file cannot say; write ECSV or FITS."
            )
        plain[name] = getattr(table[name], "value", table[name])
    return plain

"""Source tables: one row a source, checked, with the units and defaults of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable, Table
from numpy.typing import NDArray

from .instruments import PIXEL_SCALE
from .spectra import FLAT, Spectrum, parse_spectrum

Array = NDArray[np.float64]
# Spectra that occur in a source table, each with its rows.
SpectraOfRows = list[tuple[Spectrum, NDArray[np.intp]]]

KINDS = ("point", "uniform", "gaussian", "exponential", "devaucouleurs", "sersic")
# The kind whose profile is an image, see `source_image`; it has no default and no random values.
IMAGE = "image"
FLUX_UNIT = u.erg / u.s / u.cm**2 / u.AA
COLUMNS = ("kind", "x", "y", "flux", "r_half", "ellipticity", "pa")
# Defaults of the paper's "specific object" form.
DEFAULT_FLUX = 1e-14
DEFAULT_R_HALF = 20.0
DEFAULT_ELLIPTICITY = 0.5
DEFAULT_PA = 45.0
# Sersic (1963) index of the kinds that are one.
SERSIC_INDEX = {"gaussian": 0.5, "exponential": 1.0, "devaucouleurs": 4.0}
INDEX_RANGE = (0.5, 8.0)
# Beyond these, numbers are slips of the pen: a frame has 10^3 pixels, the Sun's flux is about 1.
FARTHEST = 1e9
LARGEST_R_HALF = 1e7
BRIGHTEST = 1.0


@dataclass(frozen=True)
class SourceArrays:
    """A checked source table as plain arrays, all of shape (n,).

    ``kind`` holds names of `KINDS` or `IMAGE`; ``x y r_half`` are in pixels, ``flux`` in
    erg s-1 cm-2 A-1, ``pa`` in degrees. ``index`` is the Sersic index, NaN for points, uniform
    ellipses and images. For points, ``r_half ellipticity pa`` are 0. ``image`` holds the texts
    of images, empty for other sources.
    """

    kind: NDArray[np.str_]
    x: Array
    y: Array
    flux: Array
    r_half: Array
    ellipticity: Array
    pa: Array
    index: Array
    image: NDArray[np.str_]

    def __len__(self) -> int:
        return self.x.size

    def take(self, rows: Any) -> SourceArrays:
        """Return the chosen rows (an index array, a mask or a slice)."""
        return SourceArrays(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def source(
    kind: str,
    x: float,
    y: float,
    flux: Any = DEFAULT_FLUX,
    r_half: Any = DEFAULT_R_HALF,
    ellipticity: float = DEFAULT_ELLIPTICITY,
    pa: Any = DEFAULT_PA,
    n: float | None = None,
    spectrum: str | Spectrum | None = None,
) -> QTable:
    """Make a source table of one row.

    Parameters
    ----------
    kind : {"point", "uniform", "gaussian", "exponential", "devaucouleurs", "sersic"}
        The profile.
    x, y : float
        Position of the centre in pixels; the centre of the first pixel is (0, 0).
    flux : float or Quantity or Magnitude
        Total flux in erg s-1 cm-2 A-1, or AB magnitude (with its unit).
    r_half : float or Quantity
        Semi-major axis of the ellipse that holds half of the light, in pixels (or an angle).
    ellipticity : float
        1 - b/a, in [0, 1).
    pa : float or Quantity
        Position angle of the major axis in degrees, from +y counter-clockwise towards -x.
    n : float, optional
        Sersic index, 0.5 to 8; for kind ``sersic`` only.
    spectrum : str or Spectrum, optional
        The spectrum, such as ``"blackbody(30000 K)"``; see
        `napari_issis.spectra.parse_spectrum`. Flat by default.

    Returns
    -------
    astropy.table.QTable
        Columns ``kind x y flux r_half ellipticity pa`` (and ``n``, ``spectrum``). Join tables with
        `astropy.table.vstack`. Sources of kind ``image`` come from `image_source`.

    Raises
    ------
    ValueError
        If a value is missing or out of range; the message names it.

    Notes
    -----
    For a point the structure parameters are ignored.
    """
    if kind == IMAGE:
        raise ValueError("kind is 'image'; make such a source with napari_issis.image_source.")
    if n is not None and kind != "sersic":
        raise ValueError(f"n is {n}, but only sources of kind 'sersic' have an index.")
    columns: dict[str, Any] = {
        "kind": [str(kind)],
        "x": [_plain("x", x, u.pix)],
        "y": [_plain("y", y, u.pix)],
        "flux": np.atleast_1d(_with_unit("flux", flux, FLUX_UNIT)),
        "r_half": np.atleast_1d(_with_unit("r_half", r_half, u.pix)),
        "ellipticity": [_plain("ellipticity", ellipticity, u.dimensionless_unscaled)],
        "pa": np.atleast_1d(_with_unit("pa", pa, u.deg)),
    }
    if n is not None:
        columns["n"] = [_plain("n", n, u.dimensionless_unscaled)]
    if spectrum is not None:
        columns["spectrum"] = [str(spectrum)]
    table = QTable(columns)
    check_sources(table)
    return table


def _kinds(column: Any) -> NDArray[np.str_]:
    """Return the kinds as they are named, whatever holds them."""
    if isinstance(column, np.ndarray) and column.dtype.kind == "U" and not hasattr(column, "mask"):
        # 10,000 in a tenth of the time
        return np.char.strip(np.asarray(column)).astype("U32")
    return np.array([str(kind).strip() for kind in column], dtype="U32")


def check_sources(
    table: Table, *, pivot: float | Array | None = None, pixel_scale: float = PIXEL_SCALE
) -> SourceArrays:
    """Check a source table and return its values as plain arrays.

    Parameters
    ----------
    table : astropy.table.Table
        A source table. Columns without a unit are taken in pixels, degrees and
        erg s-1 cm-2 A-1.
    pivot : float or ndarray, shape (n,), optional
        Wavelength in angstrom at which AB magnitudes become fluxes; without it magnitudes
        are checked, and converted at 2500 A.
    pixel_scale : float
        Arcsec per pixel, for radii given as angles.

    Raises
    ------
    ValueError
        If a column is missing or a value out of range: the message names the row (from 0),
        the column, the value and what is allowed.
    """
    arrays = check_columns(table, pivot=pivot, pixel_scale=pixel_scale)
    spectra_of(table)
    return arrays


def check_columns(
    table: Table, *, pivot: float | Array | None = None, pixel_scale: float = PIXEL_SCALE
) -> SourceArrays:
    """Do as `check_sources`, but for the column ``spectrum``, which is not looked at."""
    if not isinstance(table, Table):
        raise ValueError(f"sources is {table!r}; give a source table (astropy QTable).")
    missing = [name for name in COLUMNS[:4] if name not in table.colnames]
    if missing:
        raise ValueError(
            f"the source table has no column {', '.join(missing)}; "
            f"it needs {', '.join(COLUMNS)} (and n for Sersic profiles)."
        )
    kind = _kinds(table["kind"])
    for row in np.flatnonzero(~np.isin(kind, (*KINDS, IMAGE))):
        name = str(kind[row])
        raise ValueError(
            f"row {row}, kind: {name!r} is unknown; known: {', '.join(KINDS)}, {IMAGE}."
        )
    extended = kind != "point"
    if extended.any():
        missing = [name for name in COLUMNS[4:] if name not in table.colnames]
        if missing:
            raise ValueError(
                f"the source table has no column {', '.join(missing)}, "
                f"which row {np.flatnonzero(extended)[0]} ({kind[extended][0]}) needs."
            )
    everything = np.ones(kind.size, dtype=bool)
    x = _column(table, "x", u.pix, everything)
    y = _column(table, "y", u.pix, everything)
    for name, position in (("x", x), ("y", y)):
        near = np.abs(position) <= FARTHEST
        _require(name, position, near, everything, f"within {FARTHEST:g} pixels")
    flux = _column(table, "flux", FLUX_UNIT, everything, pivot=2500.0 if pivot is None else pivot)
    good = (flux >= 0) & (flux <= BRIGHTEST)
    _require("flux", flux, good, everything, f"in [0, {BRIGHTEST:g}] erg s-1 cm-2 A-1")
    r_half = _column(table, "r_half", u.pix, extended, pixel_scale=pixel_scale)
    good = (r_half > 0) & (r_half <= LARGEST_R_HALF)
    _require("r_half", r_half, good, extended, f"above 0 and at most {LARGEST_R_HALF:g} pixels")
    ellipticity = _column(table, "ellipticity", u.dimensionless_unscaled, extended)
    _require(
        "ellipticity", ellipticity, (ellipticity >= 0) & (ellipticity < 1), extended, "in [0, 1)"
    )
    pa = _column(table, "pa", u.deg, extended)
    sersic = kind == "sersic"
    index = np.full(kind.size, np.nan)
    for name, value in SERSIC_INDEX.items():
        index[kind == name] = value
    if sersic.any():
        if "n" not in table.colnames:
            raise ValueError(
                f"the source table has no column n, "
                f"the index that row {np.flatnonzero(sersic)[0]} (sersic) needs."
            )
        n = _column(table, "n", u.dimensionless_unscaled, sersic)
        low, high = INDEX_RANGE
        _require("n", n, (n >= low) & (n <= high), sersic, f"in [{low}, {high}]")
        index[sersic] = n[sersic]
    image = _images(table, kind == IMAGE, ellipticity)
    return SourceArrays(kind, x, y, flux, r_half, ellipticity, pa, index, image)


def _images(table: Table, used: NDArray[np.bool_], ellipticity: Array) -> NDArray[np.str_]:
    """Texts of the images that a table names, each of which is there."""
    if not used.any():
        return np.zeros(len(table), dtype="U1")
    from .source_image import kept_image

    texts = image_texts(table)
    if texts is None:
        raise ValueError(
            f"the source table has no column image, which row {np.flatnonzero(used)[0]} (image) "
            "needs; make such sources with napari_issis.image_source."
        )
    _require("ellipticity", ellipticity, ellipticity == 0, used, "0 for an image")
    texts = np.where(used, texts, "")
    for text in np.unique(texts[used]):
        try:
            kept_image(str(text))
        except ValueError as error:
            row = int(np.argmax(used & (texts == text)))
            raise ValueError(f"row {row}, image: {error}") from None
    return texts


def spectra_of(table: Table) -> SpectraOfRows:
    """Spectra that occur in a source table, each with its rows; none if it has no such column.

    Raises
    ------
    ValueError
        If a text is no spectrum; the message names the row.
    ImportError
        If there is reddening and ``dust_extinction`` is not installed.
    """
    texts = spectrum_texts(table)
    if texts is None or not texts.size:
        return []
    _, which = np.unique(texts, return_inverse=True)
    order = np.argsort(which, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(which))[:-1])
    found = []
    for rows in sorted(groups, key=lambda rows: int(rows[0])):
        try:
            found.append((parse_spectrum(str(texts[rows[0]])), rows))
        except ValueError as error:
            raise ValueError(f"row {rows[0]}, spectrum: {error}") from None
    return found


def shared_spectrum(table: Table) -> Spectrum | None:
    """Return the spectrum of all sources of a table, or None if they have different ones.

    Flat where there is no source, and no column ``spectrum``.

    Raises
    ------
    ValueError
        If a text is no spectrum.
    """
    texts = spectrum_texts(table)
    distinct = [] if texts is None else list(dict.fromkeys(texts.tolist()))
    spectra = {parse_spectrum(text) for text in distinct} or {FLAT}
    return spectra.pop() if len(spectra) == 1 else None


def spectrum_texts(table: Table) -> NDArray[np.str_] | None:
    """Texts of the spectra of a source table, shape (n,); None if there is no such column.

    A missing value is an empty text, that is the flat spectrum.
    """
    return _texts(table, "spectrum")


def image_texts(table: Table) -> NDArray[np.str_] | None:
    """Texts of the images of a source table, shape (n,); None if there is no such column."""
    return _texts(table, "image")


def _texts(table: Table, name: str) -> NDArray[np.str_] | None:
    if not isinstance(table, Table) or name not in table.colnames:
        return None
    column = table[name]
    if not hasattr(column, "mask") and column.dtype.kind == "U":
        return np.char.strip(np.asarray(column))
    mask = np.asarray(getattr(column, "mask", np.zeros(len(table), dtype=bool)))
    values = np.asarray(getattr(column, "value", column))
    texts = ["" if gone else str(v).strip() for v, gone in zip(values, mask, strict=True)]
    return np.array(texts, dtype=np.str_)


def empty_sources() -> QTable:
    """Make a source table with no rows."""
    return source("point", 0.0, 0.0)[:0]


def _plain(name: str, value: Any, unit: u.UnitBase) -> float:
    """Return a value as a plain number in ``unit``."""
    try:
        return float(u.Quantity(value, unit).value)
    except (TypeError, ValueError):
        raise ValueError(
            f"{name} is {value!r}; it must be a number ({unit or 'no unit'})."
        ) from None


def _with_unit(name: str, value: Any, unit: u.UnitBase) -> Any:
    return value if hasattr(value, "unit") else _plain(name, value, unit) * unit


def _column(
    table: Table,
    name: str,
    unit: u.UnitBase,
    used: NDArray[np.bool_],
    *,
    pivot: float | Array | None = None,
    pixel_scale: float | None = None,
) -> Array:
    """Values of a column in ``unit``; 0 in rows that do not use it; errors name the row."""
    if name not in table.colnames or not used.any():
        return np.zeros(len(table))
    column = table[name]
    mask = np.asarray(getattr(column, "mask", np.zeros(len(table), dtype=bool)))
    for row in np.flatnonzero(used & mask):
        raise ValueError(f"row {row}, {name}: the value is missing.")
    given = getattr(column, "unit", None)
    plain = column.astype(float).filled(np.nan) if mask.any() else column
    try:
        if given is None or given == unit:
            values = np.asarray(getattr(plain, "value", plain), dtype=float)
        elif pivot is not None:
            values = u.Quantity(
                plain.to(unit, u.spectral_density(pivot * u.AA))
                if hasattr(plain, "to")
                else (np.asarray(plain) * given).to(unit, u.spectral_density(pivot * u.AA))
            ).value
        else:
            scale = [] if pixel_scale is None else u.pixel_scale(pixel_scale * u.arcsec / u.pix)
            values = u.Quantity(plain, given).to_value(unit, scale)
    except u.UnitConversionError:
        raise ValueError(
            f"column {name} has the unit {given}; it must be convertible to {unit}."
        ) from None
    except (TypeError, ValueError):
        for row in np.flatnonzero(used):
            try:
                float(column[row])
            except (TypeError, ValueError):
                raise ValueError(
                    f"row {row}, {name}: {str(column[row])!r} is not a number."
                ) from None
        raise
    values = np.array(values, dtype=np.float64).reshape(len(table))
    _require(name, values, np.isfinite(values), used, "a finite number")
    values[~used] = 0.0
    return values


def _require(
    name: str, values: Array, good: NDArray[np.bool_], used: NDArray[np.bool_], allowed: str
) -> None:
    for row in np.flatnonzero(used & ~good):
        raise ValueError(
            f"row {row}, {name}: {values[row]:g} is not allowed; it must be {allowed}."
        )

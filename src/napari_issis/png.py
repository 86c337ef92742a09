"""Images and source models as PNG files, with row 0 at the bottom."""

from __future__ import annotations

import os

import numpy as np
from astropy.table import Table
from astropy.visualization import BaseStretch, LinearStretch, LogStretch, SqrtStretch
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw
from PIL.PngImagePlugin import PngInfo

from .instruments import PIXEL_SCALE
from .kept_images import kept_image
from .observation import Observation
from .safe_write import replacing
from .sources import IMAGE, check_sources

SUFFIXES = (".png",)
SCALES = ("linear", "log", "sqrt")
COLORMAPS = ("gray", "gray_r", "heat")
LONGEST_SIDE = 32768
# Colours after Shalyapin & Goicoechea (2014); the same as those of the layers in napari.
POINT_COLOR = "red"
ELLIPSE_COLORS = {
    "uniform": "cyan",
    "gaussian": "lightgreen",
    "exponential": "yellow",
    "devaucouleurs": "orange",
    "sersic": "magenta",
    IMAGE: "dodgerblue",
}
# Between two pictures in one file, in pixels of the file.
GAP, GAP_COLOR = 2, (128, 128, 128)
# The outline of a star with five points, one of them up, and its radius in pixels of the file.
STAR_RADIUS = 6.0
_TURN = np.arange(10) * np.pi / 5
STAR = (np.where(np.arange(10) % 2, 0.4, 1.0) * [-np.sin(_TURN), np.cos(_TURN)]).T


def write_png(
    path: str | os.PathLike[str],
    image: ArrayLike,
    *,
    scale: str = "linear",
    limits: tuple[float, float] | None = None,
    colormap: str | NDArray[np.uint8] = "gray",
    zoom: int = 1,
    words: dict[str, str] | None = None,
    overwrite: bool = False,
) -> None:
    """Write an image to a PNG file, one image pixel a PNG pixel unless magnified.

    Parameters
    ----------
    path : path-like
        The file; its name ends in ``.png``.
    image : array_like, shape (ny, nx)
        The image; row 0 is drawn at the bottom. NaN is drawn as the lower limit.
    scale : {"linear", "log", "sqrt"}
        Brightness scale. With v the value between the limits, 0 to 1, the brightness is v,
        log(1000 v + 1) / log(1001) (as in SAOImage DS9) or sqrt(v).
    limits : (float, float), optional
        Values drawn darkest and brightest; by default the image's finite extremes.
    colormap : {"gray", "gray_r", "heat"} or ndarray of uint8, shape (256, 3)
        Black to white, white to black, or black over red and yellow to white; or colours from
        dark to bright.
    zoom : int
        Side of the square that each image pixel becomes, 1 to 64.
    words : dict of str, optional
        PNG text beside, or in place of, that below.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the name, image, scale, limits, colormap or zoom is not as above.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.

    Notes
    -----
    Scale, limits, colormap and zoom stand in the file as PNG text.
    """
    picture, limits = image_picture(image, scale=scale, limits=limits, colormap=colormap, zoom=zoom)
    text = _drawn_by(scale, limits, colormap, zoom)
    _save(picture, path, text | (words or {}), overwrite=overwrite)


def image_picture(
    image: ArrayLike,
    *,
    scale: str = "linear",
    limits: tuple[float, float] | None = None,
    colormap: str | NDArray[np.uint8] = "gray",
    zoom: int = 1,
) -> tuple[Image.Image, tuple[float, float]]:
    """Return the picture that `write_png` writes, and the limits it has."""
    values = np.asarray(image, dtype=np.float64)
    if values.ndim != 2 or values.size == 0:
        raise ValueError(f"a PNG shows an image of two dimensions; this one's are {values.shape}.")
    if scale not in SCALES:
        raise ValueError(f"scale is {scale!r}; known: {', '.join(SCALES)}.")
    if isinstance(colormap, str) and colormap not in COLORMAPS:
        raise ValueError(f"colormap is {colormap!r}; known: {', '.join(COLORMAPS)}.")
    check_zoom(zoom, values.shape)
    low, high = _limits(values, limits)
    brightness = np.rint(255 * _stretch(scale)(_normalised(values, low, high))).astype(np.uint8)
    magnified = np.flipud(brightness).repeat(zoom, axis=0).repeat(zoom, axis=1)
    colours = _colours(colormap) if isinstance(colormap, str) else colormap
    return Image.fromarray(colours[magnified]), (low, high)


def write_source_png(
    path: str | os.PathLike[str],
    sources: Table,
    shape: tuple[int, int],
    *,
    zoom: int = 1,
    overwrite: bool = False,
    pixel_scale: float = PIXEL_SCALE,
) -> None:
    """Draw a source model to a PNG file: stars, and ellipses that hold half of the light.

    Parameters
    ----------
    path : path-like
        The file; its name ends in ``.png``.
    sources : astropy.table.QTable
        A source table.
    shape : (int, int)
        Frame ``(ny, nx)`` in pixels.
    zoom : int
        Side of the square that each pixel of the frame becomes, 1 to 64.
    overwrite : bool
        Whether an existing file may be replaced.
    pixel_scale : float
        Arcsec per pixel, for radii given as angles; by default that of ISSIS.

    Raises
    ------
    ValueError
        If the name, the table, the shape or the zoom is not as above.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.

    Notes
    -----
    The lines are one pixel of the file wide, on black, in the colours of `POINT_COLOR` and
    `ELLIPSE_COLORS`.
    """
    picture = source_picture(sources, shape, zoom=zoom, pixel_scale=pixel_scale)
    _save(picture, path, {"Zoom": str(zoom)}, overwrite=overwrite)


def source_picture(
    sources: Table,
    shape: tuple[int, int],
    *,
    zoom: int = 1,
    pixel_scale: float = PIXEL_SCALE,
) -> Image.Image:
    """Return the picture that `write_source_png` writes."""
    arrays = check_sources(sources, pixel_scale=pixel_scale)
    ny, nx = Observation(shape=shape).shape
    check_zoom(zoom, (ny, nx))
    picture = Image.new("RGB", (nx * zoom, ny * zoom))
    draw = ImageDraw.Draw(picture)
    reach = np.maximum(arrays.r_half, STAR_RADIUS)
    for row in np.flatnonzero(arrays.kind == IMAGE):
        reach[row] *= np.hypot(*kept_image(str(arrays.image[row])).half_sizes)
    near = (np.abs(arrays.x - (nx - 1) / 2) <= nx / 2 + reach) & (
        np.abs(arrays.y - (ny - 1) / 2) <= ny / 2 + reach
    )
    seen = arrays.take(near)
    for i, kind in enumerate(seen.kind):
        if kind == "point":
            outline = np.append(STAR, STAR[:1], axis=0) * STAR_RADIUS / zoom
        elif kind == IMAGE:
            outline = _rectangle(str(seen.image[i]), seen.r_half[i], seen.pa[i])
        else:
            outline = _ellipse(seen.r_half[i], seen.ellipticity[i], seen.pa[i], zoom)
        x = (seen.x[i] + outline[:, 0] + 0.5) * zoom - 0.5
        y = (ny - 0.5 - seen.y[i] - outline[:, 1]) * zoom - 0.5
        points = np.clip(np.rint(np.stack([x, y], axis=1)), -1e6, 1e6)
        draw.line([tuple(point) for point in points], fill=ELLIPSE_COLORS.get(kind, POINT_COLOR))
    return picture


def write_side_by_side_png(
    path: str | os.PathLike[str],
    sources: Table,
    image: ArrayLike,
    *,
    scale: str = "linear",
    limits: tuple[float, float] | None = None,
    colormap: str | NDArray[np.uint8] = "gray",
    zoom: int = 1,
    words: dict[str, str] | None = None,
    overwrite: bool = False,
    pixel_scale: float = PIXEL_SCALE,
) -> None:
    """Write one PNG file of a source model, at the left, and of the final image at its right.

    Parameters
    ----------
    path : path-like
        The file; its name ends in ``.png``.
    sources : astropy.table.QTable
        A source table, drawn as by `write_source_png`.
    image : array_like, shape (ny, nx)
        The image, drawn as by `write_png`; its shape is the frame's.
    scale, limits, colormap, zoom, words, overwrite
        As of `write_png`; zoom and overwrite for both.
    pixel_scale : float
        Arcsec per pixel, for radii given as angles; by default that of ISSIS.

    Raises
    ------
    ValueError
        If an argument is not as `write_png` and `write_source_png` have it, or the two are
        wider together than a PNG may be.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.

    Notes
    -----
    A grey line of `GAP` PNG pixels parts the two.
    """
    right, limits = image_picture(image, scale=scale, limits=limits, colormap=colormap, zoom=zoom)
    ny, nx = np.shape(image)
    check_zoom(zoom, (ny, 2 * nx + GAP))
    left = source_picture(sources, (ny, nx), zoom=zoom, pixel_scale=pixel_scale)
    both = Image.new("RGB", (2 * left.width + GAP, left.height), GAP_COLOR)
    both.paste(left, (0, 0))
    both.paste(right, (left.width + GAP, 0))
    text = _drawn_by(scale, limits, colormap, zoom)
    _save(both, path, text | (words or {}), overwrite=overwrite)


def _drawn_by(
    scale: str, limits: tuple[float, float], colormap: str | NDArray[np.uint8], zoom: int
) -> dict[str, str]:
    """Return how an image is drawn, as PNG text."""
    low, high = limits
    text = {"Scale": scale, "Limits": f"{low!r} {high!r}", "Zoom": str(zoom)}
    return text | ({"Colormap": colormap} if isinstance(colormap, str) else {})


def _rectangle(image: str, r_half: float, pa: float) -> NDArray[np.float64]:
    """Return the corners of an image about its centre, (x, y) in pixels, the first twice."""
    half_y, half_x = (r_half * half for half in kept_image(image).half_sizes)
    u, v = half_x * np.array([-1, 1, 1, -1, -1]), half_y * np.array([-1, -1, 1, 1, -1])
    c, s = np.cos(np.radians(pa)), np.sin(np.radians(pa))
    return np.stack([u * c - v * s, u * s + v * c], axis=1)


def _ellipse(r_half: float, ellipticity: float, pa: float, zoom: int) -> NDArray[np.float64]:
    """Return points of a half-light ellipse about its centre, (x, y) in pixels."""
    angle = np.linspace(0, 2 * np.pi, int(np.clip(4 * r_half * zoom, 60, 4000)))
    major, minor = r_half * np.cos(angle), r_half * (1 - ellipticity) * np.sin(angle)
    c, s = np.cos(np.radians(pa)), np.sin(np.radians(pa))
    return np.stack([-s * major + c * minor, c * major + s * minor], axis=1)


def _save(
    picture: Image.Image,
    path: str | os.PathLike[str],
    words: dict[str, str],
    *,
    overwrite: bool,
) -> None:
    text = PngInfo()
    for key, value in {
        "Software": "napari-issis",
        **words,
        "Orientation": "row 0 at the bottom",
    }.items():
        text.add_text(key, value)
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        picture.save(file, format="PNG", pnginfo=text)


def check_zoom(zoom: int, shape: tuple[int, ...]) -> None:
    """Raise a ValueError if an image of this shape cannot be magnified so."""
    if isinstance(zoom, bool) or not hasattr(zoom, "__index__") or not 1 <= zoom <= 64:
        raise ValueError(f"zoom is {zoom!r}; it must be a whole number from 1 to 64.")
    if max(shape) * zoom > LONGEST_SIDE:
        raise ValueError(
            f"zoom is {zoom}: {max(shape)} pixels become {max(shape) * zoom}, more than "
            f"{LONGEST_SIDE}; choose a smaller one."
        )


def _limits(values: NDArray[np.float64], limits: tuple[float, float] | None) -> tuple[float, float]:
    if limits is None:
        finite = values[np.isfinite(values)]
        return (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    try:
        low, high = (float(limit) for limit in limits)
    except (TypeError, ValueError):
        raise ValueError(f"limits is {limits!r}; give (lowest, highest).") from None
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ValueError(f"limits is {limits!r}; give two finite numbers, the lower one first.")
    return low, high


def _normalised(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    if high == low:
        return np.zeros_like(values)
    clipped = np.clip(np.nan_to_num(values, nan=low, posinf=high, neginf=low), low, high)
    # Halves, for limits whose difference overflows.
    return (clipped / 2 - low / 2) / (high / 2 - low / 2)


def _stretch(scale: str) -> BaseStretch:
    return {"linear": LinearStretch, "log": LogStretch, "sqrt": SqrtStretch}[scale]()


def _colours(colormap: str) -> NDArray[np.uint8]:
    """Return the 256 grey levels, or 256 RGB colours, from dark to bright."""
    levels = np.arange(256)
    if colormap == "heat":
        ramps = [np.clip(3 * levels - 255 * i, 0, 255) for i in range(3)]
        return np.stack(ramps, axis=1).astype(np.uint8)
    return (levels if colormap == "gray" else levels[::-1]).astype(np.uint8)

"""Images as PNG files, at the image's own pixels and with row 0 at the bottom."""

from __future__ import annotations

import os

import numpy as np
from astropy.visualization import BaseStretch, LinearStretch, LogStretch, SqrtStretch
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from .safe_write import replacing

SUFFIXES = (".png",)
SCALES = ("linear", "log", "sqrt")
COLORMAPS = ("gray", "gray_r", "heat")


def write_png(
    path: str | os.PathLike[str],
    image: ArrayLike,
    *,
    scale: str = "linear",
    limits: tuple[float, float] | None = None,
    colormap: str = "gray",
    overwrite: bool = False,
) -> None:
    """Write an image to a PNG file, one image pixel a PNG pixel.

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
    colormap : {"gray", "gray_r", "heat"}
        Black to white, white to black, or black over red and yellow to white.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the name, image, scale, limits or colormap is not as above.
    OSError
        If the file cannot be written; `FileExistsError` if it exists.

    Notes
    -----
    Scale, limits and colormap stand in the file as PNG text.
    """
    values = np.asarray(image, dtype=np.float64)
    if values.ndim != 2 or values.size == 0:
        raise ValueError(f"a PNG shows an image of two dimensions; this one's are {values.shape}.")
    if scale not in SCALES:
        raise ValueError(f"scale is {scale!r}; known: {', '.join(SCALES)}.")
    if colormap not in COLORMAPS:
        raise ValueError(f"colormap is {colormap!r}; known: {', '.join(COLORMAPS)}.")
    low, high = _limits(values, limits)
    brightness = np.rint(255 * _stretch(scale)(_normalised(values, low, high))).astype(np.uint8)
    picture = Image.fromarray(_colours(colormap)[np.flipud(brightness)])
    text = PngInfo()
    text.add_text("Software", "napari-issis")
    text.add_text("Scale", scale)
    text.add_text("Limits", f"{low!r} {high!r}")
    text.add_text("Colormap", colormap)
    text.add_text("Orientation", "row 0 at the bottom")
    with replacing(path, SUFFIXES, overwrite=overwrite) as file:
        picture.save(file, format="PNG", pnginfo=text)


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

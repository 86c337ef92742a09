"""Pictures of a proposal sheet as SVG: source model and images, with scale and compass."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from io import BytesIO
from math import cos, hypot, radians, sin

import numpy as np
from astropy.visualization import LogStretch
from numpy.typing import NDArray

from .exposure import Exposure
from .observation import Observation
from .png import ELLIPSE_COLORS, POINT_COLOR, STAR, image_picture
from .sources import SourceArrays

Array = NDArray[np.float64]

# Units of the SVG: width of a picture, height of the strip below, radius of a star, and of many.
WIDTH = 300.0
STRIP = 34.0
STAR_SIZE = 5.0
SMALL_STAR = 2.5
COLORMAP = "gray_r"
# Sources beyond which none has its name written beside it.
NAMED = 40
LENGTHS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
# On paper the paper's bright colours are too light.
DARKER = {"cyan": "#0097a7", "lightgreen": "#388e3c", "yellow": "#b8860b", "orange": "#e65100"}


def model_svg(arrays: SourceArrays, names: Sequence[str], observation: Observation) -> str:
    """Draw the sources: stars, and ellipses that hold half of the light.

    Parameters
    ----------
    arrays : SourceArrays
        The sources.
    names : sequence of str, length n
        What is written beside them, where there are at most `NAMED`.
    observation : Observation
        The frame.
    """
    zoom, height = _frame(observation)
    ny, _ = observation.shape
    star = STAR_SIZE if len(arrays) <= NAMED else SMALL_STAR
    parts = [f'<rect width="{WIDTH:g}" height="{height:.2f}" fill="#fff"/>']
    for i, kind in enumerate(arrays.kind):
        x, y = (arrays.x[i] + 0.5) * zoom, (ny - 0.5 - arrays.y[i]) * zoom
        reach = star if kind == "point" else arrays.r_half[i] * zoom
        if not (-reach <= x <= WIDTH + reach and -reach <= y <= height + reach):
            continue
        if kind == "point":
            corners = STAR * star * [1, -1] + [x, y]
            points = " ".join(f"{a:.2f},{b:.2f}" for a, b in corners)
            parts.append(f'<polygon points="{points}" fill="{POINT_COLOR}"/>')
        else:
            color = ELLIPSE_COLORS[str(kind)]
            # the major axis drawn along y, then turned; SVG turns clockwise on the screen
            parts.append(
                f'<ellipse rx="{reach * (1 - arrays.ellipticity[i]):.2f}" ry="{reach:.2f}" '
                f'transform="translate({x:.2f} {y:.2f}) rotate({-arrays.pa[i]:.2f})" '
                f'fill="none" stroke="{DARKER.get(color, color)}" stroke-width="1.4"/>'
            )
        if len(arrays) <= NAMED:
            parts.append(_text(x + 7, y - 5, names[i], size=11, anchor="start"))
    inner = f'<svg width="{WIDTH:g}" height="{height:.2f}">{"".join(parts)}</svg>'
    return _svg(inner + _border(height) + _marks(observation, height), height + STRIP)


def image_svg(exposure: Exposure) -> str:
    """Draw the counts of an exposure on a logarithmic scale, with a colour bar in counts."""
    observation = exposure.observation
    _, height = _frame(observation)
    counts = exposure.counts
    # the sky is white, what is below it too
    low = float(np.floor(exposure.background))
    top = max(float(counts.max()), low + 1.0)
    picture, _ = image_picture(counts, scale="log", limits=(low, top), colormap=COLORMAP)
    bar, _ = image_picture(np.arange(256.0)[None, :], colormap=COLORMAP)
    parts = [
        _embedded(picture, WIDTH, height),
        _border(height),
        _marks(observation, height),
        f'<g transform="translate(0 {height + 6:.2f})">{_embedded(bar, WIDTH, 9)}'
        f'<rect width="{WIDTH:g}" height="9" fill="none" stroke="#000" stroke-width="0.6"/>',
    ]
    free = -10.0
    for value, place in ticks(low, top):
        label = f"{value:g}"
        size = 6.0 * len(label)
        left = min(max(place * WIDTH - size / 2, 0.0), WIDTH - size)
        if left >= free:
            free = left + size + 5
            parts.append(
                f'<path d="M{place * WIDTH:.2f} 9v3" stroke="#000" stroke-width="0.6"/>'
                + _text(left, 22, label, size=10, anchor="start")
            )
    return _svg("".join(parts) + "</g>", height + STRIP)


def ticks(low: float, top: float) -> list[tuple[float, float]]:
    """Return counts to label on a colour bar from ``low`` to ``top``, and their places, 0 to 1.

    Notes
    -----
    The place of v is log(1000 t + 1) / log(1001) with t = (v - low) / (top - low), as in
    `napari_issis.png.write_png`.
    """
    decades = 10.0 ** np.arange(0, int(np.floor(np.log10(top))) + 1)
    steps = (1, 3) if decades.size > 2 else (1, 2, 5)
    values = np.unique([low, *(s * d for d in decades for s in steps)])
    values = values[(values >= low) & (values <= top)]
    places = LogStretch()((values - low) / (top - low))
    return [(float(v), float(p)) for v, p in zip(values, places, strict=True)]


def _marks(observation: Observation, height: float) -> str:
    """Scale bar at the lower left and compass at the upper right."""
    zoom, _ = _frame(observation)
    per_arcsec = zoom / observation.pixel_scale
    short = [length for length in LENGTHS if length * per_arcsec <= 0.35 * WIDTH]
    length = short[-1] if short else LENGTHS[0]
    y = height - 12
    bar = f"M10 {y:.2f}h{length * per_arcsec:.2f}"
    middle = 10 + 0.5 * length * per_arcsec
    scale = _line(bar, 2.0) + _text(max(middle, 18), y - 5, f"{length:g}\u2033", size=12)
    roll = radians(observation.roll)
    # on the screen, y down; east is to the left of north at roll 0
    arms = {"N": (sin(roll), -cos(roll)), "E": (-cos(roll), -sin(roll))}
    sum_x, sum_y = (arms["N"][i] + arms["E"][i] for i in (0, 1))
    reach = max(hypot(sum_x, sum_y), 1e-9)
    root_x, root_y = WIDTH - 32 - 14 * sum_x / reach, 32 - 14 * sum_y / reach
    compass = ""
    for name, (dx, dy) in arms.items():
        compass += _line(f"M{root_x:.2f} {root_y:.2f}l{20 * dx:.2f} {20 * dy:.2f}", 1.6)
        compass += _text(root_x + 28 * dx, root_y + 28 * dy + 4, name, size=12)
    return scale + compass


def _line(path: str, width: float) -> str:
    """Draw a dark line with a light rim, to be seen on both."""
    style = 'fill="none" stroke-linecap="butt"'
    return (
        f'<path d="{path}" {style} stroke="#fff" stroke-width="{width + 2:g}"/>'
        f'<path d="{path}" {style} stroke="#0b3d91" stroke-width="{width:g}"/>'
    )


def _text(x: float, y: float, text: str, *, size: int, anchor: str = "middle") -> str:
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size}" text-anchor="{anchor}" '
        'fill="#0b3d91" stroke="#fff" stroke-width="2.5" paint-order="stroke">'
        f"{escape(text)}</text>"
    )


def _frame(observation: Observation) -> tuple[float, float]:
    """SVG units of a pixel, and height of the picture."""
    ny, nx = observation.shape
    zoom = WIDTH / nx
    return zoom, ny * zoom


def _border(height: float) -> str:
    return (
        f'<rect width="{WIDTH:g}" height="{height:.2f}" fill="none" stroke="#000" '
        'stroke-width="0.8"/>'
    )


def _embedded(picture: object, width: float, height: float) -> str:
    file = BytesIO()
    picture.save(file, format="PNG")  # type: ignore[attr-defined]
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return (
        f'<image width="{width:g}" height="{height:.2f}" preserveAspectRatio="none" '
        f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/>'
    )


def _svg(inner: str, height: float) -> str:
    return (
        f'<svg viewBox="-1 -1 {WIDTH + 2:g} {height + 2:.2f}" '
        f'xmlns="http://www.w3.org/2000/svg" font-family="sans-serif">{inner}</svg>'
    )

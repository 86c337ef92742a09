"""Colours of the trace plots in napari's dark and light themes."""

from __future__ import annotations

from dataclasses import dataclass

from napari.utils.theme import get_theme
from qtpy.QtGui import QColor


@dataclass(frozen=True)
class TraceColors:
    """Colours of a plot; those of the curves stand out from either background."""

    background: QColor
    grid: QColor
    text: QColor
    counts: QColor
    expected: QColor
    marker: QColor


def trace_colors(theme_name: str) -> TraceColors:
    """Return the colours that suit a theme."""
    theme = get_theme(theme_name)
    dark = theme.type == "dark"
    return TraceColors(
        background=QColor("#101418" if dark else "#fbfbfb"),
        grid=QColor("#33383d" if dark else "#d5d7d9"),
        text=QColor(*theme.text.as_rgb_tuple(alpha=False)),
        counts=QColor("#7cc7ff" if dark else "#1565a8"),
        expected=QColor("#ffb454" if dark else "#c2410c"),
        marker=QColor("#ff6b6b" if dark else "#b91c1c"),
    )

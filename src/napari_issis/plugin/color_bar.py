"""A colour bar whose labels are counts, and surface brightnesses where the scale is like them."""

from __future__ import annotations

from typing import Any

import numpy as np
from qtpy.QtCore import QRectF, QSize, Qt
from qtpy.QtGui import QImage, QPainter, QPaintEvent, QPalette
from qtpy.QtWidgets import QSizePolicy, QWidget

from ..photometry import surface_brightness
from ..source_rates import cps_per_flux, flux_pivot
from ..sources import shared_spectrum
from ..spectra import FLAT, Spectrum
from .brightness import counts_at, stretched
from .scene import Scene

BAR = 14  # height of the colours, pixels on the screen
MARGIN = 10  # beside them, for half a label
GAP = 6  # between two labels


class ColorBar(QWidget):  # type: ignore[misc]
    """Shows which counts have which colour.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self.scene = scene
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._spectrum: tuple[Any, Spectrum | None] = (None, FLAT)
        self.show_scale()

    @property
    def spectrum(self) -> Spectrum | None:
        """The spectrum of all sources; None if they have different ones."""
        table = self.scene.editor.sources
        if self._spectrum[0] is not table:
            try:
                self._spectrum = table, shared_spectrum(table)
            except ValueError:
                # a file that is gone
                self._spectrum = table, None
        return self._spectrum[1]

    @property
    def has_magnitudes(self) -> bool:
        """Whether surface brightnesses are shown below the counts."""
        return self.scene.counts.effective_scale == "log"

    def sizeHint(self) -> QSize:
        """Return the size: the bar and a line or two of labels."""
        lines = 2 if self.has_magnitudes else 1
        return QSize(200, BAR + lines * (self.fontMetrics().height() + 3) + 2)

    def show_scale(self, event: Any = None) -> None:
        """Show the present limits, scale and colours."""
        self.setToolTip(
            "Counts per pixel; below, on the logarithmic scale, AB mag arcsec⁻² above the sky, of "
            + (
                "a flat spectrum (*: the sources have different ones)"
                if self.spectrum is None
                else f"the sources' spectrum, {self.spectrum}"
            )
        )
        self.setFixedHeight(self.sizeHint().height())
        self.update()

    def ticks(self) -> list[tuple[float, str]]:
        """Places from 0 to 1 and labels in counts."""
        counts = self.scene.counts
        low, high = counts.limits
        if counts.effective_scale == "log":
            values = _decades(max(low, 1e-3), high)
            values = values[(values >= low) & (values <= high)]
        else:
            scale = counts.effective_scale
            middle = counts_at(scale, np.linspace(0, 1, 6), (low, high), counts.background)
            values = np.array([_round(value) for value in middle])
        # rounded, the limits themselves may lie outside
        within = np.clip(values, low, high)
        places = stretched(counts.effective_scale, within, (low, high), counts.background)
        return [(float(p), f"{v:.6g}") for p, v in zip(places, values, strict=True)]

    def magnitude_ticks(self) -> list[tuple[float, str]]:
        """Places and labels of surface brightnesses, AB mag arcsec-2, above the sky.

        They are those of the sources' spectrum, or of a flat one if there are several.
        """
        spectrum = self.spectrum or FLAT
        counts, observation = self.scene.counts, self.scene.observation
        brightness = np.linspace(0.0, 1.0, 6)
        shown = counts_at(counts.effective_scale, brightness, counts.limits, counts.background)
        received = observation.detector.received(np.asarray(shown / observation.exposure))
        rate = received - observation.background_rate
        magnitude = surface_brightness(
            rate,
            cps_per_flux=cps_per_flux(spectrum, observation),
            pivot=flux_pivot(spectrum, observation),
            pixel_scale=observation.pixel_scale,
        )
        return [
            (float(place), f"{value:.1f}")
            for place, value in zip(brightness, magnitude, strict=True)
            if np.isfinite(value)
        ]

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw colours and labels."""
        layer = self.scene.counts.layer
        if layer is None:
            return
        painter = QPainter(self)
        width = self.width() - 2 * MARGIN
        counts = self.scene.counts
        low, high = limits = counts.limits
        shown = counts_at(counts.effective_scale, np.linspace(0, 1, 256), limits, counts.background)
        place = np.clip((shown - low) / max(high - low, 1e-30), 0, 1) ** layer.gamma
        colors = (255 * layer.colormap.map(place)).astype(np.uint8)
        image = QImage(colors.tobytes(), colors.shape[0], 1, QImage.Format.Format_RGBA8888)
        painter.drawImage(QRectF(MARGIN, 0, width, BAR), image)
        painter.setPen(self.palette().color(QPalette.ColorRole.WindowText))
        painter.drawRect(QRectF(MARGIN, 0, width, BAR))
        self._label(painter, BAR + 2, width, self.ticks())
        if self.has_magnitudes:
            line = self.fontMetrics().height() + 3
            self._label(painter, BAR + 2 + line, width, self.magnitude_ticks())

    def _label(
        self, painter: QPainter, top: int, width: int, ticks: list[tuple[float, str]]
    ) -> None:
        metrics, free = self.fontMetrics(), 0.0
        for place, text in ticks:
            size = metrics.horizontalAdvance(text)
            left = min(max(MARGIN + place * width - size / 2, 0.0), self.width() - size)
            if left < free:
                continue
            free = left + size + GAP
            painter.drawText(
                QRectF(left, top, size + 1, metrics.height()), Qt.AlignmentFlag.AlignLeft, text
            )


def _decades(low: float, high: float) -> Any:
    """1, 2, 5, 10 ... between two counts; whole decades where there are many."""
    exponents = np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    steps = [1.0] if exponents.size > 5 else [1.0, 3.0] if exponents.size > 3 else [1.0, 2.0, 5.0]
    return np.sort(np.concatenate([step * 10**exponents for step in steps]))


def _round(value: float) -> float:
    return float(f"{value:.2g}") if abs(value) < 100 else float(f"{value:.3g}")

"""A plot of one trace that shares an axis with the image on the canvas beside it."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from qtpy.QtCore import QEvent, QObject, QPoint, QPointF, QRectF, Qt
from qtpy.QtGui import QColor, QHideEvent, QPainter, QPaintEvent, QPen, QPolygonF, QShowEvent
from qtpy.QtWidgets import QSizePolicy, QWidget

from .canvas_geometry import ScreenAxis, find_canvas, screen_axis
from .trace_colors import TraceColors, trace_colors
from .traces import Along, Trace, Traces
from .value_axis import ValueAxis, linear_ticks, tick_text

Array = NDArray[np.float64]

# Room for the labels of the axes beside the curves, in pixels of the screen; below a column
# stand the units in a second line.
BELOW, BELOW_COLUMN, LEFT = 17, 32, 40
# Least distances of ticks, across and down.
TICK_ACROSS, TICK_DOWN = 46, 24
ALIGN = Qt.AlignmentFlag


@dataclass(frozen=True)
class PlotArea:
    """Where a plot is drawn in its widget: along the trace, and across it for the counts.

    ``axis`` gives the place of a pixel along the trace; counts run from ``bottom`` to ``top``.
    """

    axis: ScreenAxis
    bottom: float
    top: float

    @property
    def room(self) -> float:
        """Length of the axis of counts."""
        return abs(self.top - self.bottom)

    def values(self, fractions: Array) -> Array:
        """Return the places of counts, given as fractions of their axis."""
        return self.bottom + (self.top - self.bottom) * fractions


class TracePlot(QWidget):  # type: ignore[misc]
    """The counts along a row or a column, as steps, with the expected counts as a line.

    A pixel lies exactly below, or beside, where the canvas shows it.

    Parameters
    ----------
    traces : Traces
        What is shown.
    along : {"row", "column"}
        Which of the two.
    """

    def __init__(self, traces: Traces, along: Along) -> None:
        super().__init__()
        self.traces, self.along = traces, along
        self._canvas: QWidget | None = None
        self._watching = False
        self._theme = ""
        self._colors: TraceColors | None = None
        self.setMinimumSize(60, 50)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        font = self.font()
        font.setPixelSize(11)
        self.setFont(font)

    # ---------------------------------------------------------------- only while in sight

    def showEvent(self, event: QShowEvent) -> None:
        """Follow traces, camera and canvas."""
        super().showEvent(event)
        if self._watching:
            return
        self._watching = True
        for emitter in self._emitters:
            emitter.connect(self._redraw)
        self.traces.watch()

    def hideEvent(self, event: QHideEvent) -> None:
        """Follow nothing."""
        super().hideEvent(event)
        if not self._watching:
            return
        self._watching = False
        for emitter in self._emitters:
            emitter.disconnect(self._redraw)
        self._follow_canvas(None)
        self.traces.unwatch()

    @property
    def _emitters(self) -> list[Any]:
        viewer = self.traces.scene.viewer
        camera, grid = viewer.scene.camera.events, viewer.canvas.grid.events
        return [
            self.traces.events.changed,
            camera.center,
            camera.zoom,
            camera.orientation,
            viewer.canvas.events.size,
            viewer.events.theme,
            *(grid.enabled, grid.stride, grid.shape, grid.spacing),
        ]

    def _redraw(self, event: Any = None) -> None:
        self.update()

    def _follow_canvas(self, canvas: QWidget | None) -> None:
        if canvas is not self._canvas:
            if self._canvas is not None:
                self._canvas.removeEventFilter(self)
            if canvas is not None:
                canvas.installEventFilter(self)
            self._canvas = canvas

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the canvas when it is moved, as by a dock that is opened."""
        if event.type() in (QEvent.Type.Move, QEvent.Type.Resize):
            self.update()
        return False

    # ---------------------------------------------------------------- geometry

    @property
    def colors(self) -> TraceColors:
        """Colours that suit the viewer's theme."""
        theme = self.traces.scene.viewer.theme
        if self._colors is None or theme != self._theme:
            self._theme, self._colors = theme, trace_colors(theme)
        return self._colors

    def area(self) -> PlotArea | None:
        """Return where the plot is drawn now; None if the canvas shows no such axis."""
        layer = self.traces.scene.counts.layer
        if self._canvas is None:
            self._follow_canvas(find_canvas(self))
        if layer is None or self._canvas is None:
            return None
        axis = screen_axis(self.traces.scene.viewer, layer, 1 if self.along == "row" else 0)
        if axis is None:
            return None
        offset = self._canvas.mapToGlobal(QPoint(0, 0)) - self.mapToGlobal(QPoint(0, 0))
        row = self.along == "row"
        shift, length = (
            (offset.x(), self.width()) if row else (offset.y(), self.height() - BELOW_COLUMN)
        )
        start = max(axis.start + shift, 0.0)
        stop = max(min(axis.stop + shift, float(length)), start)
        here = ScreenAxis(axis.origin + shift, axis.step, start, stop)
        if row:
            return PlotArea(here, bottom=self.height() - BELOW - 0.5, top=6.5)
        return PlotArea(here, bottom=LEFT - 0.5, top=self.width() - 10.5)

    # ---------------------------------------------------------------- drawing

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the plot."""
        colors = self.colors
        painter = QPainter(self)
        trace, area = self.traces.trace(self.along), self.area()
        if trace is None or area is None or area.axis.stop - area.axis.start < 2:
            return
        first, stop = area.axis.visible(trace.counts.size)
        counts, expected = trace.counts[first:stop], trace.expected[first:stop]
        values = ValueAxis(self.traces.scale, counts, expected, trace.background)
        painter.fillRect(self._inside(area), colors.background)
        self._draw_value_axis(painter, area, values)
        self._draw_pixel_axis(painter, area, first, stop)
        painter.setClipRect(self._inside(area).adjusted(-1, -1, 1, 1))
        if first < stop:
            edges = area.axis.to_canvas(np.arange(first, stop + 1) - 0.5)
            places, heights = steps(edges, area.values(values.fractions(counts)))
            self._draw_curve(painter, colors.counts, places, heights)
            centres = area.axis.to_canvas(np.arange(first, stop))
            line = area.values(values.fractions(expected))
            # A line of hundreds of peaks is no smoother for it, and slow.
            smooth = abs(area.axis.step) >= 0.5
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, smooth)
            self._draw_curve(painter, colors.expected, centres, line, 1.4 if smooth else 1.0)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        self._draw_marker(painter, area, trace)

    def _point(self, along: float, value: float) -> QPointF:
        return QPointF(along, value) if self.along == "row" else QPointF(value, along)

    def _inside(self, area: PlotArea) -> QRectF:
        first = self._point(area.axis.start, area.top)
        return QRectF(first, self._point(area.axis.stop, area.bottom)).normalized()

    def _draw_curve(
        self, painter: QPainter, color: Any, places: Array, heights: Array, width: float = 1.0
    ) -> None:
        places, heights = thinned(places, heights)
        x, y = (places, heights) if self.along == "row" else (heights, places)
        pen = QPen(color, width)
        pen.setCosmetic(True)
        painter.setPen(pen)
        painter.drawPolyline(QPolygonF(list(map(QPointF, x.tolist(), y.tolist()))))

    def _draw_value_axis(self, painter: QPainter, area: PlotArea, values: ValueAxis) -> None:
        row = self.along == "row"
        start, stop = area.axis.start, area.axis.stop
        most = max(int(area.room / (TICK_DOWN if row else TICK_ACROSS)), 1)
        # Where the canvas begins at the edge of the widget the labels stand among the curves.
        beside = start >= LEFT
        for fraction, text in values.ticks(most):
            place = float(area.values(np.array(fraction)))
            self._draw_rule(painter, (start, place), (stop, place), self.colors.grid)
            painter.setPen(self.colors.text)
            if row and beside:
                box = QRectF(start - LEFT, place - 8, LEFT - 5, 16)
                painter.drawText(box, ALIGN.AlignRight | ALIGN.AlignVCenter, text)
            elif row:
                box = QRectF(start + 3, place - 8, LEFT, 16)
                painter.drawText(box, ALIGN.AlignLeft | ALIGN.AlignVCenter, text)
            else:
                box = QRectF(min(place - 24, self.width() - 48), stop + 2, 48, 15)
                painter.drawText(box, ALIGN.AlignHCenter | ALIGN.AlignTop, text)
        if row and beside and start >= LEFT + 18:
            painter.save()
            painter.translate(start - LEFT - 14, (area.top + area.bottom) / 2)
            painter.rotate(-90)
            box = QRectF(-50, -8, 100, 16)
            painter.drawText(box, ALIGN.AlignCenter, values.unit)
            painter.restore()
        elif not row:
            box = QRectF(area.bottom, stop + 17, area.room, 15)
            painter.drawText(box, ALIGN.AlignHCenter | ALIGN.AlignTop, values.unit)

    def _draw_pixel_axis(self, painter: QPainter, area: PlotArea, first: int, stop: int) -> None:
        row, axis = self.along == "row", area.axis
        distance = TICK_ACROSS if row else TICK_DOWN
        most = max(int((stop - first) * abs(axis.step) / distance), 1)
        for pixel in linear_ticks(first, max(stop - 1, first), most):
            if pixel != int(pixel):
                continue
            place = float(axis.to_canvas(pixel))
            if not axis.start <= place <= axis.stop:
                continue
            self._draw_rule(painter, (place, area.bottom), (place, area.top), self.colors.grid)
            painter.setPen(self.colors.text)
            if row:
                box = QRectF(place - 24, area.bottom + 2, 48, 15)
                painter.drawText(box, ALIGN.AlignHCenter | ALIGN.AlignTop, tick_text(pixel))
            else:
                box = QRectF(0, place - 8, LEFT - 5, 16)
                painter.drawText(box, ALIGN.AlignRight | ALIGN.AlignVCenter, tick_text(pixel))
        unit = "x (px)" if row else "y (px)"
        if row and axis.start >= LEFT:
            box = QRectF(axis.start - LEFT, area.bottom + 2, LEFT - 5, 15)
            painter.drawText(box, ALIGN.AlignRight | ALIGN.AlignTop, unit)
        elif not row:
            box = QRectF(0, axis.stop + 17, LEFT - 5, 15)
            painter.drawText(box, ALIGN.AlignRight | ALIGN.AlignTop, unit)

    def _draw_marker(self, painter: QPainter, area: PlotArea, trace: Trace) -> None:
        place = float(area.axis.to_canvas(trace.position))
        if not self.traces.frozen:
            ends = (place, area.bottom), (place, area.top)
            self._draw_rule(painter, *ends, self.colors.marker)
            return
        painter.setPen(QPen(self.colors.marker, 1.0, Qt.PenStyle.DashLine))
        painter.drawLine(self._point(place, area.bottom), self._point(place, area.top))

    def _draw_rule(
        self,
        painter: QPainter,
        first: tuple[float, float],
        second: tuple[float, float],
        color: QColor,
    ) -> None:
        """Draw a straight line one pixel thick, as a rectangle: ten times as fast as a line."""
        ends = QRectF(self._point(*first), self._point(*second)).normalized()
        left, top = floor(ends.left()), floor(ends.top())
        painter.fillRect(left, top, max(int(ends.width()), 1), max(int(ends.height()), 1), color)


def steps(edges: Array, heights: Array) -> tuple[Array, Array]:
    """Return the corners of a curve of steps: one for each pixel, from edge to edge."""
    places = np.repeat(edges, 2)[1:-1]
    return places, np.repeat(heights, 2)


def thinned(places: Array, heights: Array) -> tuple[Array, Array]:
    """Thin out a curve with many points to a pixel of the screen; peaks keep their heights.

    Of the points on the same pixel stay the lowest and the highest.
    """
    length = abs(float(places[-1] - places[0])) if places.size else 0.0
    if places.size <= 3 * (length + 1):
        return places, heights
    column = np.floor(places).astype(np.int64)
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
    low = np.minimum.reduceat(heights, firsts)
    high = np.maximum.reduceat(heights, firsts)
    return np.repeat(places[firsts], 2), np.column_stack([low, high]).ravel()

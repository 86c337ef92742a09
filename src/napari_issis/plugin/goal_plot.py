"""The plot of what is reached against the exposure time, both logarithmic."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, log10

from qtpy.QtCore import QPointF, QRectF, Qt
from qtpy.QtGui import QColor, QPainter, QPaintEvent, QPen
from qtpy.QtWidgets import QSizePolicy, QWidget

from .trace_colors import trace_colors
from .value_axis import tick_text

LEFT, BELOW, ABOVE, RIGHT = 46, 32, 8, 10
ALIGN = Qt.AlignmentFlag


@dataclass(frozen=True)
class GoalCurve:
    """What is plotted.

    Parameters
    ----------
    label : str
        What is reached, with its unit.
    first : float
        What an exposure of 1 s reaches.
    power : float
        Of the time, with which it grows: 0.5 or -0.5.
    goal : float
        What is to be reached.
    now : float
        The present exposure time, s.
    full : float
        Exposure time after which a 16-bit memory is full, s; infinite if it never is.
    """

    label: str
    first: float
    power: float
    goal: float
    now: float
    full: float

    @property
    def solved(self) -> float:
        """Exposure time that reaches the goal, s."""
        return float((self.goal / self.first) ** (1 / self.power))

    def value(self, seconds: float) -> float:
        """Return what is reached after some seconds."""
        return float(self.first * seconds**self.power)

    @property
    def decades(self) -> tuple[int, int]:
        """Powers of ten of the seconds at the ends of the axis."""
        times = [self.solved, self.now]
        low, high = floor(log10(min(times)) - 0.3), ceil(log10(max(times)) + 0.3)
        return low, max(high, low + 1)


class GoalPlot(QWidget):  # type: ignore[misc]
    """Draws a `GoalCurve`, the goal, the time that reaches it and the present one."""

    def __init__(self) -> None:
        super().__init__()
        self.curve: GoalCurve | None = None
        self.theme = "dark"
        self.setMinimumSize(220, 130)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        font = self.font()
        font.setPixelSize(11)
        self.setFont(font)

    def show_curve(self, curve: GoalCurve | None, theme: str) -> None:
        """Draw another curve; None for none."""
        self.curve, self.theme = curve, theme
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the plot."""
        if self.curve is None:
            return
        curve, colors = self.curve, trace_colors(self.theme)
        low, high = curve.decades
        ends = sorted(log10(curve.value(10.0**each)) for each in (low, high))
        area = QRectF(
            LEFT, ABOVE, max(self.width() - LEFT - RIGHT, 1), max(self.height() - ABOVE - BELOW, 1)
        )

        def place(seconds: float, value: float) -> QPointF:
            x = area.left() + area.width() * (log10(seconds) - low) / (high - low)
            y = area.bottom() - area.height() * (log10(value) - ends[0]) / (ends[1] - ends[0])
            return QPointF(x, y)

        painter = QPainter(self)
        painter.fillRect(area, colors.background)
        for power in range(low, high + 1):
            x = place(10.0**power, curve.goal).x()
            self._rule(painter, QPointF(x, area.top()), QPointF(x, area.bottom()), colors.grid)
            painter.setPen(colors.text)
            box = QRectF(min(x - 24, self.width() - 48), area.bottom() + 1, 48, 14)
            painter.drawText(box, ALIGN.AlignCenter, tick_text(10.0**power))
        for value in _ticks(*ends):
            y = place(curve.now, value).y()
            self._rule(painter, QPointF(area.left(), y), QPointF(area.right(), y), colors.grid)
            painter.setPen(colors.text)
            box = QRectF(0, y - 8, LEFT - 4, 16)
            painter.drawText(box, ALIGN.AlignRight | ALIGN.AlignVCenter, tick_text(value))
        painter.drawText(
            QRectF(area.left(), area.bottom() + 14, area.width(), 16),
            ALIGN.AlignCenter,
            f"{curve.label} against exposure (s)",
        )
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(colors.counts, 1.6))
        painter.drawLine(*(place(10.0**each, curve.value(10.0**each)) for each in (low, high)))
        goal, now = place(curve.solved, curve.goal), place(curve.now, curve.value(curve.now))
        self._rule(painter, QPointF(area.left(), goal.y()), goal, colors.expected, dashed=True)
        self._rule(painter, goal, QPointF(goal.x(), area.bottom()), colors.expected, dashed=True)
        for point, color in ((goal, colors.expected), (now, colors.text)):
            painter.setPen(QPen(color, 1.2))
            painter.setBrush(color)
            painter.drawEllipse(point, 3.5, 3.5)
        texts = [(goal, "goal", colors.expected), (now, "now", colors.text)]
        if 10.0**low < curve.full < 10.0**high:
            x = place(curve.full, curve.goal).x()
            top = QPointF(x, area.top())
            self._rule(painter, top, QPointF(x, area.bottom()), colors.marker)
            texts.append((QPointF(x, area.top() + 14), "16 bit full", colors.marker))
        for point, text, color in texts:
            painter.setPen(color)
            right = point.x() > area.center().x()
            left = point.x() - 106 if right else point.x() + 6
            side = ALIGN.AlignRight if right else ALIGN.AlignLeft
            painter.drawText(QRectF(left, point.y() - 15, 100, 15), side, text)

    def _rule(
        self, painter: QPainter, first: QPointF, last: QPointF, color: QColor, dashed: bool = False
    ) -> None:
        painter.setPen(QPen(color, 1.0, Qt.PenStyle.DashLine if dashed else Qt.PenStyle.SolidLine))
        painter.drawLine(first, last)


def _ticks(low: float, high: float) -> list[float]:
    """Return round values between two powers of ten: 1, and 2 and 5 where there are few."""
    steps = (1,) if high - low > 2 else (1, 2, 5)
    powers = range(floor(low), ceil(high) + 1)
    values = [step * 10.0**power for power in powers for step in steps]
    return [value for value in values if low <= log10(value) <= high]

"""North and east, drawn over a corner of the canvas."""

from __future__ import annotations

from math import cos, hypot, radians, sin
from typing import Any

from qtpy.QtCore import QPointF, QRectF, Qt
from qtpy.QtGui import QColor, QHideEvent, QPainter, QPaintEvent, QPen, QPolygonF, QShowEvent
from qtpy.QtWidgets import QWidget

from .canvas_geometry import view_box
from .scene import Scene

SIZE, MARGIN, ARM = 76, 8, 24.0
# Readable over the dark image as over the light canvas of napari's light theme.
PLATE, INK = QColor(20, 24, 30, 170), QColor("#e8edf2")


class Compass(QWidget):  # type: ignore[misc]
    """Arrows to north and east, turned with the roll of the observation; the mouse passes by.

    Parameters
    ----------
    scene : Scene
        The live scene.
    canvas : QWidget
        The canvas over which it lies.
    """

    def __init__(self, scene: Scene, canvas: QWidget) -> None:
        super().__init__(canvas)
        self.scene = scene
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.resize(SIZE, SIZE)
        self._following = False
        self.hide()

    @property
    def _emitters(self) -> list[Any]:
        viewer = self.scene.viewer
        grid = viewer.canvas.grid.events
        return [
            self.scene.events.observation,
            viewer.scene.camera.events.orientation,
            viewer.canvas.events.size,
            *(grid.enabled, grid.stride, grid.shape, grid.spacing),
        ]

    def showEvent(self, event: QShowEvent) -> None:
        """Follow roll and canvas."""
        if not self._following:
            self._following = True
            for emitter in self._emitters:
                emitter.connect(self.place)
        self.place()
        super().showEvent(event)

    def hideEvent(self, event: QHideEvent) -> None:
        """Follow nothing."""
        if self._following:
            self._following = False
            for emitter in self._emitters:
                emitter.disconnect(self.place)
        super().hideEvent(event)

    def place(self, event: Any = None) -> None:
        """Take the upper right corner of the image's part of the canvas."""
        layer = self.scene.counts.layer
        if layer is not None and layer in self.scene.viewer.layers:
            box = view_box(self.scene.viewer, layer)
            self.move(round(box.left + box.width) - SIZE - MARGIN, round(box.top) + MARGIN)
        self.update()

    def directions(self) -> dict[str, tuple[float, float]]:
        """Return unit vectors to north and east on the screen, x to the right and y down."""
        roll = radians(self.scene.observation.roll)
        vertical, horizontal = self.scene.viewer.scene.camera.orientation2d
        right = 1.0 if horizontal == "right" else -1.0
        down = 1.0 if vertical == "down" else -1.0
        # On the frame, x along the columns and y along the rows.
        frame = {"N": (sin(roll), cos(roll)), "E": (-cos(roll), sin(roll))}
        return {name: (right * x, down * y) for name, (x, y) in frame.items()}

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw two arrows with their letters."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(PLATE)
        painter.drawRoundedRect(QRectF(self.rect()), 6, 6)
        font = self.font()
        font.setPixelSize(12)
        font.setBold(True)
        painter.setFont(font)
        directions = self.directions()
        # The corner of the arrows lies so that arrows and letters are in the middle.
        reach = ARM / 2
        (nx, ny), (ex, ey) = directions["N"], directions["E"]
        length = max(hypot(nx + ex, ny + ey), 1e-9)
        root = QPointF(
            SIZE / 2 - reach * (nx + ex) * 1.41 / length,
            SIZE / 2 - reach * (ny + ey) * 1.41 / length,
        )
        painter.setBrush(INK)
        for name, (x, y) in directions.items():
            tip = root + QPointF(x, y) * ARM
            painter.setPen(QPen(INK, 1.6))
            painter.drawLine(root, tip)
            painter.setPen(Qt.PenStyle.NoPen)
            side = QPointF(-y, x) * 3.5
            back = tip - QPointF(x, y) * 7
            painter.drawPolygon(QPolygonF([tip + QPointF(x, y) * 2, back + side, back - side]))
            painter.setPen(INK)
            middle = tip + QPointF(x, y) * 10
            box = QRectF(middle.x() - 8, middle.y() - 8, 16, 16)
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter, name)

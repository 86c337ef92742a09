"""Drags sources with a finger and a pen, as the window system reports them; run by a test.

The way of an event from the window system through Qt into napari is what matters here: Qt makes
mouse events of those of fingers and pens that nobody takes. PyQt has no public way to begin it,
so that functions of the library itself are called; where they are missing it prints ``skip``.
"""

from __future__ import annotations

import ctypes
import sys
from pathlib import Path

import napari
from PyQt6 import sip
from PyQt6.QtCore import QLibraryInfo, QPointF
from PyQt6.QtGui import QEventPoint, QInputDevice, QPointingDevice
from PyQt6.QtTest import QTest
from small_scene import SMALL, few_sources

from napari_issis import simulate
from napari_issis.plugin.canvas_geometry import find_canvas, to_view_box
from napari_issis.plugin.dock import SimulatorWidget
from napari_issis.plugin.scene import open_scene

TOUCH = (
    "_Z19qt_handleTouchEventP7QWindowPK15QPointingDeviceRK5QListI11QEventPointE6QFlagsIN2Qt16"
    "KeyboardModifierEE"
)
PEN = (
    "_ZN22QWindowSystemInterface17handleTabletEventEP7QWindowPK15QPointingDeviceRK7QPointFS7_"
    "6QFlagsIN2Qt11MouseButtonEEdddddiS8_INS9_16KeyboardModifierEE"
)
REGISTER = "_ZN22QWindowSystemInterface19registerInputDeviceEPK12QInputDevice"
State, Can, Kind = QEventPoint.State, QInputDevice.Capability, QInputDevice.DeviceType


class List(ctypes.Structure):
    """A QList that looks at memory of others."""

    _fields_ = (("d", ctypes.c_void_p), ("ptr", ctypes.c_void_p), ("size", ctypes.c_ssize_t))


def functions():
    """Return the functions of Qt that take touches and pens."""
    folder = QLibraryInfo.path(QLibraryInfo.LibraryPath.LibrariesPath)
    library = ctypes.CDLL(str(Path(folder) / "libQt6Gui.so.6"))
    touch, pen, register = library[TOUCH], library[PEN], library[REGISTER]
    pointer, number, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
    touch.argtypes = [pointer] * 3 + [number]
    pen.argtypes = [pointer] * 4 + [number] + [real] * 5 + [number] * 2
    register.argtypes = [pointer]
    return touch, pen, register


class Hand:
    """Drags on the canvas, with a finger or a pen."""

    def __init__(self, scene, native) -> None:
        self.scene, self.native = scene, native
        self.touch_, self.pen_, register = functions()
        self.window = sip.unwrapinstance(native.window().windowHandle())
        self.finger = QPointingDevice(
            "finger", 77, Kind.TouchScreen, QPointingDevice.PointerType.Finger, Can.Position, 5, 0
        )
        self.stylus = QPointingDevice(
            "pen", 78, Kind.Stylus, QPointingDevice.PointerType.Pen,
            Can.Position | Can.Pressure, 1, 3,
        )  # fmt: skip
        register(sip.unwrapinstance(self.finger))
        register(sip.unwrapinstance(self.stylus))

    def where(self, place) -> tuple[QPointF, QPointF]:
        at = to_view_box(self.scene.viewer, self.scene.counts.layer, place[::-1])
        on_screen = self.native.mapToGlobal(QPointF(*at))
        return self.native.window().mapFromGlobal(on_screen), on_screen

    def touch(self, state, place) -> None:
        point = QEventPoint(1, state, *self.where(place))
        points = List(None, sip.unwrapinstance(point), 1)
        device = sip.unwrapinstance(self.finger)
        self.touch_(self.window, device, ctypes.addressof(points), 0)
        QTest.qWait(20)

    def write(self, pressed, place) -> None:
        points = self.where(place)
        inside, on_screen = (sip.unwrapinstance(point) for point in points)
        device = sip.unwrapinstance(self.stylus)
        self.pen_(self.window, device, inside, on_screen, pressed, pressed / 2, 0, 0, 0, 0, 0, 0)
        QTest.qWait(20)

    def drag_finger(self, *places) -> None:
        self.touch(State.Pressed, places[0])
        for place in places[1:]:
            self.touch(State.Updated, place)
        self.touch(State.Released, places[-1])

    def drag_pen(self, *places) -> None:
        self.write(0, places[0])
        for place in places:
            self.write(1, place)
        self.write(0, places[-1])


def main() -> None:
    """Drag a star and a galaxy; print what became of them."""
    viewer = napari.Viewer()
    viewer.window.resize(1200, 800)
    scene = open_scene(few_sources(), SMALL, viewer=viewer, dock=False)
    panel = SimulatorWidget(viewer)
    viewer.window.add_dock_widget(panel, name="panel")
    scene.wait()
    QTest.qWait(300)
    viewer.reset_view()
    try:
        hand = Hand(scene, find_canvas(panel))
    except (AttributeError, OSError):
        print("skip")
        return
    for drag in (hand.drag_finger, hand.drag_pen):
        for row, start, end in ((0, (20.25, 12.5), (30.0, 20.0)), (2, (40.0, 30.0), (46.0, 40.0))):
            scene.sources = few_sources()
            scene.wait()
            QTest.qWait(100)
            drag(start, (start[0] + 3, start[1] + 4), end)
            scene.wait()
            table, step = scene.sources, scene.editor.history.last_step
            same = scene.exposure == simulate(table, SMALL)
            print(f"{table['x'][row]:.3f} {table['y'][row]:.3f} {step.replace(' ', '-')} {same}")
    sys.stdout.flush()
    viewer.close()


if __name__ == "__main__":
    main()

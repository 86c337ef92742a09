"""Timers that go off once each time they are started."""

from __future__ import annotations

from collections.abc import Callable

from qtpy.QtCore import QObject, QTimer


def single_shot(
    then: Callable[[], object], milliseconds: int = 0, parent: QObject | None = None
) -> QTimer:
    """Make a timer that calls a function so long after its last start."""
    timer = QTimer(parent)
    timer.setSingleShot(True)
    timer.setInterval(milliseconds)
    timer.timeout.connect(then)
    return timer

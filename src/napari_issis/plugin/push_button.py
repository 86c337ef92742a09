"""A button with a tooltip that does one thing."""

from __future__ import annotations

from collections.abc import Callable

from qtpy.QtWidgets import QPushButton


def push_button(label: str, tooltip: str, action: Callable[[], object]) -> QPushButton:
    """Make a button that calls ``action`` without the flag that Qt hands over."""
    button = QPushButton(label)
    button.setToolTip(tooltip)
    button.clicked.connect(lambda _=False: action())
    return button

"""Typing as a user does."""

from qtpy.QtCore import Qt
from qtpy.QtTest import QTest


def enter(field, text):
    """Type a text over what a field holds, and press Enter."""
    field.native.selectAll()
    QTest.keyClicks(field.native, text)
    QTest.keyClick(field.native, Qt.Key.Key_Return)

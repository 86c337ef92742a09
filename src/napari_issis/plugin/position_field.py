"""A position on the sky that is typed as text."""

from __future__ import annotations

from typing import Any

from astropy.coordinates import SkyCoord
from magicgui.widgets import LineEdit

from ..frame_coordinates import read_position
from .number_field import INVALID_STYLE

HELP = "Right ascension and declination of the frame's centre; empty if the frame has no place"


class PositionField(LineEdit):
    """A text field for a position; red, with the reason as tooltip, while it holds no valid one."""

    def __init__(self) -> None:
        super().__init__(tooltip=HELP)
        self.native.setPlaceholderText("RA Dec")
        self.changed.connect(self._mark)

    @property
    def position(self) -> SkyCoord | None:
        """The position, None if the field is empty; a ``ValueError`` if there is no valid one."""
        return read_position(self.value) if self.value.strip() else None

    @position.setter
    def position(self, position: SkyCoord | None) -> None:
        self.value = (
            "" if position is None else position.icrs.to_string("hmsdms", sep=":", precision=3)
        )
        # the field is narrow: its start tells more than its end
        self.native.setCursorPosition(0)

    def _mark(self, event: Any = None) -> None:
        try:
            _ = self.position
        except ValueError as error:
            self.native.setStyleSheet(INVALID_STYLE)
            self.native.setToolTip(str(error))
        else:
            self.native.setStyleSheet("")
            self.native.setToolTip(HELP)

"""The keys and what they do: for the help in the dock, and for the table in README."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qtpy.QtCore import Qt
from qtpy.QtWidgets import QDialog, QDialogButtonBox, QLabel, QVBoxLayout, QWidget

from .layer_keys import DELETE_KEYS, FINE_STEP, KIND_KEY
from .trace_docks import FREEZE_KEY
from .zoom import FIT_KEY, KEYS


@dataclass(frozen=True)
class Shortcut:
    """Keys and what they do.

    Attributes
    ----------
    keys : tuple of str
        As napari writes them, such as ``Control-Z``.
    action : str
        What they do.
    canvas, panel, sources : bool
        Whether they act over the image (with an ISSIS layer active), in the panel, in the list.
    ours : bool
        Whether this plugin binds them; the others are napari's or Qt's.
    """

    keys: tuple[str, ...]
    action: str
    canvas: bool = True
    panel: bool = False
    sources: bool = False
    ours: bool = True

    @property
    def keys_text(self) -> str:
        """The keys as they are written in menus."""
        return ", ".join(shown(key) for key in self.keys)

    @property
    def where(self) -> str:
        """Where they act, in words."""
        places = (("image", self.canvas), ("panel", self.panel), ("list", self.sources))
        return ", ".join(name for name, there in places if there)


def shown(key: str) -> str:
    """Write a key of napari's as it is written in menus, such as ``Ctrl+Z``."""
    return key.replace("Control-", "Ctrl+").replace("-", "+")


ARROW_KEYS = ("Left", "Right", "Up", "Down")
SHORTCUTS = (
    Shortcut(ARROW_KEYS, "Move the selected sources by 1 pixel"),
    Shortcut(tuple(f"Shift-{key}" for key in ARROW_KEYS), f"Move them by {FINE_STEP:g} pixel"),
    Shortcut(("Control-Z",), "Undo", panel=True, sources=True),
    Shortcut(("Control-Shift-Z",), "Redo", panel=True, sources=True),
    Shortcut(tuple(KEYS.values()), "Zoom by this factor"),
    Shortcut((FIT_KEY,), "Show the whole frame"),
    Shortcut((FREEZE_KEY,), "Freeze the traces, or let them follow the pointer"),
    Shortcut((KIND_KEY,), "Make the selected sources the next kind"),
    Shortcut(DELETE_KEYS, "Remove the selected sources"),
    Shortcut(("Control-C", "Control-V"), "Copy, paste the selected sources", ours=False),
    Shortcut(("Delete",), "Remove the selected sources", canvas=False, sources=True),
    Shortcut(("Control-C", "Control-V"), "Copy, paste rows as text", canvas=False, sources=True),
    Shortcut(("Control-Tab",), "The other tab", canvas=False, panel=True, ours=False),
    Shortcut(
        ("Alt-letter",), "The control with this letter underlined", canvas=False, panel=True,
        sources=True, ours=False,
    ),
)  # fmt: skip


def markdown_table() -> str:
    """Return the table of README."""
    rows = [f"| {each.keys_text} | {each.where} | {each.action} |" for each in SHORTCUTS]
    return "\n".join(["| keys | in | what they do |", "|---|---|---|", *rows])


class KeysDialog(QDialog):  # type: ignore[misc]
    """The list of keys in a window of its own; Escape closes it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle("ISSIS keys")
        rows = (
            f"<tr><td><b>{each.keys_text}</b></td><td>&nbsp;{each.where}&nbsp;</td>"
            f"<td>{each.action}</td></tr>"
            for each in SHORTCUTS
        )
        text = QLabel(
            f"<table cellpadding='2'>{''.join(rows)}</table>"
            "<p>Drag a source to move it, double click to remove it, Shift+click to select more."
            "<br>The keys of the image act while it has the focus and an ISSIS layer is active.</p>"
        )
        text.setTextFormat(Qt.TextFormat.RichText)
        close = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        close.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(text)
        layout.addWidget(close)


def show_keys(parent: Any) -> None:
    """Open the list of keys beside the work, which goes on meanwhile."""
    dialog = KeysDialog(parent)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.show()

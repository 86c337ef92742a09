"""Asks for what else a proposal sheet should say, and writes it in the background."""

from __future__ import annotations

import os
from typing import Any

from napari.utils.notifications import show_info
from qtpy.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QDoubleSpinBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QWidget,
)

from ..sheet import proposal_sheet
from .background_job import BackgroundJob
from .scene import Scene

HIGHEST_SNR = 1e6


class SheetDialog(QDialog):  # type: ignore[misc]
    """Title, notes and goal of a proposal sheet on the live scene.

    Parameters
    ----------
    scene : Scene
        The live scene.
    parent : QWidget
        The widget over which it opens.
    """

    def __init__(self, scene: Scene, parent: QWidget) -> None:
        super().__init__(parent)
        self.scene = scene
        self.setWindowTitle("Proposal sheet")
        self.job = BackgroundJob(self, "Proposal sheet", self._written)
        self.title_ = QLineEdit()
        self.title_.setToolTip("Heading of the page")
        self.notes = QPlainTextEdit()
        self.notes.setToolTip("Text below the heading")
        self.notes.setPlaceholderText("Text below the heading")
        self.notes.setTabChangesFocus(True)
        self.notes.setFixedHeight(5 * self.fontMetrics().height())
        self.snr = QDoubleSpinBox()
        self.snr.setRange(0, HIGHEST_SNR)
        self.snr.setDecimals(1)
        self.snr.setSpecialValueText("none")
        self.snr.setToolTip(
            "The page tells the exposure time after which each selected source has this "
            "signal-to-noise ratio"
        )
        self.who = QLabel()
        form = QFormLayout(self)
        form.addRow("&Title", self.title_)
        form.addRow("&Notes", self.notes)
        form.addRow("&S/N goal", self.snr)
        form.addRow("", self.who)
        buttons = QDialogButtonBox(
            QDialogButtonBox.StandardButton.Save | QDialogButtonBox.StandardButton.Cancel
        )
        buttons.accepted.connect(self.save)
        buttons.rejected.connect(self.reject)
        form.addRow(buttons)

    def open_for_selection(self) -> None:
        """Show the dialog; the goal is for what is selected now."""
        count = len(self.selected_rows())
        of = {0: "select sources for a goal", 1: "of the selected source"}
        self.who.setText(of.get(count, f"of the worst of {count} selected sources"))
        self.snr.setEnabled(count > 0)
        self.show()
        self.raise_()

    def selected_rows(self) -> list[int]:
        """Rows of the source table that are selected."""
        rows = (self.scene.editor.row_of(one) for one in self.scene.editor.selected_ids)
        return sorted(row for row in rows if row is not None)

    def save(self) -> None:
        """Ask for a file, and write the page to it in the background."""
        path = self.ask_path()
        if path is None:
            return
        self.accept()
        scene, rows, snr = self.scene, self.selected_rows(), self.snr.value()
        sources, observation, seed = scene.sources, scene.observation, scene.seed
        options: dict[str, Any] = {
            "title": self.title_.text(),
            "notes": self.notes.toPlainText(),
            "goals": [{"rows": rows, "snr": snr}] if rows and snr > 0 else [],
        }

        def write() -> str:
            # the dialog has asked before it chose a file that exists
            proposal_sheet(sources, observation, path, seed=seed, overwrite=True, **options)
            return path

        self.job.start(write)

    def ask_path(self) -> str | None:
        """Ask for the file to write; None if the user changed his mind."""
        dialog = QFileDialog(self, "Save proposal sheet", "sheet.html", "HTML (*.html)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("html")
        return os.fspath(dialog.selectedFiles()[0]) if dialog.exec() else None

    def _written(self, path: str) -> None:
        show_info(f"Saved {path}")

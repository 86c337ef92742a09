"""Aperture photometry of the live scene as a table beside the truth."""

from __future__ import annotations

import os
import warnings
from typing import Any

import numpy as np
from astropy.table import QTable
from napari.utils.notifications import show_error, show_info
from qtpy.QtCore import Qt
from qtpy.QtWidgets import (
    QComboBox,
    QDialog,
    QDoubleSpinBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from ..apertures import SKIES, aperture_photometry
from ..exposure import Exposure, simulate
from ..limits import CountRateWarning
from ..result_table import SUFFIXES, write_table
from .background_job import BackgroundJob
from .push_button import push_button
from .scene import Scene

# Columns that are shown: name, heading, format.
SHOWN = (
    ("row", "source", "d"),
    ("kind", "kind", "s"),
    ("aperture_counts", "in aperture (ct)", ".6g"),
    ("sky", "sky (ct/px)", ".4g"),
    ("net_counts", "net (ct)", ".6g"),
    ("aperture_correction", "correction", ".4f"),
    ("counts", "counts", ".6g"),
    ("counts_error", "error", ".4g"),
    ("snr", "S/N", ".4g"),
    ("true_counts", "truth (ct)", ".6g"),
    ("bias_percent", "bias (%)", "+.3g"),
    ("bias_sigma", "bias (σ)", "+.3g"),
)
# Rows beyond which only the saved table holds them.
MOST_ROWS = 2000


class PhotometryDialog(QDialog):  # type: ignore[misc]
    """Measures the selected sources, or all, in apertures, and saves the table.

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
        self.table: QTable | None = None
        self.setWindowTitle("Aperture photometry")
        self.resize(960, 320)
        self.job = BackgroundJob(self, "Aperture photometry", self.show_table, self._failed)
        self.radius = _number(5.0, 0.5, 500.0, "Radius of the apertures of stars, pixels")
        self.scale = _number(
            2.0, 0.1, 20.0, "Apertures of extended sources over their half-light ellipse"
        )
        self.sky = QComboBox()
        self.sky.addItems(SKIES)
        self.sky.setToolTip(
            "Sky to subtract: what was put in, or mean or median of the annulus, clipped at 3 "
            "sigma. Of a few counts per pixel only the known one is right"
        )
        self.inner = _number(2.0, 1.0, 20.0, "Inner edge of the annulus over the aperture's")
        self.outer = _number(3.0, 1.1, 30.0, "Outer edge of the annulus over the aperture's")
        self.measure_button = push_button(
            "&Measure", "Measure the selected sources; all if none is selected", self.measure
        )
        self.save_button = push_button(
            "&Save…", "Write the whole table to a file: ECSV or CSV", self.save
        )
        self.save_button.setEnabled(False)
        self.text = QLabel()
        options = QHBoxLayout()
        for label, widget in (
            ("&Radius (px)", self.radius),
            ("E&xtended ×", self.scale),
            ("S&ky", self.sky),
            ("&Annulus ×", self.inner),
            ("&to ×", self.outer),
        ):
            name = QLabel(label)
            name.setBuddy(widget)
            options.addWidget(name)
            options.addWidget(widget)
        options.addStretch(1)
        options.addWidget(self.measure_button)
        options.addWidget(self.save_button)
        self.view = QTableWidget(0, len(SHOWN))
        self.view.setHorizontalHeaderLabels([heading for _, heading, _ in SHOWN])
        self.view.setEditTriggers(QTableWidget.EditTrigger.NoEditTriggers)
        self.view.setTabKeyNavigation(False)
        self.view.verticalHeader().hide()
        self.view.setToolTip(
            "Bias: what the same measurement of the expected image gives too much, by the "
            "neighbours' light"
        )
        layout = QVBoxLayout(self)
        layout.addLayout(options)
        layout.addWidget(self.view)
        layout.addWidget(self.text)

    def measure(self) -> None:
        """Measure in the background."""
        scene = self.scene
        rows = [scene.editor.row_of(one) for one in scene.editor.selected_ids]
        chosen = sorted(row for row in rows if row is not None) or None
        options: dict[str, Any] = {
            "radius": self.radius.value(),
            "scale": self.scale.value(),
            "sky": self.sky.currentText(),
            "annulus": (self.inner.value(), self.outer.value()),
        }
        kept = scene.picture.exposure if scene.settled and scene.picture is not None else None
        sources, observation, seed = scene.sources, scene.observation, scene.seed

        def work() -> QTable:
            return aperture_photometry(
                kept or _simulated(sources, observation, seed), rows=chosen, **options
            )

        self.text.setText("Measuring…")
        self.job.start(work)

    def show_table(self, table: QTable) -> None:
        """Show what was measured."""
        self.table = table
        shown = table[:MOST_ROWS]
        self.view.setRowCount(len(shown))
        for column, (name, _, form) in enumerate(SHOWN):
            values = np.asarray(getattr(shown[name], "value", shown[name]))
            for row, value in enumerate(values.tolist()):
                item = QTableWidgetItem(format(value, form))
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.view.setItem(row, column, item)
        self.view.resizeColumnsToContents()
        more = f", the first {MOST_ROWS} shown" if len(table) > MOST_ROWS else ""
        out = int(np.count_nonzero(~np.asarray(table["complete"])))
        edge = f"; {out} apertures reach beyond the frame" if out else ""
        count = "1 source" if len(table) == 1 else f"{len(table)} sources"
        self.text.setText(f"{count}{more}{edge}")
        self.save_button.setEnabled(True)

    def _failed(self) -> None:
        self.text.setText("")

    def save(self) -> None:
        """Ask for a file and write the table to it; an error is shown."""
        if self.table is None:
            return
        path = self.ask_path()
        if path is None:
            return
        try:
            # the dialog has asked before it chose a file that exists
            write_table(self.table, path, overwrite=True)
        except (OSError, ValueError) as error:
            show_error(str(error))
        else:
            show_info(f"Saved {path}")

    def ask_path(self) -> str | None:
        """Ask for the file to write; None if the user changed his mind."""
        names = f"Tables ({' '.join('*' + suffix for suffix in SUFFIXES)})"
        dialog = QFileDialog(self, "Save photometry", "photometry.ecsv", names)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("ecsv")
        return os.fspath(dialog.selectedFiles()[0]) if dialog.exec() else None


def _simulated(sources: QTable, observation: Any, seed: int) -> Exposure:
    with warnings.catch_warnings():
        # the panel shows them already
        warnings.simplefilter("ignore", CountRateWarning)
        return simulate(sources, observation, seed=seed)


def _number(value: float, low: float, high: float, tooltip: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setRange(low, high)
    box.setSingleStep(0.5)
    box.setValue(value)
    box.setToolTip(tooltip)
    return box

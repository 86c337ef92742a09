"""A window that shows recovered light curves and saves them."""

from __future__ import annotations

from io import BytesIO, StringIO
from pathlib import Path

from astropy.table import QTable
from napari.utils.notifications import show_error, show_info
from qtpy.QtGui import QPixmap
from qtpy.QtWidgets import (
    QDialog,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from ..light_curve_plot import plot_light_curves
from ..safe_write import replacing
from .push_button import push_button

# What may be saved: the numbers in the first two, the plot in the others.
TABLES = {".ecsv": "ascii.ecsv", ".csv": "ascii.csv"}
PLOTS = (".png", ".pdf", ".svg")
ENDINGS = (*TABLES, *PLOTS)
LARGEST = (1000, 640)


class CurvesWindow(QDialog):  # type: ignore[misc]
    """The plot, with a button that saves it or its numbers.

    Parameters
    ----------
    parent : QWidget
        Whose window it belongs to.
    table : astropy.table.QTable
        What `fit_light_curves` returned.
    picture : bytes
        The plot as PNG.
    """

    def __init__(self, parent: QWidget, table: QTable, picture: bytes) -> None:
        super().__init__(parent)
        self.table = table
        self.setWindowTitle("ISSIS light curves")
        self.plot = QLabel()
        pixels = QPixmap()
        pixels.loadFromData(picture)
        self.plot.setPixmap(pixels)
        self.plot.setToolTip("Points: fitted fluxes with forecast errors. Lines: as planned")
        scroll = QScrollArea()
        scroll.setWidget(self.plot)
        save = push_button(
            "&Save…",
            f"Save the numbers (.ecsv, .csv) or the plot ({', '.join(PLOTS)})",
            self.ask,
        )
        line = QHBoxLayout()
        line.addStretch(1)
        line.addWidget(save)
        layout = QVBoxLayout(self)
        layout.addWidget(scroll)
        layout.addLayout(line)
        width, height = pixels.width() + 50, pixels.height() + 80
        self.resize(min(width, LARGEST[0]), min(height, LARGEST[1]))

    def ask(self) -> None:
        """Ask for a file and save to it; an error is shown."""
        kinds = f"Numbers or plot ({' '.join('*' + ending for ending in ENDINGS)})"
        path, _ = QFileDialog.getSaveFileName(self, "Save", "light_curves.ecsv", kinds)
        if not path:
            return
        try:
            self.save(Path(path))
        except (OSError, ValueError) as error:
            show_error(str(error))
        else:
            show_info(f"Saved {path}")

    def save(self, path: Path) -> None:
        """Save the numbers or the plot, by the name's ending; an existing file is replaced."""
        ending = path.suffix.lower()
        content: bytes = b""
        if ending in TABLES:
            text = StringIO()
            self.table.write(text, format=TABLES[ending])
            content = text.getvalue().encode()
        elif ending in PLOTS:
            drawn = BytesIO()
            plot_light_curves(self.table).savefig(drawn, format=ending[1:], dpi=110)
            content = drawn.getvalue()
        with replacing(path, ENDINGS, overwrite=True) as file:
            file.write(content)

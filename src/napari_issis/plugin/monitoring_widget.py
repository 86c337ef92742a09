"""A dock widget that monitors the scene: a stack with a slider, a cube, light curves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from astropy.table import QTable
from napari.utils.notifications import show_error, show_info
from qtpy.QtCore import Signal
from qtpy.QtGui import QShowEvent
from qtpy.QtWidgets import (
    QFileDialog,
    QHBoxLayout,
    QProgressBar,
    QVBoxLayout,
    QWidget,
)

from ..light_curve_fit import fit_light_curves
from ..light_curve_plot import plot_light_curves
from ..monitoring import Monitoring
from .curves_window import CurvesWindow
from .latest_wins import LatestWins
from .monitoring_form import MonitoringForm
from .monitoring_layer import show_monitoring
from .panels import FirstPlace, share_place
from .push_button import push_button
from .scene import open_scene
from .writer import fits_path

Tell = Callable[[int, int], None]


class _Cancelled(Exception):
    """The user wants the job no more."""


@dataclass(frozen=True)
class _Done:
    """What a job made, and what the GUI does with it."""

    then: Callable[[Any], None]
    result: Any


class MonitoringWidget(QWidget):  # type: ignore[misc]
    """Plans a monitoring of the scene and shows what it gives.

    Parameters
    ----------
    napari_viewer : napari.Viewer
        The viewer; it gets a scene if it has none.
    """

    told = Signal(int, int)

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.scene = open_scene(viewer=napari_viewer, dock=False)
        self.form = MonitoringForm()
        self.buttons = [
            push_button("Show stac&k", "Add the epochs as a layer with a slider", self.show_stack),
            push_button("Save cube…", "Save one co-added frame an epoch as FITS", self.save_cube),
            push_button(
                "Li&ght curves",
                "Simulate all exposures, fit all fluxes at each epoch, and plot them",
                self.recover,
            ),
        ]
        self.bar = QProgressBar()
        self.bar.setToolTip("How far the job is")
        self.cancel = push_button("Cancel", "Stop; nothing is shown or saved", self.stop)
        self.curves: CurvesWindow | None = None
        self._jobs = LatestWins(self._done, self._failed)
        self._wanted = 0
        self._place = FirstPlace(self, napari_viewer, share_place)
        self.told.connect(self._show_progress)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 2, 4, 4)
        layout.addWidget(self.form)
        line = QHBoxLayout()
        for button in self.buttons:
            line.addWidget(button)
        layout.addLayout(line)
        line = QHBoxLayout()
        line.addWidget(self.bar, 1)
        line.addWidget(self.cancel)
        layout.addLayout(line)
        layout.addStretch(1)
        self._idle()

    @property
    def busy(self) -> bool:
        """Whether a job runs."""
        return self._jobs.busy

    # ---------------------------------------------------------------- the three jobs

    def show_stack(self) -> None:
        """Add the epochs as a layer of the viewer."""

        def shown(plan: Monitoring) -> None:
            show_monitoring(plan, self.scene.viewer)

        self._start(lambda plan, tell: plan, shown)

    def save_cube(self) -> None:
        """Ask for a file and write the co-added epochs."""
        path, _ = QFileDialog.getSaveFileName(
            self, "Save the epochs as a cube", "monitoring.fits", "FITS (*.fits)"
        )
        if not path:
            return
        path = fits_path(path)

        def write(plan: Monitoring, tell: Tell) -> str:
            # The dialog has asked before it chose a file that exists.
            plan.write_cube(path, overwrite=True, progress=tell)
            return path

        self._start(write, lambda path: show_info(f"Saved {path}"))

    def recover(self) -> None:
        """Fit the light curves and show the plot in a window of its own."""

        def fit(plan: Monitoring, tell: Tell) -> tuple[QTable, bytes]:
            table = fit_light_curves(plan, progress=tell)
            # drawn here, since it takes far longer than a frame of the GUI
            picture = BytesIO()
            plot_light_curves(table, picture)
            return table, picture.getvalue()

        def shown(result: tuple[QTable, bytes]) -> None:
            self.curves = CurvesWindow(self, *result)
            self.curves.show()

        self._start(fit, shown)

    def stop(self) -> None:
        """Give the job up."""
        self._wanted += 1
        self._jobs.cancel()
        self._idle()

    # ---------------------------------------------------------------- in between

    def showEvent(self, event: QShowEvent) -> None:
        """Take a place when shown first."""
        super().showEvent(event)
        self._place.take()

    def _start(self, job: Callable[[Monitoring, Tell], Any], then: Callable[[Any], None]) -> None:
        try:
            settings = self.form.settings()
        except ValueError as error:
            show_error(str(error))
            return
        self._wanted += 1
        number, sources, observation = self._wanted, self.scene.sources, self.scene.observation

        def tell(done: int, total: int) -> None:
            if number != self._wanted:
                raise _Cancelled
            self.told.emit(done, total)

        def whole() -> _Done:
            plan = settings.plan(sources, observation)
            tell(0, 0)
            return _Done(then, job(plan, tell))

        for button in self.buttons:
            button.setEnabled(False)
        self.bar.setRange(0, 0)
        self.bar.setVisible(True)
        self.cancel.setVisible(True)
        self._jobs.request(whole)

    def _idle(self) -> None:
        for button in self.buttons:
            button.setEnabled(True)
        self.bar.setVisible(False)
        self.cancel.setVisible(False)

    def _show_progress(self, done: int, total: int) -> None:
        self.bar.setRange(0, total)
        self.bar.setValue(done)

    def _done(self, done: _Done) -> None:
        self._idle()
        done.then(done.result)

    def _failed(self, error: BaseException) -> None:
        if isinstance(error, _Cancelled):
            return
        self._idle()
        show_error(str(error))

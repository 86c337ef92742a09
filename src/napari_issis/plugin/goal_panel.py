"""The exposure time that a goal takes: chosen sources, the plot, and a button to use it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from qtpy.QtGui import QHideEvent, QShowEvent
from qtpy.QtWidgets import (
    QComboBox,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from ..detector import WORD
from ..exposure_goal import after_one_second, checked_rows, seconds_for
from ..fisher import Covariance, covariance
from ..limits import count_rate_warnings
from ..observation import Observation
from .goal_plot import GoalCurve, GoalPlot
from .instrument_form import style_warning
from .number_field import NumberField
from .panels import FirstPlace, follow, share_place
from .push_button import push_button
from .scene import open_scene
from .scene_forecast import SceneForecast

# name: label, unit of the target, what it is in the unit of the forecast, first target
GOALS: dict[str, tuple[str, str, Callable[[Observation], float], float]] = {
    "snr": ("S/N", "", lambda where: 1.0, 20.0),
    "flux_ratio": ("error of the flux ratio", "%", lambda where: 0.01, 1.0),
    "position": ("error of x or y", "mas", lambda where: 1e-3 / where.pixel_scale, 1.0),
}


class GoalPanel(QWidget):  # type: ignore[misc]
    """Solves for the exposure time of the live scene.

    Parameters
    ----------
    napari_viewer : napari.Viewer
        The viewer; it gets a scene if it has none.
    """

    def __init__(self, napari_viewer: Any) -> None:
        super().__init__()
        self.scene = open_scene(viewer=napari_viewer, dock=False)
        # what is solved for does not depend on the exposure there is
        self.forecast = SceneForecast(
            self.scene, covariance, lambda observation: observation.replace(exposure=1.0)
        )
        self.kind = QComboBox()
        for name, (label, unit, _, _) in GOALS.items():
            self.kind.addItem(f"{label} ({unit})" if unit else label, name)
        self.kind.setToolTip("What is to be reached; the flux ratio is that of two sources")
        self._targets = {name: goal[3] for name, goal in GOALS.items()}
        self.target = NumberField(
            "goal", 20.0, "The value to be reached, in the unit of the goal", check=_positive
        )
        self.chosen = QLabel()
        self.chosen.setWordWrap(True)
        self.answer = QLabel()
        self.answer.setWordWrap(True)
        self.plot = GoalPlot()
        self.warning = QLabel()
        self.warning.setWordWrap(True)
        style_warning(self.warning)
        self.button = push_button(
            "&Use this exposure",
            "Set the scene's exposure time to the one that reaches the goal",
            self.use,
        )
        line = QHBoxLayout()
        line.addWidget(self.kind, 2)
        line.addWidget(self.target.native, 1)
        form = QFormLayout()
        form.setContentsMargins(0, 0, 0, 0)
        form.addRow("&Goal", line)
        form.addRow("For", self.chosen)
        form.labelForField(line).setBuddy(self.kind)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 4, 6, 4)
        layout.addLayout(form)
        layout.addWidget(self.answer)
        layout.addWidget(self.plot, 1)
        layout.addWidget(self.warning)
        layout.addWidget(self.button)
        self.seconds: float | None = None
        self._shown_kind = "snr"
        self._following = False
        self._place = FirstPlace(self, napari_viewer, share_place)
        self.kind.currentIndexChanged.connect(self._kind_changed)
        self.target.changed.connect(self.show_answer)
        self.forecast.changed.connect(self.show_answer)

    @property
    def goal(self) -> str:
        """Name of the goal: snr, flux_ratio or position."""
        return str(self.kind.currentData())

    @property
    def rows(self) -> list[int]:
        """Rows of the selected sources; all if none is selected."""
        editor = self.scene.editor
        selected = np.flatnonzero(np.isin(editor.source_id, list(editor.selected_ids)))
        return selected.tolist() if selected.size else list(range(editor.source_id.size))

    def use(self) -> None:
        """Give the scene the exposure time that reaches the goal."""
        if self.seconds is not None:
            self.scene.observation = self.scene.observation.replace(exposure=self.seconds)

    # ---------------------------------------------------------------- what is shown

    def _kind_changed(self, event: Any = None) -> None:
        with suppress(ValueError):
            self._targets[self._shown_kind] = self.target.number
        self._shown_kind = self.goal
        self.target.number = self._targets[self.goal]
        self.show_answer()

    def show_answer(self, event: Any = None) -> None:
        """Show the exposure time for the goal, the sources and the scene as they are now."""
        if not self._following:
            return
        rows, selected = self.rows, bool(self.scene.editor.selected_ids)
        self.chosen.setText(_named(rows, selected, self.goal))
        self.seconds, curve = None, None
        result: Covariance | None = self.forecast.result
        if self.forecast.pending:
            text = "computing …"
        elif result is None:
            text = "no forecast"
        else:
            try:
                curve, text = self._solve(result, rows)
            except ValueError as error:
                text = str(error)
        if curve is not None:
            self.seconds = float(f"{curve.solved:.6g}")
        self.answer.setText(text)
        self.button.setEnabled(self.seconds is not None)
        self.plot.show_curve(curve, self.scene.viewer.theme)
        self._show_warnings(None if self.forecast.pending else result)

    def _solve(self, result: Covariance, rows: list[int]) -> tuple[GoalCurve, str]:
        name, observation = self.goal, self.scene.observation
        label, unit, per, _ = GOALS[name]
        scale, target = per(observation), self.target.number
        value, worst = after_one_second(result, name, checked_rows(name, rows, len(result.rates)))
        seconds = seconds_for(name, target * scale, value)
        peak = float(result.source_rate.max(initial=0.0)) + observation.background_rate
        curve = GoalCurve(
            label=f"{label} ({unit})" if unit else label,
            first=value / scale,
            power=0.5 if name == "snr" else -0.5,
            goal=target,
            now=observation.exposure,
            full=WORD / peak if peak > 0 else np.inf,
        )
        now = curve.value(observation.exposure)
        whose = "" if name == "flux_ratio" or len(rows) == 1 else f", source {worst} decides"
        return curve, (
            f"<b>{_time_text(seconds)}</b>{whose}; now {observation.exposure:.6g} s: {now:.3g}"
            f"{' ' + unit if unit else ''}"
        )

    def _show_warnings(self, result: Covariance | None) -> None:
        scene, texts = self.scene, []
        if result is not None:
            texts = count_rate_warnings(
                result.source_rate,
                scene.observation.background_rate,
                sources=scene.sources,
                observation=scene.observation,
            )
        if texts:
            texts.append("No exposure time cures that.")
        self.warning.setText(" ".join(texts))
        self.warning.setVisible(bool(texts))

    # ---------------------------------------------------------------- shown and hidden

    def _scene_changed(self, event: Any = None) -> None:
        self.forecast.follow()
        self.show_answer()

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the scene while visible (napari gives docked widgets no close event)."""
        self._follow(True)
        super().showEvent(event)
        if (dock := self._place.take()) is not None:
            # a tab behind another one gets no event
            dock.visibilityChanged.connect(self._follow)

    def hideEvent(self, event: QHideEvent) -> None:
        """Cost nothing while hidden."""
        self._follow(False)
        super().hideEvent(event)

    def _follow(self, on: bool) -> None:
        if on == self._following:
            return
        self._following = self.forecast.on = on
        events = self.scene.events
        pairs = (
            (events.sources, self._scene_changed),
            (events.observation, self._scene_changed),
            (events.picture, self._scene_changed),
            (events.selection, self.show_answer),
            (self.scene.viewer.events.theme, self.show_answer),
        )
        follow(pairs, on)
        if on:
            self._scene_changed()
        else:
            self.forecast.pause()


def _positive(number: float) -> None:
    if not number > 0:
        raise ValueError(f"goal is {number:g}; it must be above 0.")


def _named(rows: list[int], selected: bool, goal: str) -> str:
    if not rows:
        return "no source"
    if not selected:
        named = "all sources (select some to choose)"
    else:
        numbers = ", ".join(str(row) for row in rows[:8]) + (" …" if len(rows) > 8 else "")
        named = f"selected: {'source' if len(rows) == 1 else 'sources'} {numbers}"
    return f"{named}; the worst decides" if len(rows) > 1 and goal != "flux_ratio" else named


def _time_text(seconds: float) -> str:
    if seconds < 3 * 3600:
        return f"{seconds:.4g} s"
    return f"{seconds:.4g} s ({seconds / 3600:.3g} h)"

"""A row that says that the picture takes long, and lets the user do without it."""

from __future__ import annotations

from typing import Any

from qtpy.QtWidgets import QHBoxLayout, QLabel, QPushButton, QWidget

from .scene import Scene


class ProgressRow(QWidget):  # type: ignore[misc]
    """Is seen only while a picture takes long, or was cancelled.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self.scene = scene
        self.text = QLabel()
        self.button = QPushButton()
        self.button.clicked.connect(self._clicked)
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 0, 4, 0)
        row.addWidget(self.text, 1)
        row.addWidget(self.button)
        self.show_progress()

    def resume(self) -> None:
        """Follow the scene."""
        self.scene.events.progress.connect(self.show_progress)
        self.show_progress()

    def pause(self) -> None:
        """Stop following the scene."""
        self.scene.events.progress.disconnect(self.show_progress)

    def show_progress(self, event: Any = None) -> None:
        """Show whether the scene is being simulated."""
        cancelled = self.scene.cancelled
        self.text.setText("Cancelled: an older picture" if cancelled else "Simulating…")
        self.button.setText("Simulate" if cancelled else "Cancel")
        self.button.setToolTip(
            "Simulate the scene as it is now; saving does so too"
            if cancelled
            else "Keep the picture that is shown. What is being computed runs on to its end in "
            "the background, and the next picture waits for that"
        )
        self.setVisible(self.scene.slow or cancelled)

    def _clicked(self, checked: bool = False) -> None:
        if self.scene.cancelled:
            self.scene.simulate()
        else:
            self.scene.cancel()

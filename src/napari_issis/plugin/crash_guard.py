"""The scene survives a crash: it is kept in a file while it is edited, and offered again."""

from __future__ import annotations

from typing import Any

from napari.utils.notifications import show_error
from qtpy.QtWidgets import QApplication, QHBoxLayout, QLabel, QWidget

from ..autosave import Autosave, CrashedScene, crashed_scenes
from .latest_wins import LatestWins
from .push_button import push_button
from .scene import Scene
from .single_shot import single_shot

# Milliseconds between an edit and its file.
DELAY = 3000


class CrashGuard(QWidget):  # type: ignore[misc]
    """Keeps the scene in a file, and shows a bar where an earlier one was left by a crash.

    Parameters
    ----------
    scene : Scene
        The live scene.
    """

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self.scene = scene
        self.text = QLabel()
        self.text.setWordWrap(True)
        self.restore = push_button(
            "Restore",
            "Add the sources of that scene, and set the instrument as it was",
            self._restore,
        )
        self.forget = push_button("Forget", "Delete that scene's file", self._forget)
        row = QHBoxLayout(self)
        row.setContentsMargins(4, 0, 4, 0)
        row.addWidget(self.text, 1)
        row.addWidget(self.restore)
        row.addWidget(self.forget)
        self._left: list[CrashedScene] = []
        self._file: Autosave | None = None
        self._saved = self._version
        self._jobs = LatestWins(lambda _: None, self._failed)
        self._timer = single_shot(self.save, DELAY, self)
        try:
            self._file, self._left = Autosave(), crashed_scenes()
        except (ImportError, OSError) as error:
            self._failed(error)
        scene.events.picture.connect(self._edited)
        application = QApplication.instance()
        if application is not None:
            application.aboutToQuit.connect(self.end)
        self._show()

    def save(self) -> None:
        """Write the scene to its file, in another thread."""
        scene, file = self.scene, self._file
        if file is None or self._version == self._saved:
            return
        self._saved = self._version
        sources, observation, seed = scene.sources, scene.observation, scene.seed
        self._jobs.request(lambda: file.write(sources, observation, seed))

    @property
    def _version(self) -> tuple[Any, ...]:
        """What is kept: the sources by their version, and what they are observed with."""
        return self.scene.editor.version, self.scene.observation, self.scene.seed

    def end(self) -> None:
        """Remove the file: the session ends well."""
        self._timer.stop()
        self._jobs.drop()
        if self._file is not None:
            self._file.remove()

    def _edited(self, event: Any = None) -> None:
        if self._version != self._saved and not self._timer.isActive():
            self._timer.start()

    def _failed(self, error: BaseException) -> None:
        self._file = None
        show_error(f"The scene is not kept for the case of a crash: {error}")

    def _show(self) -> None:
        if not self._left:
            self.hide()
        else:
            when = self._left[0].saved.astimezone()
            self.text.setText(f"A scene of {when:%d %b %H:%M} was left by a crash.")

    def _restore(self) -> None:
        left = self._left[0]
        try:
            sources, observation, seed = left.read()
            self.scene.add(sources)
            self.scene.observation, self.scene.seed = observation, seed
        except (OSError, ValueError) as error:
            show_error(str(error))
            return
        self._forget()

    def _forget(self) -> None:
        self._left.pop(0).remove()
        self._show()

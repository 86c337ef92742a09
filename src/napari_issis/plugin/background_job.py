"""A job that runs in the background, with napari's progress bar and its errors as messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from napari.utils import progress
from napari.utils.notifications import show_error
from qtpy.QtWidgets import QWidget

from .latest_wins import LatestWins


class BackgroundJob:
    """Run a job in a thread; a newer one takes the place of one that waits.

    Parameters
    ----------
    owner : QWidget
        Whose job it is; once it is gone, the result goes nowhere.
    words : str
        What the progress bar says.
    deliver : callable
        Gets the job's result, in the GUI thread.
    failed : callable, optional
        Called after an error was shown.
    """

    def __init__(
        self,
        owner: QWidget,
        words: str,
        deliver: Callable[[Any], None],
        failed: Callable[[], None] | None = None,
    ) -> None:
        self._words = words
        self._deliver = deliver
        self._after_error = failed
        self._jobs = LatestWins(self._ended, self._failed)
        self._bar: Any = None
        owner.destroyed.connect(self._drop)

    @property
    def busy(self) -> bool:
        """Whether a job runs or waits."""
        return self._jobs.busy

    def start(self, job: Callable[[], Any]) -> None:
        """Run a job; its errors are shown."""
        if self._bar is None:
            self._bar = progress(total=0, desc=self._words)
        self._jobs.request(job)

    def _ended(self, result: Any) -> None:
        self._close()
        self._deliver(result)

    def _failed(self, error: BaseException) -> None:
        self._close()
        if not isinstance(error, OSError | ValueError | RuntimeError | ImportError | MemoryError):
            raise error
        show_error(str(error) or "there is not enough memory for that.")
        if self._after_error is not None:
            self._after_error()

    def _drop(self, owner: Any = None) -> None:
        self._jobs.cancel()
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def _close(self) -> None:
        if self._bar is not None and not self.busy:
            self._bar.close()
            self._bar = None

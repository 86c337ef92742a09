"""One background job at a time; of those that wait, only the newest is run."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from threading import Thread
from typing import Any

from qtpy.QtCore import QObject, Signal


class LatestWins:
    """Run jobs in a thread, one at a time; a newer request replaces a waiting one.

    A job that runs when the window is closed, and its process with it, is given up: Python
    itself ends it, and its result or error goes nowhere. (A worker of napari's would report to
    Qt objects that are gone by then, which aborts the process.)

    Parameters
    ----------
    deliver : callable
        Gets each job's result, in the GUI thread and in the order of the requests.
    fail : callable
        Gets the exception of a job that failed.
    """

    def __init__(
        self, deliver: Callable[[Any], None], fail: Callable[[BaseException], None]
    ) -> None:
        self._deliver = deliver
        self._fail = fail
        self._waiting: Callable[[], Any] | None = None
        self._running = False
        self._unwanted = False
        self._letter = _Letter()
        self._letter.sent.connect(self._ended)

    @property
    def busy(self) -> bool:
        """Whether a job runs or waits."""
        return self._running or self._waiting is not None

    def request(self, job: Callable[[], Any]) -> None:
        """Run a job as soon as the present one has ended, unless a newer one comes first."""
        self._waiting = job
        self._start()

    def drop(self) -> None:
        """Forget the job that waits."""
        self._waiting = None

    def cancel(self) -> None:
        """Forget the job that waits, and the result of the one that runs (on to its end)."""
        self._waiting = None
        self._unwanted = self._running

    def _start(self) -> None:
        if self._running or self._waiting is None:
            return
        job, self._waiting = self._waiting, None
        self._running = True
        Thread(target=_run, args=(job, self._letter), name="napari-issis job").start()

    def _ended(self, result: Any, error: BaseException | None) -> None:
        self._running = False
        unwanted, self._unwanted = self._unwanted, False
        try:
            if unwanted:
                return
            if error is None:
                self._deliver(result)
            else:
                self._fail(error)
        finally:
            self._start()


class _Letter(QObject):  # type: ignore[misc]
    """Brings the result of a job, or its error, from its thread to that of the GUI."""

    sent = Signal(object, object)


def _run(job: Callable[[], Any], letter: _Letter) -> None:
    result, error = None, None
    try:
        result = job()
    except BaseException as raised:
        error = raised
    # Qt has gone where the window was closed meanwhile: nobody waits.
    with suppress(RuntimeError):
        letter.sent.emit(result, error)

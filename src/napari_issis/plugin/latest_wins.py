"""One background job at a time; of those that wait, only the newest is run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from napari.qt.threading import create_worker


class LatestWins:
    """Run jobs in a worker thread, one at a time; a newer request replaces a waiting one.

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
        self._worker: Any = None

    @property
    def busy(self) -> bool:
        """Whether a job runs or waits."""
        return self._worker is not None or self._waiting is not None

    def request(self, job: Callable[[], Any]) -> None:
        """Run a job as soon as the present one has ended, unless a newer one comes first."""
        self._waiting = job
        self._start()

    def drop(self) -> None:
        """Forget the job that waits."""
        self._waiting = None

    def _start(self) -> None:
        if self._worker is not None or self._waiting is None:
            return
        job, self._waiting = self._waiting, None
        self._worker = create_worker(job, _start_thread=False, _ignore_errors=True)
        self._worker.returned.connect(self._deliver)
        self._worker.errored.connect(self._fail)
        self._worker.finished.connect(self._finished)
        self._worker.start()

    def _finished(self) -> None:
        self._worker = None
        self._start()

from __future__ import annotations

import threading

import pytest

from napari_issis.plugin.latest_wins import LatestWins


@pytest.fixture
def results():
    return []


def test_of_waiting_jobs_only_the_newest_runs(qtbot, results):
    """Catches a queue that is worked off while the mouse is far ahead, and jobs in parallel."""
    gate, ran = threading.Event(), []
    jobs = LatestWins(results.append, results.append)

    def job(number):
        def run():
            gate.wait(5)
            ran.append(number)
            return number

        return run

    for number in range(5):
        jobs.request(job(number))
    gate.set()
    qtbot.waitUntil(lambda: not jobs.busy, timeout=5000)
    assert ran == [0, 4]
    assert results == [0, 4]


def test_an_error_is_told_and_the_next_job_runs(qtbot, results):
    """Catches a worker that is stuck after an error."""
    errors = []
    jobs = LatestWins(results.append, errors.append)

    def broken():
        raise OSError("no more memory")

    jobs.request(broken)
    jobs.request(lambda: "fine")
    qtbot.waitUntil(lambda: not jobs.busy, timeout=5000)
    assert [str(error) for error in errors] == ["no more memory"]
    assert results == ["fine"]

from __future__ import annotations

import os
import subprocess
import sys
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


CLOSE_WHILE_RENDERING = """
import napari
from qtpy.QtCore import QTimer
from napari_issis import Observation, random_sources, show

scene = show(random_sources("point", 1), Observation(shape=(2048, 2048)))
scene.wait()

def change():
    scene.sources = random_sources("point", 10_000, shape=(2048, 2048), seed=1)
    close_when_busy()

def close_when_busy():
    if scene._live._jobs.busy:
        scene.viewer.close()
        print("closed while busy", flush=True)
    else:
        QTimer.singleShot(1, close_when_busy)

QTimer.singleShot(0, change)
napari.run()
"""


@pytest.mark.needs_gl
@pytest.mark.slow
def test_the_window_is_closed_in_the_middle_of_a_render(tmp_path):
    """Catches a process that aborts, hangs or complains when nobody waits for the picture."""
    environment = {**os.environ, "NAPARI_CONFIG": ""}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", CLOSE_WHILE_RENDERING],
        capture_output=True,
        text=True,
        timeout=120,
        env=environment,
        cwd=tmp_path,
    )
    assert done.stdout == "closed while busy\n"
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr

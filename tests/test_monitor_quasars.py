"""The monitoring of many systems by a command: killed in the middle, it goes on where it was."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from astropy.table import QTable

import napari_issis as ni

pytest.importorskip("distributed")
pytest.importorskip("tqdm")

DOCS = Path(__file__).parent.parent / "docs"
OPTIONS = ["--systems", "2", "--epochs", "12", "--exposures", "2", "--frame", "48"]
# Runs the command with workers that write a line for each render and each exposure.
COUNTING = """
import sys
from contextlib import contextmanager

sys.path.insert(0, {docs!r})
import monitor_quasars
from distributed import WorkerPlugin

LOG = {log!r}


class Count(WorkerPlugin):
    def setup(self, worker):
        from napari_issis import monitoring_tasks

        render, expose = monitoring_tasks.noise_ready_rate, monitoring_tasks.expose

        def tell(line):
            with open(LOG, "a") as file:
                file.write(line + "\\n")

        def counted_render(*args, **options):
            tell("render")
            return render(*args, **options)

        def counted_expose(*args, seed, **options):
            tell(f"expose {{seed}}")
            return expose(*args, seed=seed, **options)

        monitoring_tasks.noise_ready_rate = counted_render
        monitoring_tasks.expose = counted_expose


connected = monitor_quasars.connected


@contextmanager
def counted(options):
    with connected(options) as client:
        client.register_plugin(Count())
        yield client


if __name__ == "__main__":
    monitor_quasars.connected = counted
    monitor_quasars.main([{folder!r}, *{options!r}])
"""


def start(tmp_path, log):
    script = tmp_path / f"{log}.py"
    names = {"docs": str(DOCS), "folder": str(tmp_path / "out"), "options": OPTIONS}
    script.write_text(COUNTING.format(log=str(tmp_path / log), **names))
    return subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def files(tmp_path):
    return sorted((tmp_path / "out").rglob("*.fits"))


@pytest.mark.slow
def test_killed_and_called_again(tmp_path):
    """Catches exposures computed twice, files left half-written, and light curves of a part."""
    process = start(tmp_path, "first")
    while len(files(tmp_path)) < 5 and process.poll() is None:
        time.sleep(0.02)
    # client, scheduler and workers at once
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL
    finished = {path: path.stat().st_mtime_ns for path in files(tmp_path)}
    assert 5 <= len(finished) < 48
    seeds = {f"expose {ni.Exposure.read(path).seed}" for path in finished}

    process = start(tmp_path, "second")
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    lines = (tmp_path / "second").read_text().split("\n")[:-1]
    exposed = [line for line in lines if line != "render"]
    assert len(set(exposed)) == len(exposed) == 48 - len(finished)
    assert not seeds & set(exposed)
    assert lines.count("render") == 48 - len(finished)
    assert len(files(tmp_path)) == 48
    assert all(path.stat().st_mtime_ns == when for path, when in finished.items())
    assert "48 files" in output

    tables = sorted((tmp_path / "out").glob("*/light_curves.ecsv"))
    assert [path.parent.name for path in tables] == ["00-Q2237+0305", "01-PG1115+080"]
    for path in tables:
        table = QTable.read(path, format="ascii.ecsv")
        assert len(table) == 12 * 5
        pull = ((table["flux"] - table["truth"]) / table["error"]).value
        assert np.all(np.abs(pull) < 6)
        assert path.with_suffix(".png").stat().st_size > 10_000

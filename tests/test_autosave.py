"""Autosaved scenes: written, found after a crash, read back, removed."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from astropy.coordinates import SkyCoord

from napari_issis import ImagePSF, Observation, random_sources
from napari_issis import autosave as module
from napari_issis.autosave import Autosave, autosave_folder, crashed_scenes
from napari_issis.exposure import same_table

SOURCES = random_sources("sersic", 4, seed=1)
OBSERVATION = Observation(
    "FUV",
    ("open", "NF1"),
    shape=(30, 40),
    psf=ImagePSF(np.random.default_rng(1).random((3, 3)), 0.03),
    pointing=SkyCoord(150.0, 60.0, unit="deg"),
    roll=30.0,
)
PROGRAM = """
import sys, time
from napari_issis import Observation, random_sources
from napari_issis.autosave import Autosave
mine = Autosave(sys.argv[1])
mine.write(random_sources("point", int(sys.argv[2]), seed=1), Observation(shape=(5, 6)), 9)
print("saved", flush=True)
time.sleep(60)
"""


def dead(monkeypatch):
    """Let the files of this process be those of one that is no more."""
    import psutil

    def gone(number):
        raise psutil.NoSuchProcess(number)

    monkeypatch.setattr(psutil, "Process", gone)


def test_a_scene_comes_back(tmp_path, monkeypatch):
    """Catches anything of the scene left out, and a living process taken for a crashed one."""
    mine = Autosave(tmp_path)
    mine.write(random_sources("point", 1), Observation(), 1)
    mine.write(SOURCES, OBSERVATION, 2**70)
    assert crashed_scenes(tmp_path) == []
    dead(monkeypatch)
    (scene,) = crashed_scenes(tmp_path)
    sources, observation, seed = scene.read()
    assert same_table(sources, SOURCES)
    assert (observation, seed) == (OBSERVATION, 2**70)
    assert abs(scene.saved.timestamp() - time.time()) < 60
    scene.remove()
    assert crashed_scenes(tmp_path) == []
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is a POSIX signal")
def test_killed_processes(tmp_path):
    """Two processes, each with its own file; only the killed one's is offered."""
    command = [sys.executable, "-c", PROGRAM, str(tmp_path)]
    processes = [
        subprocess.Popen([*command, str(number)], stdout=subprocess.PIPE) for number in (3, 5)
    ]
    for process in processes:
        assert process.stdout.readline() == b"saved\n"
    try:
        assert crashed_scenes(tmp_path) == []
        processes[0].send_signal(signal.SIGKILL)
        processes[0].wait()
        (scene,) = crashed_scenes(tmp_path)
        assert len(scene.read()[0]) == 3
        assert scene.read()[2] == 9
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stdout.close()
    assert sorted(len(scene.read()[0]) for scene in crashed_scenes(tmp_path)) == [3, 5]


def test_a_number_given_to_another_process(tmp_path, monkeypatch):
    """Catches a process told by its number alone: the computer gives them out again."""
    import psutil

    before = psutil.Process.create_time
    monkeypatch.setattr(psutil.Process, "create_time", lambda self: before(self) - 3600)
    Autosave(tmp_path).write(SOURCES, OBSERVATION)
    monkeypatch.undo()
    assert len(crashed_scenes(tmp_path)) == 1


def test_other_computers_are_left_alone(tmp_path, monkeypatch):
    """A home folder may be shared: catches scenes taken away from a running session elsewhere."""
    monkeypatch.setattr(module.platform, "node", lambda: "elsewhere")
    Autosave(tmp_path).write(SOURCES, OBSERVATION)
    monkeypatch.undo()
    dead(monkeypatch)
    assert crashed_scenes(tmp_path) == []


def test_columns_that_no_file_can_hold_are_left_out(tmp_path, monkeypatch):
    """Catches a scene lost for a remark in it."""
    table = SOURCES.copy()
    table["name"] = ["α", "b", "c", "d"]
    table["what"] = np.array([{}, [], None, 1], dtype=object)
    Autosave(tmp_path).write(table, OBSERVATION)
    dead(monkeypatch)
    sources = crashed_scenes(tmp_path)[0].read()[0]
    assert sources.colnames == [*SOURCES.colnames, "name"]
    assert sources["name"][0] == "α"


def test_broken_files_are_offered_and_say_so(tmp_path):
    mine = Autosave(tmp_path)
    mine.write(SOURCES, OBSERVATION)
    mine.path.write_bytes(mine.path.read_bytes()[:4000])
    (scene,) = crashed_scenes(tmp_path)
    with pytest.raises(ValueError, match="truncated"):
        scene.read()
    mine.remove()
    mine.remove()
    assert crashed_scenes(tmp_path) == []


def test_failure_keeps_the_scene_saved_before(tmp_path, monkeypatch):
    mine = Autosave(tmp_path)
    mine.write(SOURCES, OBSERVATION)
    whole = mine.path.read_bytes()

    def fail(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="No space left on device"):
        mine.write(random_sources("point", 1), OBSERVATION)
    assert mine.path.read_bytes() == whole
    assert os.listdir(tmp_path) == [mine.path.name]


def test_parts_of_killed_writes_are_cleared_after_a_day(tmp_path):
    for name, age in (("old", 90_000), ("new", 10)):
        part = tmp_path / f".napari-issis-{name}.part"
        part.write_text("")
        os.utime(part, (time.time() - age,) * 2)
    Autosave(tmp_path)
    assert os.listdir(tmp_path) == [".napari-issis-new.part"]


@pytest.mark.skipif(sys.platform != "linux", reason="the folder is named by XDG")
def test_the_folder_is_the_users_own(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert autosave_folder() == tmp_path / "napari-issis" / "autosave"
    assert autosave_folder().is_dir()

"""Nothing is ever lost: every way to write, under every failure that can be made here."""

import errno
import os
import resource
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from napari_issis import Exposure, Observation, random_sources
from napari_issis.catalogue import read_sources, write_sources
from napari_issis.png import write_png
from napari_issis.rgba import read_rgba, write_rgba
from napari_issis.safe_write import replacing

if sys.platform == "win32":
    pytest.skip("limits, links and signals of POSIX", allow_module_level=True)

SHAPE = (60, 80)
COUNTS = np.random.default_rng(1).integers(0, 2**23, SHAPE)
SOURCES = random_sources("sersic", 300, seed=1)
EXPOSURE = Exposure(COUNTS, COUNTS + 0.5, SOURCES, Observation(shape=SHAPE), 7)
WRITERS = {
    "x.fits": lambda path, **options: EXPOSURE.write(path, **options),
    "compressed.fits": lambda path, **options: EXPOSURE.write(path, compress=True, **options),
    "x.png": lambda path, **options: write_png(path, COUNTS, **options),
    "rgba.png": lambda path, **options: write_rgba(path, COUNTS, **options),
    **{
        f"sources.{ending}": lambda path, **options: write_sources(SOURCES, path, **options)
        for ending in ("ecsv", "csv", "fits", "vot")
    },
}


@pytest.fixture(params=WRITERS)
def writer(request, tmp_path):
    """A way to write, and a path at which a file of the user's stands."""
    path = tmp_path / request.param
    path.write_text("mine")
    return WRITERS[request.param], path


def refused(write, path, *, left="mine"):
    """A failure: one sentence that names the file; the old file whole; nothing beside it."""
    before = sorted(os.listdir(path.parent))
    with pytest.raises(OSError, match=path.name) as error:
        write(path, overwrite=True)
    assert "\n" not in str(error.value)
    assert str(error.value).endswith(".")
    if left is not None:
        assert path.read_text() == left
    assert sorted(os.listdir(path.parent)) == before
    return str(error.value)


def test_a_file_that_may_grow_no_further(writer):
    """A disk quota or a full disk half-way: catches writing into the target itself."""
    write, path = writer
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
    try:
        message = refused(write, path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert "File too large; choose another disk" in message


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 8 kB, where this process may mount one."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=8k", "tmpfs", str(folder)]
    if shutil.which("mount") is None or subprocess.run(command, capture_output=True).returncode:
        pytest.skip("no disk can be mounted here")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk(small_disk, name):
    path = small_disk / name
    path.write_text("mine")
    message = refused(WRITERS[name], path)
    assert "No space left on device; free some space or choose another disk" in message


@pytest.mark.parametrize("number", [errno.EROFS, errno.EACCES, errno.EIO, errno.ENAMETOOLONG])
def test_a_folder_that_takes_no_files(writer, monkeypatch, number):
    """Root may write everywhere, so the refusal of the system is feigned."""
    write, path = writer

    def refuse(*args, **kwargs):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("pathlib.Path.open", refuse)
    before = sorted(os.listdir(path.parent))
    with pytest.raises(OSError, match=path.name) as error:
        write(path, overwrite=True)
    monkeypatch.undo()
    assert error.value.errno == number
    assert os.strerror(number) in str(error.value)
    assert path.read_text() == "mine"
    assert sorted(os.listdir(path.parent)) == before


def test_overwriting_is_asked_for(writer):
    write, path = writer
    with pytest.raises(FileExistsError, match=r"exists already.*overwrite=True"):
        write(path)
    assert path.read_text() == "mine"
    write(path, overwrite=True)
    assert path.stat().st_size > 100
    assert os.listdir(path.parent) == [path.name]


def test_a_file_that_appears_while_ours_is_written_is_kept(tmp_path):
    """Catches the target checked only before the writing, and replaced unasked after it."""
    path = tmp_path / "x.fits"

    def write():
        with replacing(path, (".fits",)) as file:
            file.write(b"ours")
            path.write_text("mine")

    with pytest.raises(FileExistsError, match="exists already"):
        write()
    assert path.read_text() == "mine"
    assert os.listdir(tmp_path) == ["x.fits"]


def test_a_file_system_without_links(tmp_path, monkeypatch):
    def refuse(*args):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    write_rgba(tmp_path / "x.png", COUNTS)
    np.testing.assert_array_equal(read_rgba(tmp_path / "x.png"), COUNTS)
    assert os.listdir(tmp_path) == ["x.png"]


def test_other_targets(tmp_path):
    for name, write in WRITERS.items():
        folder = tmp_path / "folder" / name
        folder.mkdir(parents=True)
        assert "it is a directory; give a file name" in refused(write, folder, left=None)
        loop = tmp_path / "loops" / name
        loop.parent.mkdir(exist_ok=True)
        loop.symlink_to(loop)
        assert "a link that leads nowhere" in refused(write, loop, left=None)
        with pytest.raises(ValueError, match=r"name must end in \."):
            write(tmp_path / "x.txt")
        missing = tmp_path / "none" / name
        with pytest.raises(FileNotFoundError, match="create it first"):
            write(missing)
        pipe = tmp_path / f"pipe-{name}"
        os.mkfifo(pipe)
        assert "not a regular file" in refused(write, pipe, left=None)
        real, link = tmp_path / f"real-{name}", tmp_path / f"link-{name}"
        link.symlink_to(real.name)
        write(link)
        assert link.is_symlink()
        assert real.stat().st_size > 100


def readable(path):
    if path.suffix == ".png":
        np.testing.assert_array_equal(read_rgba(path), COUNTS)
    elif path.name.startswith("sources"):
        assert len(read_sources(path)) == len(SOURCES)
    else:
        assert Exposure.read(path) == EXPOSURE


@pytest.mark.parametrize("name", ["x.fits", "rgba.png", "sources.ecsv", "sources.vot"])
def test_killed_at_any_moment(tmp_path, name):
    """kill -9 after 0 to 60 ms, ten times: catches a half file under the target's name."""
    path = tmp_path / name
    WRITERS[name](path)
    for i in range(10):
        child = os.fork()
        if child == 0:
            try:
                while True:
                    WRITERS[name](path, overwrite=True)
            finally:
                os._exit(1)
        time.sleep(0.006 * i)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        readable(path)

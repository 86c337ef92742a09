"""Write a file beside its target, then move it into place: the target is old or new, never half."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

EXISTS = "exists already; choose another name or allow it with overwrite=True."
# What to do where the system's own words do not say it.
REMEDIES = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "free some space or choose another disk",
    errno.EFBIG: "choose another disk, or compress the file",
    errno.EROFS: "choose another folder",
    errno.EACCES: "choose another folder",
    errno.EPERM: "choose another folder",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def check_target(
    path: str | os.PathLike[str], endings: tuple[str, ...], *, overwrite: bool = False
) -> Path:
    """Check that a file may be written, and return its path with symbolic links followed.

    Parameters
    ----------
    path : path-like
        The file to be written.
    endings : tuple of str
        What its name may end in, such as ``.fits``, in lower case.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the name has another ending.
    FileExistsError
        If the file exists and may not be replaced.
    OSError
        If the path is not that of a regular file, or its folder is missing or not writable.
    """
    if not str(path).lower().endswith(endings):
        raise ValueError(f"cannot write {path}: the name must end in {' or '.join(endings)}.")
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise OSError(f"cannot write {path}: it is a link that leads nowhere; remove it first.")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a directory; give a file name.")
    if target.exists() and not target.is_file():
        raise OSError(f"cannot write {path}: it is not a regular file; give another name.")
    if not target.parent.is_dir():
        raise FileNotFoundError(
            f"cannot write {path}: the folder {target.parent} does not exist; create it first."
        )
    if not os.access(target.parent, os.W_OK):
        raise PermissionError(
            f"cannot write {path}: the folder {target.parent} is not writable; choose another."
        )
    if target.exists() and not overwrite:
        raise FileExistsError(f"{path} {EXISTS}")
    return target


@contextmanager
def replacing(
    path: str | os.PathLike[str], endings: tuple[str, ...], *, overwrite: bool = False
) -> Iterator[BinaryIO]:
    """Open a temporary file that takes the target's place once it is complete.

    Parameters
    ----------
    path : path-like
        The file to be written.
    endings : tuple of str
        What its name may end in, such as ``.fits``, in lower case.
    overwrite : bool
        Whether an existing file may be replaced.

    Yields
    ------
    binary file
        In the target's folder. If the body of the ``with`` statement fails it is removed, and
        the target stays as it was.

    Raises
    ------
    ValueError
        If the name has another ending.
    OSError
        If the file cannot be written; the message names it. `FileExistsError` if it exists
        and may not be replaced.
    """
    target = check_target(path, endings, overwrite=overwrite)
    temporary = target.parent / f".napari-issis-{secrets.token_hex(8)}.part"
    try:
        try:
            with temporary.open("wb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            if overwrite and target.exists():
                check_target(path, endings, overwrite=True)
                shutil.copymode(target, temporary)
            _move(temporary, target, path, overwrite=overwrite)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    except FileExistsError:
        raise
    except OSError as error:
        cause = _cause(error)
        reason = cause.strerror or str(cause)
        remedy = REMEDIES.get(cause.errno or 0)
        text = f"cannot write {path}: {reason}{f'; {remedy}' if remedy else ''}."
        fault = OSError(text)
        fault.errno = cause.errno
        raise fault from error


def _cause(error: OSError) -> OSError:
    """Return the system's own error where a library has put another one around it."""
    found: BaseException | None = error
    while found is not None:
        if isinstance(found, OSError) and found.errno:
            return found
        found = found.__cause__ or found.__context__
    return error


def _move(temporary: Path, target: Path, path: str | os.PathLike[str], *, overwrite: bool) -> None:
    """Give the temporary file the target's name; a file that came meanwhile is kept."""
    if overwrite:
        os.replace(temporary, target)
        return
    try:
        # Unlike a renamed file, a link never takes another one's place.
        os.link(temporary, target)
    except FileExistsError:
        raise FileExistsError(f"{path} {EXISTS}") from None
    except OSError:
        # A file system without links.
        if os.path.lexists(target):
            raise FileExistsError(f"{path} {EXISTS}") from None
        os.replace(temporary, target)
        return
    temporary.unlink()

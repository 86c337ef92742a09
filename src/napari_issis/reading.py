"""Open a file for reading, or say in a sentence why not."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO


def open_file(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file that holds something.

    Parameters
    ----------
    path : path-like
        The file.

    Raises
    ------
    OSError
        If the file cannot be opened, or is a folder, a pipe or a device.
    ValueError
        If it is empty.
    """
    try:
        mode = Path(path).stat().st_mode
        if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
            # A pipe would be waited for, a device never end.
            raise OSError(f"cannot read {path}: it is not a regular file.")
        file = Path(path).open("rb")  # noqa: SIM115
    except OSError as error:
        if error.errno is None:
            raise
        raise type(error)(f"cannot read {path}: {error.strerror or error}.") from error
    if not file.peek(1):
        file.close()
        raise ValueError(f"{path} is empty.")
    return file


def one_line(error: BaseException, longest: int = 200) -> str:
    """Return an exception's text on one line, cut where it is longer than anyone reads."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= longest else f"{text[:longest]}..."

"""Files that a child process with foreign code leaves as its results.

This code may replace them by a link to a file that it cannot read itself, or by a pipe that blocks.
"""

from __future__ import annotations

import os
import stat
from io import BufferedReader
from pathlib import Path

from hystfmu.base.errors import InputError

_FLAGS = [getattr(os, f"O_{name}", 0) for name in ("NOFOLLOW", "NONBLOCK", "BINARY")]


def open_result(path: str | Path) -> BufferedReader:
    """Open a result: a regular file with one name, not a link. The check applies to the opened file.

    Raises
    ------
    InputError
        There is no such regular file.
    """
    try:
        handle = os.open(path, os.O_RDONLY | sum(_FLAGS))
    except OSError as e:
        raise InputError(f"{path}: {e.strerror or e}") from None
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
        os.close(handle)
        raise InputError(f"{path}: The result must be a regular file with one name.")
    return os.fdopen(handle, "rb")


def read_result(path: str | Path, most: int) -> bytes:
    """Read a result of at most `most` bytes.

    Raises
    ------
    InputError
        As `open_result`; the file is too large.
    """
    with open_result(path) as f:
        content = f.read(most + 1)
    if len(content) > most:
        raise InputError(f"{path}: The result must have at most {most} bytes.")
    return content

"""Lock of a folder against a second study in this process or in another process."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

from hystfmu.base.errors import InputError
from hystfmu.base.files import check_target

_FAR = 2**30  # beyond the end of a journal: Windows lets no other process read a locked byte
_HELD: dict[int, tuple[int, int, int]] = {}  # process, device and file by handle


def open_locked(path: Path) -> int:
    """Open a file for reading and writing, and lock it until `close_locked`.

    The lock belongs to this process. Forked workers, which may end slightly later, do not own it. The lock of the
    system does not exclude a second study in this process, and it is lost when this process closes another handle of
    the file. This function handles these two cases.

    An InputError means that another study has the lock, or that the file cannot be written. An OSError means that the
    file system does not support locks.
    """
    check_target(path)
    refused = InputError(f"{path.parent}: another study is writing into this folder")
    with suppress(FileNotFoundError):
        if _mark(path.stat()) in _HELD.values():
            raise refused
    handle = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_BINARY", 0), 0o666)
    try:
        _lock(handle)
    except OSError as e:
        os.close(handle)
        if isinstance(e, (BlockingIOError, PermissionError)):
            raise refused from None
        raise
    _HELD[handle] = _mark(os.fstat(handle))
    return handle


def close_locked(handle: int) -> None:
    """Close a locked file and release the lock."""
    del _HELD[handle]
    os.close(handle)


def _mark(found: os.stat_result) -> tuple[int, int, int]:
    return os.getpid(), found.st_dev, found.st_ino


def _lock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        os.lseek(handle, _FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        os.lseek(handle, 0, os.SEEK_SET)
    else:
        import fcntl

        fcntl.lockf(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

"""Calls of the C library and of the system by name.

This module imports the standard library alone: it runs before anything else is loaded.
"""

from __future__ import annotations

import ctypes as C
import os


def libc() -> C.CDLL:
    """Return the C library."""
    return C.CDLL(None, use_errno=True)


def call(name: str, *arguments: object) -> int:
    """Call a function of the C library that returns a negative number if it fails.

    Raises
    ------
    OSError
        It failed.
    """
    result: int = getattr(libc(), name)(*[C.c_ulong(a) if isinstance(a, int) else a for a in arguments])
    if result < 0:
        number = C.get_errno()
        raise OSError(number, os.strerror(number))
    return result

"""Calls of the C library and of the system by name; removal of the capabilities of root, capabilities(7).

This module imports only the standard library, because it runs before anything else is loaded.
"""

from __future__ import annotations

import ctypes as C
import os
import struct
from contextlib import suppress
from itertools import count

_READ, _DROP = 23, 24  # of the bounding set, by prctl
_AMBIENT, _CLEAR = 47, 4
_VERSION_3 = 0x20080522  # of capset: three sets of 64 bits


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


def drop_capabilities() -> None:
    """Empty all sets of this thread.

    Programs that it starts cannot regain capabilities: the bounding set is empty or cannot be changed, and the process
    has renounced new privileges before.

    Raises
    ------
    OSError
        The system refuses.
    """
    with suppress(OSError):  # EINVAL: the last one that this kernel knows is dropped; EPERM: no right to do so
        for number in count():
            if call("prctl", _READ, number, 0, 0, 0):
                call("prctl", _DROP, number, 0, 0, 0)
    with suppress(OSError):  # Linux before 4.3 has no ambient ones
        call("prctl", _AMBIENT, _CLEAR, 0, 0, 0)
    call("capset", struct.pack("=Ii", _VERSION_3, 0), bytes(24))

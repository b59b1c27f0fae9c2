"""Memory of the C library that a call leaves behind."""

import ctypes as C
import gc
import sys
from collections.abc import Callable

import pytest


class Used(C.Structure):
    """`struct mallinfo2` of glibc."""

    _fields_ = [
        *((n, C.c_size_t) for n in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks")),
        *((n, C.c_size_t) for n in ("uordblks", "fordblks", "keepcost")),
    ]


def leaves_nothing(live: Callable[[], None]) -> bool:
    """Whether no memory is lost each time; `live` is called about 50 times."""
    libc = C.CDLL(None)
    if not sys.platform.startswith("linux") or not hasattr(libc, "mallinfo2"):
        pytest.skip("the C library counts no memory")
    libc.mallinfo2.restype = Used

    def used() -> int:
        gc.collect()  # instances and their callbacks refer to each other
        now = libc.mallinfo2()
        return int(now.uordblks + now.hblkhd)

    for _ in range(3):
        live()
    least = []
    for _ in range(3):  # what Python allocates meanwhile is not the same every time
        before = used()
        for _ in range(15):
            live()
        least.append(used() - before)
    return min(least) < 15 * 24  # the least that malloc gives, as often

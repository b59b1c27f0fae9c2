"""Supervise a process that runs foreign native code on Linux. When the process ends, all its descendants are ended.

The supervisor is a sub-reaper: orphaned processes become its children, even if they created their own session or
process group. So it can end every descendant. The supervisor exits with the same status or signal as the process. After
a SIGTERM, or after the end of its own parent, the supervisor ends the process.

This module imports only the standard library, because the supervisor is a separate process that must start fast.
"""

import json
import os
import resource
import signal
import sys
import time
from collections import defaultdict
from contextlib import suppress
from typing import NoReturn

from hystfmu.base.confine import CANNOT, Box, call, confine

_PARENT_DEATH, _SUB_REAPER = 1, 36  # options of prctl(2)
_PAUSE = 2e-3  # s: time between two searches for remaining processes


def supervise(parent: int) -> None:
    """Fork this process. The function returns only in the child; the parent becomes the supervisor of the child.

    Parameters
    ----------
    parent : int
        Process number of the parent of the supervisor. If this parent ends, the supervisor ends all its own
        descendants.
    """
    awaited = {signal.SIGTERM, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, awaited)
    call("prctl", _SUB_REAPER, 1)
    call("prctl", _PARENT_DEATH, int(signal.SIGTERM))
    if os.getppid() != parent:
        os._exit(1)
    me, child = os.getpid(), os.fork()
    if child:
        try:
            _watch(child, awaited)
        finally:
            os._exit(1)
    call("prctl", _PARENT_DEATH, int(signal.SIGKILL))
    if os.getppid() != me:
        os._exit(1)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _watch(child: int, awaited: set[signal.Signals]) -> NoReturn:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent of the supervisor handles the interrupt
    status = None
    while status is None and signal.sigwait(awaited) != signal.SIGTERM:
        status = _reap().get(child)
    code = 1 if status is None else os.waitstatus_to_exitcode(status)
    with suppress(ChildProcessError):
        while True:
            _end_descendants()
            os.waitpid(-1, os.WNOHANG)
            time.sleep(_PAUSE)
    if code < 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with suppress(OSError):  # SIGKILL has no handler
            signal.signal(-code, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {-code})
        os.kill(os.getpid(), -code)
    os._exit(code)


def _reap() -> dict[int, int]:
    """Return the status of every child that has ended."""
    found = {}
    with suppress(ChildProcessError):
        while (ended := os.waitpid(-1, os.WNOHANG))[0]:
            found[ended[0]] = ended[1]
    return found


def _end_descendants() -> None:
    os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT)  # raises ChildProcessError if there is no child
    children = defaultdict(list)
    for name in filter(str.isdigit, os.listdir("/proc")):
        with suppress(OSError), open(f"/proc/{name}/stat", "rb") as f:
            children[int(f.read().rpartition(b")")[2].split()[1])].append(int(name))
    found, rest = [], [os.getpid()]
    while rest:
        below = children[rest.pop()]
        found += below
        rest += below
    for number in (signal.SIGSTOP, signal.SIGKILL):  # a stopped process cannot start another process
        for pid in found:
            with suppress(OSError):
                os.kill(pid, number)


def main() -> None:
    """Run ``python -m hystfmu.base.supervisor PARENT BOX ARGUMENTS``.

    The command starts Python with ARGUMENTS. BOX is a JSON object with the files and folders to which this Python
    process is confined, or null for a process without confinement.
    """
    parent, box, arguments = int(sys.argv[1]), json.loads(sys.argv[2]), sys.argv[3:]
    supervise(parent)
    if box is not None:
        try:
            confine(Box(**box))
        except OSError as e:
            _refuse(f"this process cannot be confined: {e}")
    try:
        os.execv(sys.executable, [sys.executable, *arguments])
    except OSError as e:  # without capabilities, root cannot enter a folder of another user
        _refuse(f"this process cannot run {sys.executable}: {e.strerror}")


def _refuse(why: str) -> NoReturn:
    print(why, flush=True)
    os._exit(CANNOT)


if __name__ == "__main__":
    main()

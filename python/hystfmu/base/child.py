"""Child processes for foreign native code: it may crash, hang or grow without harm to this one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from hystfmu.base.package_files import PACKAGE

MOST_LOG = 1 << 16


def limit_memory(gigabytes: float) -> None:
    """The address space that this process may take on top of what it has, where the system knows such a limit."""
    try:
        import resource

        statm = Path("/proc/self/statm")  # a fork has what its parent has
        have = int(statm.read_text().split()[0]) * resource.getpagesize() if statm.exists() else 0
        most = have + int(gigabytes * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass


def late(seconds: float) -> str:
    """What is said of a child that `finish` had to end."""
    return f"not finished after {seconds:g} s: a unit hangs, or allow more time"


def start(*arguments: str) -> subprocess.Popen[bytes]:
    """Python with this package on its path, in a group of its own, so that what it starts ends with it."""
    package = str(PACKAGE.parent)
    path = os.pathsep.join([package, *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.Popen(
        [sys.executable, *arguments],
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def finish(child: subprocess.Popen[bytes], seconds: float) -> tuple[list[str], bool]:
    """The last lines that a child wrote, and whether it ended in time."""
    try:
        out, in_time = child.communicate(timeout=seconds)[0], True
    except subprocess.TimeoutExpired:
        if hasattr(os, "killpg"):
            os.killpg(child.pid, signal.SIGKILL)
        child.kill()
        out, in_time = child.communicate()[0], False
    return out[-MOST_LOG:].decode(errors="replace").strip().splitlines(), in_time

"""Child processes for foreign native code, whose crash, hang or memory growth must not reach this process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from hystfmu.base.package_files import PACKAGE

MOST_LOG = 1 << 16


def limit_memory(gigabytes: float) -> None:
    """Limit the address space of this process to its present size plus `gigabytes` (GiB); disable core dumps.

    Systems without such limits ignore the call.
    """
    try:
        import resource

        statm = Path("/proc/self/statm")  # a forked process starts at the size of its parent
        have = int(statm.read_text().split()[0]) * resource.getpagesize() if statm.exists() else 0
        most = have + int(gigabytes * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ImportError, ValueError, OSError):
        pass


def late(seconds: float) -> str:
    """Return the message about a child that `finish` stopped after `seconds`."""
    return f"not finished after {seconds:g} s: a unit hangs, or allow more time"


def start(*arguments: str) -> subprocess.Popen[bytes]:
    """Start Python with this package on its path.

    The child leads a process group of its own, so that `finish` also ends the processes that it starts.
    """
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
    """Wait at most `seconds` for a child, then kill its process group.

    Returns
    -------
    lines : list of str
        The last 64 KiB of its output, as lines.
    in_time : bool
        Whether it ended by itself.
    """
    try:
        out, in_time = child.communicate(timeout=seconds)[0], True
    except subprocess.TimeoutExpired:
        if hasattr(os, "killpg"):
            os.killpg(child.pid, signal.SIGKILL)
        child.kill()
        out, in_time = child.communicate()[0], False
    return out[-MOST_LOG:].decode(errors="replace").strip().splitlines(), in_time

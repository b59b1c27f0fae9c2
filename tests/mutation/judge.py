"""One mutant in one fork: what the fork answers, and what happens to a fork that crashes or does not end."""

import json
import os
import resource
import select
import signal
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path


@dataclass
class Outcome:
    """The first test that failed, or what stopped the process; all that failed; seconds of every test that ran."""

    failed: str = ""
    failures: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    error: str = ""  # of the runner itself: no verdict


def judge(work: Callable[[], Outcome], folder: Path, seconds: float) -> Outcome:
    """Return what `work` returns in a fork; `seconds` of CPU time, or six times that on the clock, end it."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(read)
            _prepare(folder, seconds)
            try:
                outcome = work()
            except Exception:
                outcome = Outcome(error=traceback.format_exc())
            os.write(write, json.dumps(asdict(outcome)).encode() + b"\n")
        finally:
            os._exit(1)
    os.close(write)
    end, said = time.monotonic() + 6 * seconds + 20, b""
    try:
        while not said.endswith(b"\n") and select.select([read], [], [], max(end - time.monotonic(), 0))[0]:
            if not (part := os.read(read, 65536)):
                break
            said += part
    finally:
        os.close(read)
        _end(child)
    if said.endswith(b"\n"):
        outcome = Outcome(**json.loads(said))
        if outcome.error:
            raise RuntimeError(outcome.error)
        return outcome
    return Outcome("time limit" if time.monotonic() >= end else "crash or CPU limit")


def _end(child: int) -> None:
    """End a fork and what its tests started."""
    try:
        os.killpg(child, signal.SIGKILL)
    except ProcessLookupError:  # it has no group yet, or has ended
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def _prepare(folder: Path, seconds: float) -> None:
    os.setsid()
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    log = os.open(folder / "build" / "last.log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(log, 1)
    os.dup2(log, 2)

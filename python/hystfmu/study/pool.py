"""Local workers that may die, hang or eat memory without harm: one process each, watched by the parent.

A worker gets a few tasks at a time and answers one by one, so the parent always knows which task it is at.  A worker
that dies is replaced, and its task tried once more: somebody may have killed the process, and the table must not depend
on that.  A task that ends its worker twice, or exceeds the time, becomes a row with the reason.  A worker whose parent
is gone ends by itself.

Where the runs are in the C core alone, workers are forks: they are there at once, with all that the parent has
imported, and use only what a fork of a process with threads may use.  All others (FMUs, foreign code, systems without a
safe fork) are new processes.
"""

from __future__ import annotations

import multiprocessing as mp
import multiprocessing.connection
import os
import signal
import sys
import time
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import Any

from hystfmu.child import limit_memory
from hystfmu.errors import InputError
from hystfmu.scenario.run import Engine
from hystfmu.scenario.system import System
from hystfmu.study.task import Runner, Task, row_of

READY = "ready"
AT_ONCE = 8  # tasks that a worker holds: a run of a millisecond must not wait for the parent


def _work(pipe: Any, parent: int, systems: list[System], engine: Engine, memory: float) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides
    limit_memory(memory)
    runner = Runner(systems, engine)
    try:
        pipe.send(READY)
        while True:
            while not pipe.poll(1.0):
                if os.getppid() != parent:  # copies of the pipe in other forks hide that it is gone
                    return
            for task in pipe.recv():
                pipe.send(runner(task))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass  # the parent is gone or has no more work
    finally:
        runner.close()


class _Worker:
    def __init__(self, systems: list[System], engine: Engine, memory: float) -> None:
        forked = sys.platform == "linux" and engine == "native" and not any(s.foreign for s in systems)
        context: Any = mp.get_context("fork" if forked else "spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_work, args=(theirs, os.getpid(), systems, engine, memory), daemon=True)
        with warnings.catch_warnings():  # of threads in the parent, of which this fork needs no lock
            warnings.simplefilter("ignore", DeprecationWarning)
            self.process.start()
        theirs.close()
        self.tasks: deque[Task] = deque()
        self.since = time.monotonic()
        self.begun = False

    def end(self) -> None:
        self.pipe.close()
        self.process.kill()
        self.process.join()


class Pool:
    """Workers on this machine.

    Parameters
    ----------
    systems, engine
        As `Runner` takes them.
    n : int
        Number of workers; by default as many as cores that this process may use.
    timeout : float
        Longest time for one task (s).
    memory : float
        Largest address space of a worker (GB).
    """

    STARTUP = 60.0  # s: a new process has to import everything first

    def __init__(self, systems: list[System], engine: Engine, n: int | None, timeout: float, memory: float) -> None:
        self._of_worker = (systems, engine, memory)
        self._names = [s.case.name for s in systems]
        self._n = n or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))
        self._timeout = timeout
        self._workers: list[_Worker] = []
        self._unborn = 0  # workers in a row that died before they were ready
        self._died: set[int] = set()  # tasks at which a worker died once

    def __enter__(self) -> Pool:
        """Start the workers: they import what they need while the study is still being prepared."""
        self._workers = [_Worker(*self._of_worker) for _ in range(self._n)]
        return self

    def __exit__(self, *exception: object) -> None:
        for w in self._workers:
            w.end()

    def run(self, tasks: Iterable[Task]) -> Iterator[dict[str, Any]]:
        """Rows as they are finished."""
        waiting = deque(tasks)
        while waiting or any(w.tasks for w in self._workers):
            while len(self._workers) < min(self._n, len(waiting)):
                self._workers.append(_Worker(*self._of_worker))
            share = max(1, min(AT_ONCE, len(waiting) // (2 * self._n)))
            for w in self._workers:
                if waiting and not w.tasks:
                    w.tasks.extend(waiting.popleft() for _ in range(min(share, len(waiting))))
                    w.since = time.monotonic()
                    with suppress(BrokenPipeError, ConnectionResetError):  # died between two tasks: noticed below
                        w.pipe.send(list(w.tasks))
            yield from self._listen(waiting)

    def _listen(self, waiting: deque[Task]) -> Iterator[dict[str, Any]]:
        busy = [w for w in self._workers if w.tasks]
        ready = multiprocessing.connection.wait([w.pipe for w in busy], timeout=0.2)
        for w in busy:
            if w.pipe in ready:
                try:
                    row = w.pipe.recv()
                except (EOFError, ConnectionResetError):
                    w.process.join()
                    yield from self._dead(w, waiting)
                    continue
                w.since, w.begun = time.monotonic(), True
                if row != READY:
                    w.tasks.popleft()
                    yield row
            elif time.monotonic() - w.since > self._timeout + (0.0 if w.begun else self.STARTUP):
                task = w.tasks.popleft()
                self._replace(w, waiting)
                yield row_of(task, self._names[task.case], "timeout", f"not finished after {self._timeout:g} s")

    def _dead(self, w: _Worker, waiting: deque[Task]) -> Iterator[dict[str, Any]]:
        task, status = w.tasks.popleft(), w.process.exitcode
        self._replace(w, waiting)
        self._unborn = 0 if w.begun else self._unborn + 1
        if self._unborn > 2 * self._n:  # not the fault of a task
            raise InputError(
                f"the workers of the study end with status {status} before they begin; a script that runs a study must "
                "be a file whose main part stands under if __name__ == '__main__'"
            )
        if task.index in self._died:
            yield row_of(task, self._names[task.case], "killed", f"ended its process twice, with status {status}")
        else:
            self._died.add(task.index)
            waiting.appendleft(task)

    def _replace(self, w: _Worker, waiting: deque[Task]) -> None:
        waiting.extendleft(reversed(w.tasks))
        w.tasks.clear()
        self._workers.remove(w)
        w.end()

"""Run a study in local worker processes, or on a Dask cluster.

A worker may crash, hang or exceed its memory limit.

The parent supervises its workers. A worker receives several tasks in one message and returns the rows in batches,
because a message takes as long as a short run. The worker counts started tasks in shared memory, so that the parent
knows the current task. If a worker dies, the parent starts another worker and repeats the task. The reason is that
another process may have killed the worker, and the table must not depend on other processes. The parent also repeats
tasks that were finished but not yet reported. If a task kills its worker twice or exceeds the time limit, its row
states the reason. A worker ends when its parent has ended.

If a study only uses the C core, its workers are forks. A fork starts without delay, because it shares the imports of
the parent. It only uses functions that are safe in a fork of a process with threads. All other workers (FMUs, foreign
code, platforms without a safe fork) are new processes. A worker with foreign code is confined and has a supervisor on
Linux (`PipedChild`). The parent does not trust such a worker. Therefore the answers are JSON, because pickled data
could run code.

A Dask cluster returns the same rows as local processes. On a cluster with a queueing system, start the workers with
dask-jobqueue (`SLURMCluster(...).scale(20)`) and pass the address of the scheduler. The workers need the same version
of HystFMU.
"""

import gc
import json
import multiprocessing as mp
import multiprocessing.connection
import os
import shutil
import signal
import sys
import tempfile
import time
import warnings
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import replace
from itertools import islice
from typing import Any

from hystfmu.base import InputError, extras
from hystfmu.base.child import PipedChild, late, limit_memory, tell_unconfined
from hystfmu.base.confine import Box, confine
from hystfmu.scenario.engine.simulation import Run, box_of, one_line
from hystfmu.scenario.system.case import with_files
from hystfmu.scenario.system.system import System
from hystfmu.studies.task import Runner, Task, row_of

MOMENT = 0.01  # a worker reports its finished tasks after this time (s); a message takes as long as a short run
MOST_AT_ONCE = 64  # largest number of tasks in one message to a worker
END = 10.0  # time in which a supervisor must end all processes (s)
MOST_ANSWER = 2**26  # largest message from a worker (bytes)


def _work(pipe: Any, begun: Any, parent: int, folder: str, systems: list[System], run: Run, box: Box | None) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent handles the interrupt
    if box is not None:
        confine(box)
    tempfile.tempdir = folder  # the parent removes this folder, because a killed process cannot remove it
    gc.freeze()  # a garbage collection would copy the pages shared with the parent
    limit_memory(run.gigabytes)
    runner = Runner(systems, run)
    try:
        pipe.send_bytes(b"[]")  # this message means that the worker is ready

        while True:
            while not pipe.poll(1.0):
                # the pipe stays open after the parent ends, because other forks have copies of it
                if os.getppid() != parent:
                    return
            rows, told = [], time.monotonic()
            for task in pipe.recv():
                begun.value += 1
                rows.append(_answer(runner(task)))
                if time.monotonic() - told > MOMENT:
                    pipe.send_bytes(json.dumps(rows).encode())
                    rows, told = [], time.monotonic()
            if rows:
                pipe.send_bytes(json.dumps(rows).encode())
    except (EOFError, BrokenPipeError, ConnectionResetError):
        pass  # the parent has ended or has no more tasks
    finally:
        runner.close()


def _answer(row: dict[str, Any]) -> tuple[str, str, dict[str, float]]:
    """Return status, reason and metrics of a row, which the worker sends to the parent."""
    return row["status"], row["reason"], row["metrics"]


def _forked(systems: list[System], run: Run) -> bool:
    return sys.platform == "linux" and run.engine == "native" and not any(s.foreign for s in systems)


class _Worker:
    def __init__(self, systems: list[System], run: Run) -> None:
        self._folder = tempfile.mkdtemp(prefix="hystfmu-study-")
        foreign = any(s.foreign for s in systems)
        box = box_of(systems, self._folder) if run.confined and foreign else None
        if box is not None:
            systems = [replace(s, case=with_files(s.case)) for s in systems]
        self._supervised, self._names = sys.platform == "linux" and foreign, [s.case.name for s in systems]
        words = (self._folder, systems, run)
        if self._supervised:
            self.process: Any = PipedChild(_work, self._folder, (*words, None), box)
            self.pipe, self._begun = self.process.pipe, self.process.count
        else:
            self._start(words, box, "fork" if _forked(systems, run) else "spawn")
        self.tasks: deque[Task] = deque()
        self.answered = 0
        self.since = time.monotonic()
        self.ready = False
        self.share = 1

    def _start(self, words: tuple[Any, ...], box: Box | None, method: str) -> None:
        context: Any = mp.get_context(method)
        self.pipe, theirs = context.Pipe()
        self._begun = context.RawValue("q", 0)
        self.process = context.Process(target=_work, args=(theirs, self._begun, os.getpid(), *words, box), daemon=True)
        # Python warns about threads in the parent, but this fork uses none of their locks
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            self.process.start()
        theirs.close()

    def give(self, tasks: list[Task]) -> None:
        """Send tasks to the worker."""
        if not tasks:
            return
        if not self.tasks:
            self.since = time.monotonic()
        self.tasks.extend(tasks)
        # the worker died between two tasks, which `_listen` detects
        with suppress(BrokenPipeError, ConnectionResetError):
            self.pipe.send(tasks)

    def take(self) -> list[dict[str, Any]]:
        """Receive rows from the worker, and update the number of tasks that it receives at once.

        An EOFError means that the worker ended or sent an invalid answer.
        """
        try:
            answers = json.loads(self.pipe.recv_bytes(MOST_ANSWER))
            rows = [
                row_of(task, self._names[task.case], str(status), str(reason), {k: float(v) for k, v in found.items()})
                for task, (status, reason, found) in zip(self.tasks, answers, strict=False)
            ]
            if not isinstance(answers, list) or len(rows) < len(answers):
                raise EOFError
        except (OSError, ValueError, TypeError, AttributeError, RecursionError):
            raise EOFError from None
        now = time.monotonic()
        if rows:
            fits = int(2 * MOMENT * len(rows) / max(now - self.since, 1e-9))
            self.share = max(1, min(fits, 2 * self.share, MOST_AT_ONCE))
        for _ in rows:
            self.tasks.popleft()
        self.answered += len(rows)
        self.since, self.ready = now, True
        return rows

    def blamed(self) -> Task:
        """Remove the task at which the worker died from its tasks, and return this task."""
        at = min(max(self._begun.value - self.answered - 1, 0), len(self.tasks) - 1)
        task = self.tasks[at]
        del self.tasks[at]
        return task

    def end(self) -> None:
        self.pipe.close()
        self.kill()
        self.process.join(END if self._supervised else None)
        self.process.kill()
        self.process.join()
        shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def advice(self) -> str:
        """Remedy, as text of an error message, for a worker that ends before its first task."""
        if self._supervised:
            return one_line("".join((self.process.said or ["it said nothing"])[-1:]))
        return "a script that runs a study must be a file with its main part under if __name__ == '__main__'"

    def kill(self) -> None:
        """Terminate the worker and all processes that foreign code started in it. Do not wait for their end."""
        if self._supervised:
            self.process.terminate()
        else:
            self.process.kill()


class _Waiting:
    """Queue of the tasks that have not been sent to a worker.

    New tasks are created while other tasks run. Tasks that a dead worker returns are first in the queue.
    """

    def __init__(self, source: Iterable[Task], n: int) -> None:
        self._source, self._back, self.left = iter(source), deque[Task](), n

    def take(self, n: int) -> list[Task]:
        """Take the next n tasks, or all remaining tasks if they are fewer."""
        taken = [self._back.popleft() for _ in range(min(n, len(self._back)))]
        taken += islice(self._source, n - len(taken))
        self.left = self.left - len(taken) if len(taken) == n else 0
        return taken

    def put_back(self, tasks: Iterable[Task]) -> None:
        """Return tasks to the front of the queue."""
        tasks = list(tasks)
        self._back.extendleft(reversed(tasks))
        self.left += len(tasks)


class Pool:
    """Worker processes on this computer. By default there is one worker for each core that this process may use.

    The arguments `systems` and `run` are those of `Runner`. The time limit is the limit for each task. The memory limit
    is the limit for the address space of a worker.
    """

    STARTUP = 60.0  # additional time for the imports of a new process (s)

    def __init__(self, systems: list[System], run: Run, n: int | None) -> None:
        self._of_worker = (systems, run)
        if run.confined and any(s.foreign for s in systems):
            tell_unconfined()
        self._names = [s.case.name for s in systems]
        self._n = n or len(os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else range(os.cpu_count() or 1))
        self._timeout = run.seconds
        self._workers: list[_Worker] = []
        self._unborn = 0  # number of successive workers that died before they were ready
        self._died: set[int] = set()  # indices of tasks that killed a worker once

    def __enter__(self) -> "Pool":
        """Start the workers during the preparation of the study, because their imports take time."""
        if not _forked(*self._of_worker):
            self._workers = [_Worker(*self._of_worker) for _ in range(self._n)]
        return self

    def __exit__(self, *exception: object) -> None:
        for w in self._workers:
            w.kill()  # all of them, before the parent waits for one
        for w in self._workers:
            w.end()

    def run(self, tasks: Iterable[Task], n: int) -> Iterator[dict[str, Any]]:
        """Yield the rows of at most n tasks, each row when its run ends."""
        waiting = _Waiting(tasks, n)
        while waiting.left or any(w.tasks for w in self._workers):
            for k in range(self._n):
                if not waiting.left:
                    break
                if k == len(self._workers):
                    self._workers.append(_Worker(*self._of_worker))
                w, fair = self._workers[k], waiting.left // (2 * self._n)  # the last tasks are sent one by one
                # new tasks are sent early, so that a worker with short tasks does not wait
                if len(w.tasks) <= min(w.share, fair) // 2:
                    w.give(waiting.take(max(1, min(w.share, fair))))
            yield from self._listen(waiting)

    def _listen(self, waiting: _Waiting) -> Iterator[dict[str, Any]]:
        busy = [w for w in self._workers if w.tasks]
        ready = multiprocessing.connection.wait([w.pipe for w in busy], timeout=0.2 if busy else 0.0)
        for w in busy:
            if w.pipe in ready:
                try:
                    yield from w.take()
                except EOFError:
                    yield from self._dead(w, waiting)
            # the worker ended, but a process that it started has the pipe open
            elif w.process.exitcode is not None and not w.pipe.poll():
                yield from self._dead(w, waiting)
            elif time.monotonic() - w.since > self._timeout + (0.0 if w.ready else self.STARTUP):
                task = w.blamed()
                self._replace(w, waiting)
                yield row_of(task, self._names[task.case], "timeout", late(self._timeout))

    def _dead(self, w: _Worker, waiting: _Waiting) -> Iterator[dict[str, Any]]:
        task = w.blamed()
        self._replace(w, waiting)
        status = w.process.exitcode
        self._unborn = 0 if w.ready else self._unborn + 1
        if self._unborn > 2 * self._n:  # workers do not start, so no task is the cause
            raise InputError(f"the workers of the study exit with status {status} before they begin; {w.advice}")
        if task.index in self._died:
            yield row_of(task, self._names[task.case], "killed", f"ended its process twice, with status {status}")
        else:
            self._died.add(task.index)
            waiting.put_back([task])

    def _replace(self, w: _Worker, waiting: _Waiting) -> None:
        waiting.put_back(w.tasks)
        w.tasks.clear()
        self._workers.remove(w)
        w.end()


CHUNK = 8  # number of tasks per submission


def _run(systems: list[System], run: Run, tasks: list[Task]) -> list[dict[str, Any]]:
    """Run tasks in a worker of Dask, which removes the files of a killed worker from its folder."""
    from distributed import get_worker

    with closing(Runner(systems, run, str(get_worker().local_directory), apart=True)) as runner:
        return [runner(task) for task in tasks]


class DaskPool:
    """Workers of a Dask cluster, whose scheduler has the address ``dask://HOST:PORT``.

    The arguments `systems` and `run` are those of `Runner`. The limits of time and memory apply only to runs with
    foreign FMUs. Other runs cannot hang, and Dask limits their memory. An InputError is raised if the address is
    invalid, the scheduler does not answer, or Dask is not installed.
    """

    def __init__(self, address: str, systems: list[System], run: Run) -> None:
        with extras("a study on a cluster (--on)"):
            import distributed
        self._dask: Any = distributed  # Dask has no type annotations
        scheme, _, host = address.partition("://")
        if scheme != "dask" or ":" not in host:
            raise InputError(f"--on must read dask://HOST:PORT. Got {address!r} instead.")
        try:
            self._client = self._dask.Client(f"tcp://{host}", timeout=10)
        except (OSError, ValueError, TimeoutError) as e:
            raise InputError(f"--on {address}: no Dask scheduler answers there ({e})") from None
        self._names = [s.case.name for s in systems]
        self._run = run
        self._systems = self._client.scatter([systems], broadcast=True)[0]
        self._held: dict[Any, list[Task]] = {}  # running tasks by future

    def __enter__(self) -> "DaskPool":
        return self

    def __exit__(self, *exception: object) -> None:
        with suppress(OSError):  # the scheduler has ended, so its workers end and their folders are removed
            self._client.cancel(list(self._held))
        self._client.close()

    def run(self, tasks: Iterable[Task], n: int) -> Iterator[dict[str, Any]]:
        """Yield the rows of at most n tasks. Tasks are sent in groups, and the rows of a group are yielded together.

        If a group kills its worker, each of its tasks is sent alone, to find the faulty one.
        """
        source = iter(tasks)
        lanes = 2 * max(1, len(self._client.scheduler_info()["workers"]))
        running = self._dask.as_completed([])
        again: deque[list[Task]] = deque()

        def submit() -> bool:
            chunk = again.popleft() if again else list(islice(source, CHUNK))
            if not chunk:
                return False
            future = self._client.submit(_run, self._systems, self._run, chunk, pure=False, retries=1)
            self._held[future] = chunk
            running.add(future)
            return True

        for _ in range(lanes):
            submit()
        while self._held:
            future = next(running)
            chunk = self._held.pop(future)
            if future.status == "finished":
                yield from future.result()
            elif len(chunk) > 1:
                again.extend([t] for t in chunk)
            else:
                reason = str(future.exception()).splitlines()[0]
                yield row_of(chunk[0], self._names[chunk[0].case], "killed", reason)
            while len(self._held) < lanes and submit():
                pass

"""Run a study on a Dask cluster. The rows are the same as on this machine.

On a cluster with a queueing system, start the workers with dask-jobqueue (`SLURMCluster(...).scale(20)`) and pass the
address of the scheduler.  The workers need the same version of HystFMU.
"""

from __future__ import annotations

import threading
import uuid
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import islice
from typing import Any

from hystfmu.base.errors import InputError, extras
from hystfmu.scenario.engine.simulation import Run
from hystfmu.scenario.system.system import System
from hystfmu.studies.task import Runner, Task, row_of

CHUNK = 16  # tasks per submission
_RUNNERS: dict[int, tuple[str, Runner]] = {}  # of this worker process, by thread: a runner serves one task at a time
_CLOSED: set[str] = set()  # studies that have ended: a chunk that was queued then may still be started


def _run(key: str, systems: list[System], run: Run, tasks: list[Task]) -> list[dict[str, Any]]:
    thread = threading.get_ident()
    if thread not in _RUNNERS or _RUNNERS[thread][0] != key:
        _close(thread)  # left by a study that was killed
        _RUNNERS[thread] = key, Runner(systems, run, _scratch(), apart=True)
    mine = _RUNNERS[thread]
    rows = []
    for task in tasks:
        if key not in _CLOSED:
            rows.append(mine[1](task))
        if key in _CLOSED:  # before or while this task ran; `_close_study` may not have seen the runner
            _close(thread)
            mine[1].close()
            break
    return rows


def _scratch() -> str:
    """Return the folder of the worker. Dask removes the files of a killed worker from this folder."""
    from distributed import get_worker

    return str(get_worker().local_directory)


def _close(thread: int) -> None:
    if thread in _RUNNERS:
        _RUNNERS.pop(thread)[1].close()


def _close_study(key: str) -> None:
    _CLOSED.add(key)
    for thread in [t for t, (of, _) in _RUNNERS.items() if of == key]:
        _close(thread)


class DaskPool:
    """Workers of a Dask cluster. Its scheduler has the address ``dask://HOST:PORT``.

    For `systems` and `run` see `Runner`. The limits of time and memory apply to runs with foreign FMUs. Other runs
    cannot hang, and Dask limits their memory. An InputError is raised if the address is invalid, the scheduler does not
    answer, or Dask is not installed.
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
        self._key = uuid.uuid4().hex  # tells workers which runners belong to this study
        self._systems = self._client.scatter([systems], broadcast=True)[0]
        self._held: dict[Any, list[Task]] = {}  # running tasks by future

    def __enter__(self) -> DaskPool:
        return self

    def __exit__(self, *exception: object) -> None:
        with suppress(OSError):  # the scheduler is gone; its workers end and their folders are removed
            self._client.cancel(list(self._held))
            self._client.run(_close_study, self._key, on_error="ignore")
        self._client.close()

    def stop(self) -> None:
        """Announce the end of the tasks. The workers belong to the cluster and continue to run."""

    def run(self, tasks: Iterable[Task], n: int) -> Iterator[dict[str, Any]]:
        """Yield each row when its run ends. A chunk that kills its workers is split to find the faulty task."""
        source = iter(tasks)
        lanes = 2 * max(1, len(self._client.scheduler_info()["workers"]))
        running = self._dask.as_completed([])
        again: deque[list[Task]] = deque()

        def submit() -> bool:
            chunk = again.popleft() if again else list(islice(source, CHUNK))
            if not chunk:
                return False
            future = self._client.submit(_run, self._key, self._systems, self._run, chunk, pure=False, retries=1)
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

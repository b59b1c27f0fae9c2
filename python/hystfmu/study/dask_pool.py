"""Runs of a study on a Dask cluster: the same rows as on this machine.

For a cluster with a queueing system start the workers with dask-jobqueue (`SLURMCluster(...).scale(20)`) and pass the
address of its scheduler.  Workers need the same version of HystFMU.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Any

from hystfmu.errors import InputError
from hystfmu.scenario.run import Engine
from hystfmu.scenario.system import System
from hystfmu.study.task import Runner, Task, row_of

CHUNK = 16  # tasks in one submission
_RUNNERS: dict[str, Runner] = {}  # of a worker process


def _run(key: str, systems: list[System], engine: Engine, tasks: list[Task]) -> list[dict[str, Any]]:
    if key not in _RUNNERS:
        _RUNNERS.clear()
        _RUNNERS[key] = Runner(systems, engine)
    return [_RUNNERS[key](t) for t in tasks]


class DaskPool:
    """Workers of a Dask cluster.

    Parameters
    ----------
    address : str
        ``dask://HOST:PORT`` of the scheduler.
    systems, engine
        As `Runner` takes them.
    key : str
        Hash of the study: workers keep what they prepared for it.
    timeout : float
        Longest time for one task (s).

    Raises
    ------
    InputError
        Wrong address, no scheduler there, Dask is not installed.
    """

    def __init__(self, address: str, systems: list[System], engine: Engine, key: str, timeout: float) -> None:
        try:
            import distributed
        except ImportError:
            raise InputError("--on dask:// needs the extra 'study': pip install 'hystfmu[study]'") from None
        self._dask: Any = distributed  # it has no types
        scheme, _, host = address.partition("://")
        if scheme != "dask" or ":" not in host:
            raise InputError(f"--on: must read dask://HOST:PORT; got {address!r}")
        try:
            self._client = self._dask.Client(f"tcp://{host}", timeout=10)
        except (OSError, ValueError, TimeoutError) as e:
            raise InputError(f"--on {address}: no Dask scheduler answers there ({e})") from None
        self._names = [s.case.name for s in systems]
        self._engine, self._key, self._timeout = engine, key, timeout
        self._systems = self._client.scatter([systems], broadcast=True)[0]

    def __enter__(self) -> DaskPool:
        return self

    def __exit__(self, *exception: object) -> None:
        self._client.close()

    def stop(self) -> None:
        """No more tasks will come; the workers are not ours."""

    def run(self, tasks: Iterable[Task], n: int) -> Iterator[dict[str, Any]]:
        """Rows as they are finished; a chunk that ends its workers is split until the one task is known."""
        source = iter(tasks)
        lanes = 2 * max(1, len(self._client.scheduler_info()["workers"]))
        running = self._dask.as_completed([])
        held: dict[Any, list[Task]] = {}
        again: deque[list[Task]] = deque()

        def submit() -> bool:
            chunk = again.popleft() if again else list(islice(source, CHUNK))
            if not chunk:
                return False
            future = self._client.submit(_run, self._key, self._systems, self._engine, chunk, pure=False, retries=1)
            held[future.key] = chunk
            running.add(future)
            return True

        for _ in range(lanes):
            submit()
        while held:
            future = next(running)
            chunk = held.pop(future.key)
            if future.status == "finished":
                yield from future.result()
            elif len(chunk) > 1:
                again.extend([t] for t in chunk)
            else:
                reason = str(future.exception()).splitlines()[0]
                yield row_of(chunk[0], self._names[chunk[0].case], "killed", reason)
            while len(held) < lanes and submit():
                pass

"""The cluster by its calls: chunks, lanes, runners by thread, a chunk that kills its workers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from hystfmu import InputError
from hystfmu.studies import dask_pool
from hystfmu.studies.dask_pool import DaskPool
from hystfmu.studies.task import Task, row_of


def task(k: int) -> Task:
    return Task(k, k, 0, f"id{k}", {}, {})


class Future:
    def __init__(self, tasks: list[Task], deadly: set[int]) -> None:
        self.killed = any(t.index in deadly for t in tasks)
        self.tasks, self.status = tasks, "error" if self.killed else "finished"

    def result(self) -> list[dict[str, Any]]:
        return [row_of(t, "one", "ok", "") for t in self.tasks]

    def exception(self) -> Exception:
        return RuntimeError("KilledWorker\nmore")


class Client:
    """A scheduler with some workers, in this process."""

    def __init__(self, workers: int = 2, deadly: set[int] = frozenset()) -> None:  # type: ignore[assignment]
        self.workers, self.deadly, self.calls, self.did, self.most = workers, deadly, [], [], 0

    def scheduler_info(self) -> dict[str, Any]:
        return {"workers": dict.fromkeys(range(self.workers))}

    def submit(
        self, function: Any, key: str, systems: Any, engine: str, limits: Any, chunk: Any, **words: Any
    ) -> Future:
        self.calls.append((key, systems, engine, limits, [t.index for t in chunk], words))
        return Future(chunk, self.deadly)

    def cancel(self, futures: Any) -> None:
        self.did.append(("cancel", len(futures)))

    def run(self, function: Any, key: str, on_error: str) -> None:
        self.did.append(("run", key, on_error))

    def close(self) -> None:
        self.did.append(("close",))


class Completed:
    """Futures in the order of their submission."""

    def __init__(self, futures: list[Future]) -> None:
        self.futures, self.most = list(futures), 0

    def add(self, future: Future) -> None:
        self.futures.append(future)
        self.most = max(self.most, len(self.futures))

    def __next__(self) -> Future:
        return self.futures.pop(0)


@pytest.fixture
def made() -> Any:
    def make(**given: Any) -> tuple[DaskPool, Client, list[Completed]]:
        pool, client, queues = DaskPool.__new__(DaskPool), Client(**given), list[Completed]()
        pool._client, pool._names, pool._key, pool._systems, pool._held = client, ["one"], "key", "systems", {}
        pool._engine, pool._limits = "native", (1.0, 2.0, True)
        pool._dask = SimpleNamespace(as_completed=lambda f: (queues.append(Completed(f)), queues[-1])[1])
        return pool, client, queues

    return make


@pytest.mark.parametrize(("workers", "lanes"), [(2, 4), (0, 2)])
def test_chunks_of_sixteen_on_two_lanes_a_worker(made: Any, workers: int, lanes: int) -> None:
    pool, client, queues = made(workers=workers)
    rows = list(pool.run([task(k) for k in range(150)], 150))
    assert [r["index"] for r in rows] == list(range(150))
    assert [len(c[4]) for c in client.calls] == [16] * 9 + [6]
    assert queues[0].most == lanes
    assert client.calls[0][:4] == ("key", "systems", "native", (1.0, 2.0, True))
    assert client.calls[0][5] == {"pure": False, "retries": 1}
    assert pool._held == {}


def test_a_chunk_that_kills_its_workers_is_split(made: Any) -> None:
    pool, client, _ = made(deadly={3})
    rows = {r["index"]: r for r in pool.run([task(k) for k in range(20)], 20)}
    assert sorted(rows) == list(range(20))
    assert (rows[3]["status"], rows[3]["reason"], rows[3]["case"]) == ("killed", "KilledWorker", "one")
    assert {r["status"] for k, r in rows.items() if k != 3} == {"ok"}
    assert sorted(len(c[4]) for c in client.calls) == [1] * 16 + [4, 16]


def test_the_end_of_a_study_frees_the_cluster(made: Any) -> None:
    pool, client, _ = made()
    with pool as entered:
        assert entered is pool
        pool._held = {object(): [task(0)]}
        pool.stop()
    assert client.did == [("cancel", 1), ("run", "key", "ignore"), ("close",)]
    client.did.clear()
    client.cancel = lambda futures: (_ for _ in ()).throw(OSError())
    pool.__exit__()
    assert client.did == [("close",)]


def test_a_runner_for_each_thread_and_study(monkeypatch: Any) -> None:
    class Runner:
        def __init__(self, *given: Any) -> None:
            self.given, self.closed = given, 0
            made.append(self)

        def __call__(self, t: Task) -> dict[str, Any]:
            if t.index == 99:
                dask_pool._close_study("b")
            return {"index": t.index}

        def close(self) -> None:
            self.closed += 1

    made: list[Runner] = []
    monkeypatch.setattr(dask_pool, "Runner", Runner)
    monkeypatch.setattr(dask_pool, "_RUNNERS", {})
    monkeypatch.setattr(dask_pool, "_CLOSED", set())
    monkeypatch.setattr(dask_pool, "_scratch", lambda: "here")
    limits = (1.0, 2.0, False)

    def run(key: str, *tasks: int) -> list[int]:
        return [r["index"] for r in dask_pool._run(key, [], "fmpy", limits, [task(k) for k in tasks])]

    assert run("a", 0, 1) == [0, 1]
    assert run("a", 2) == [2]
    assert len(made) == 1
    assert made[0].given == ([], "fmpy", "here", limits)
    assert run("b", 3) == [3]
    assert [r.closed for r in made] == [1, 0]  # left by a study that was killed
    assert run("b", 4, 99, 5) == [4, 99]  # closed while the task ran
    assert made[1].closed == 2
    assert dask_pool._RUNNERS == {}
    assert run("b", 7) == []  # it was queued when the study ended, and starts now
    assert made.pop().closed
    assert dask_pool._RUNNERS == {}
    dask_pool._close(12345)
    run("c", 6)
    dask_pool._close_study("other")
    assert made[2].closed == 0


@pytest.mark.parametrize("address", ["tcp://host:1", "dask:host", "dask://host", "host:1"])
def test_an_address_names_host_and_port(address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="--on must read dask://HOST:PORT"):
        DaskPool(address, [], "native", 1.0, 1.0)


def test_a_scheduler_is_waited_for_ten_seconds(monkeypatch: Any) -> None:
    distributed = pytest.importorskip("distributed")
    asked: list[Any] = []

    class Scheduler(Client):
        def __init__(self, address: str, timeout: float) -> None:
            super().__init__()
            asked.append((address, timeout))
            if "gone" in address:
                raise TimeoutError("no answer")

        def scatter(self, what: Any, broadcast: bool) -> Any:
            asked.append((what, broadcast))
            return what

    monkeypatch.setattr(distributed, "Client", Scheduler)
    systems: Any = [SimpleNamespace(case=SimpleNamespace(name="one"))]
    pool = DaskPool("dask://host:87", systems, "native", 3.0, 4.0)
    assert asked == [("tcp://host:87", 10), ([systems], True)]
    assert (pool._names, pool._limits, pool._systems, len(pool._key)) == (["one"], (3.0, 4.0, True), systems, 32)
    with pytest.raises(InputError, match=r"--on dask://gone:1: no Dask scheduler answers there \(no answer\)"):
        DaskPool("dask://gone:1", systems, "native", 3.0, 4.0)

"""The pool of workers with made workers, pipes, clocks and clusters: what is sent, counted, blamed and closed."""

import json
import signal
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hystfmu.scenario import Run
from hystfmu.studies import pool
from hystfmu.studies.pool import DaskPool, Pool, _Waiting, _Worker
from hystfmu.studies.task import Task, row_of

TASKS = [Task(k, k, 0, str(k), {}, {}) for k in range(200)]
SYSTEMS: Any = [SimpleNamespace(case=SimpleNamespace(name="c"), foreign=False)]


def row(task: Task) -> dict[str, Any]:
    return row_of(task, "c", "ok", "", {"m": float(task.index)})


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    now = [0.0]
    monkeypatch.setattr(pool.time, "monotonic", lambda: now[0])
    return now


def test_a_worker_answers_in_batches_of_a_moment(monkeypatch: pytest.MonkeyPatch, clock: list[float]) -> None:
    """Four tasks of 4 ms, then one: a message after more than 10 ms, and the rest at the end."""
    sent, called = list[Any](), list[Any]()
    work, asked = [TASKS[:4], TASKS[4:5]], [False, True]

    def receive() -> list[Task]:
        if not work:
            raise EOFError
        return work.pop(0)

    class Slow:
        def __init__(self, *given: Any) -> None:
            called.append(given)

        def __call__(self, task: Task) -> dict[str, Any]:
            clock[0] += 0.004
            return row(task)

        def close(self) -> None:
            called.append("closed")

    pipe = SimpleNamespace(
        send_bytes=lambda content: sent.append([int(metrics["m"]) for _, _, metrics in json.loads(content)]),
        poll=lambda seconds: asked.pop(0) if asked else True,
        recv=receive,
    )
    monkeypatch.setattr(pool, "Runner", Slow)
    monkeypatch.setattr(pool.signal, "signal", lambda *given: called.append(given))
    monkeypatch.setattr(pool, "limit_memory", called.append)
    monkeypatch.setattr(pool.tempfile, "tempdir", None)
    monkeypatch.setattr(pool.os, "getppid", lambda: 7)
    begun, run = SimpleNamespace(value=0), Run("native", gigabytes=3.0)
    pool._work(pipe, begun, 7, "folder", SYSTEMS, run, None)
    assert sent == [[], [0, 1, 2], [3], [4]]
    assert (begun.value, pool.tempfile.tempdir) == (5, "folder")
    assert called == [(signal.SIGINT, signal.SIG_IGN), 3.0, (SYSTEMS, run), "closed"]
    asked.append(False)
    work.append(TASKS[:1])
    pool._work(pipe, begun, 8, "folder", SYSTEMS, run, None)
    assert (sent[4:], called[-1]) == ([[]], "closed")  # its parent has ended


def worker(n: int) -> Any:
    """A worker with n tasks whose process is not there."""
    made: Any = _Worker.__new__(_Worker)
    made.tasks, made._names, made._begun = deque(TASKS[:n]), ["c"], SimpleNamespace(value=0)
    made.answered, made.since, made.share, made.ready = 0, 0.0, 1, False
    return made


def test_the_share_of_a_worker_doubles_as_long_as_it_takes_twenty_milliseconds(clock: list[float]) -> None:
    w, most, told = worker(200), list[int](), list[int]()
    quick = [(n, 1e-3) for n in (1, 2, 4, 8, 16, 32, 64)]
    for n, seconds in [(0, 0.1), *quick, (64, 0.06), (1, 0.009), (1, 0.5)]:
        clock[0] += seconds
        content = json.dumps([("ok", "", {"m": 1})] * n).encode()
        w.pipe = SimpleNamespace(recv_bytes=lambda size, c=content: most.append(size) or c)
        assert [r["index"] for r in w.take()] == list(range(w.answered - n, w.answered))
        told.append(w.share)
        assert (w.since, w.ready) == (clock[0], True)
    assert told == [1, 2, 4, 8, 16, 32, 64, 64, 21, 2, 1]
    assert set(most) == {2**26}
    assert (w.answered, len(w.tasks)) == (193, 7)


@pytest.mark.parametrize("content", [
    b"?", b"{}", b"3", b'["ok"]', b'[["ok", "", 1]]', b'[["ok", "", {"m": "x"}]]',
    b'[["ok", "", {}]' + 2 * b', ["ok", "", {}]' + b"]",
])  # fmt: skip
def test_an_invalid_answer_ends_a_worker(content: bytes) -> None:
    w = worker(2)
    w.pipe = SimpleNamespace(recv_bytes=lambda size: content)
    with pytest.raises(EOFError):
        w.take()


@pytest.mark.parametrize(("begun", "answered", "at"), [(0, 0, 0), (1, 0, 0), (3, 0, 2), (5, 3, 1), (9, 0, 3)])
def test_the_task_that_had_begun_is_blamed(begun: int, answered: int, at: int) -> None:
    w = worker(4)
    w._begun.value, w.answered = begun, answered
    assert w.blamed() == TASKS[at]
    assert list(w.tasks) == [t for t in TASKS[:4] if t != TASKS[at]]


@pytest.mark.parametrize("supervised", [False, True])
def test_the_end_of_a_worker(supervised: bool, tmp_path: Path) -> None:
    """A supervisor is asked to end all processes, and has ten seconds for it."""
    w, called, folder = worker(0), list[Any](), tmp_path / "scratch"
    (folder / "more").mkdir(parents=True)
    w._supervised, w._folder = supervised, str(folder)
    w.pipe = SimpleNamespace(close=lambda: called.append("close"))
    process = {name: lambda name=name: called.append(name) for name in ("kill", "terminate")}
    w.process = SimpleNamespace(**process, join=lambda *seconds: called.append(seconds))
    w.end()
    first = ["terminate", (10.0,)] if supervised else ["kill", (None,)]
    assert called == ["close", *first, "kill", ()]
    assert not folder.exists()


def test_tasks_that_come_back_are_first() -> None:
    waiting = _Waiting(TASKS[:5], 9)
    assert (waiting.take(2), waiting.left) == (TASKS[:2], 7)
    waiting.put_back(iter(TASKS[:2]))
    assert (waiting.take(3), waiting.left) == (TASKS[:3], 6)
    assert (waiting.take(3), waiting.left) == (TASKS[3:5], 0)  # fewer than it was told


def test_workers_get_work_early_and_the_last_tasks_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[tuple[int, int]] = []
    made: list[Any] = []

    class Made:
        share = 8

        def __init__(self, systems: Any, run: Run) -> None:
            self.tasks: deque[Task] = deque()
            made.append(self)

        def give(self, tasks: list[Task]) -> None:
            given.append((made.index(self), len(tasks)))
            self.tasks.extend(tasks)

    def listen(self: Pool, waiting: _Waiting) -> Iterator[dict[str, Any]]:
        """Each worker ends three tasks."""
        for w in made:
            yield from (row(w.tasks.popleft()) for _ in range(min(3, len(w.tasks))))

    monkeypatch.setattr(pool, "_Worker", Made)
    monkeypatch.setattr(Pool, "_listen", listen)
    monkeypatch.setattr(pool.os, "sched_getaffinity", lambda process: {3, 5}, raising=False)
    rows = list(Pool(SYSTEMS, Run("native"), None).run(TASKS[:40], 40))
    assert sorted(r["index"] for r in rows) == list(range(40))
    ones = [(k % 2, 1) for k in range(7)]
    assert given == [(0, 8), (1, 8), (0, 6), (1, 4), (1, 3), (0, 2), (1, 2), *ones]


def test_a_cluster_gets_groups_and_a_group_that_dies_one_by_one() -> None:
    groups, ahead = list[int](), list[int]()

    class Future:
        def __init__(self, chunk: list[Task]) -> None:
            self.status = "error" if any(t.index in (3, 19) for t in chunk) else "finished"
            self.result, self.exception = lambda: map(row, chunk), lambda: RuntimeError("gone\nmore")

    class Client:
        def scheduler_info(self) -> dict[str, Any]:
            return {"workers": {"a": 1}}

        def submit(self, work: Any, systems: Any, run: Any, chunk: list[Task], **more: Any) -> Any:
            groups.append(len(chunk))
            assert more == {"pure": False, "retries": 1}
            return Future(chunk)

    class Running(deque[Any]):
        add = deque.append

        def __next__(self) -> Any:
            ahead.append(len(self))
            return self.popleft()

    cluster: Any = DaskPool.__new__(DaskPool)
    cluster._client, cluster._dask, cluster._held = Client(), SimpleNamespace(as_completed=Running), {}
    cluster._names, cluster._systems, cluster._run = ["c"], None, None
    rows = {r["index"]: (r["status"], r["reason"]) for r in cluster.run(TASKS[:30], 30)}
    assert rows == {k: ("killed", "gone") if k in (3, 19) else ("ok", "") for k in range(30)}
    assert sorted(groups) == [1] * 16 + [6, 8, 8, 8]
    assert max(ahead) == 2

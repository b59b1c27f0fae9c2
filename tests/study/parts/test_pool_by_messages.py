"""The pool by its messages: what a worker answers and when, which task is at fault, what goes back to the queue."""

from __future__ import annotations

import json
import os
import signal
from types import SimpleNamespace

import pytest

from hystfmu import InputError
from hystfmu.studies import pool
from hystfmu.studies.pool import Pool, _Waiting, _Worker
from hystfmu.studies.task import Task, row_of


def task(index, case=0):
    return Task(index, index, case, f"id{index}", {"v": float(index)}, {})


def systems(foreign=False):
    return [SimpleNamespace(foreign=foreign, case=SimpleNamespace(name="one"))]


# ---- the queue ------------------------------------------------------------------------------------------------------
def test_the_queue_counts_what_is_left_and_returns_to_its_front():
    made = []
    waiting = _Waiting((made.append(k) or task(k) for k in range(5)), 5)
    assert [t.index for t in waiting.take(2)] == [0, 1]
    assert (waiting.left, made) == (3, [0, 1])  # made on demand
    waiting.put_back([task(0), task(1)])
    assert waiting.left == 5
    assert [t.index for t in waiting.take(3)] == [0, 1, 2]
    assert waiting.left == 2
    assert [t.index for t in waiting.take(3)] == [3, 4]
    assert waiting.left == 0
    waiting.put_back([task(4)])
    assert waiting.left == 1
    assert [t.index for t in waiting.take(1)] == [4]
    short = _Waiting(iter([task(0)]), 9)  # fewer than announced
    assert len(short.take(2)) == 1
    assert short.left == 0


# ---- the worker -----------------------------------------------------------------------------------------------------
class Pipe:
    """A pipe with given messages; it ends with an EOFError."""

    def __init__(self, messages=(), polls=None):
        self.messages, self.sent, self.polls = list(messages), [], list(polls or [])

    def poll(self, seconds=0.0):
        assert seconds == 1.0  # so long after its parent a worker ends
        return self.polls.pop(0) if self.polls else True

    def recv(self):
        if not self.messages:
            raise EOFError
        return self.messages.pop(0)

    def send_bytes(self, content):
        self.sent.append(json.loads(content))


@pytest.fixture
def working(monkeypatch):
    """Run `_work` in this process on a fake clock; return the messages that it sent."""

    def work(pipe, step, parent=None, box=None, foreign=False):
        clock, begun, did = [0.0], SimpleNamespace(value=0), []

        class Runner:
            def __init__(self, systems, engine):
                did.append("runner")

            def __call__(self, task):
                clock[0] += step
                return row_of(task, "one", "ok", "", {"m": float(task.index)})

            def close(self):
                did.append("closed")

        monkeypatch.setattr(pool, "Runner", Runner)
        monkeypatch.setattr(pool, "time", SimpleNamespace(monotonic=lambda: clock[0]))
        monkeypatch.setattr(pool, "limit_memory", lambda gb: did.append(("memory", gb)))
        monkeypatch.setattr(pool, "confine", lambda box: did.append(("confine", box)))
        monkeypatch.setattr(pool.gc, "freeze", lambda: did.append("freeze"))
        monkeypatch.setattr(pool.signal, "signal", lambda *given: did.append(given))
        monkeypatch.setattr(pool.tempfile, "tempdir", "elsewhere")
        pool._work(
            pipe, begun, os.getppid() if parent is None else parent, "here", systems(foreign), "native", 2.5, box
        )
        did.append(pool.tempfile.tempdir)
        return begun.value, did

    return work


@pytest.mark.parametrize(
    ("step", "batches"),
    [
        (0.001, [[0, 1, 2, 3, 4]]),
        (0.006, [[0, 1], [2, 3], [4]]),
        (0.02, [[0], [1], [2], [3], [4]]),
        (0.01, [[0, 1], [2, 3], [4]]),
    ],
)
def test_a_worker_answers_in_batches_of_ten_milliseconds(working, step, batches):
    pipe = Pipe([[task(k) for k in range(5)]])
    begun, did = working(pipe, step)
    assert pipe.sent == [[], *([["ok", "", {"m": float(k)}] for k in batch] for batch in batches)]
    assert begun == 5
    assert did == [(signal.SIGINT, signal.SIG_IGN), "freeze", ("memory", 2.5), "runner", "closed", "here"]


def test_a_worker_with_a_box_is_confined(working):
    assert ("confine", "box") in working(Pipe(), 0.1, box="box")[1]


def test_a_worker_ends_with_its_parent(working):
    pipe = Pipe([[task(0)]], polls=[False, False])
    begun, did = working(pipe, 0.1, parent=-1)
    assert (begun, pipe.sent) == (0, [[]])
    assert did[-2] == "closed"
    waited = Pipe([[task(0)]], polls=[False, False, True])
    assert working(waited, 0.1)[0] == 1  # its parent lives: it waits on


@pytest.mark.parametrize(("foreign", "confined", "said"), [(True, True, 1), (True, False, 0), (False, True, 0)])
def test_a_system_that_cannot_confine_says_so(monkeypatch, foreign, confined, said):
    told = []
    monkeypatch.setattr(pool, "tell_unconfined", lambda: told.append(1))
    made = Pool([*systems(), *systems(foreign)], "native", 1, 1.0, 1.0, confined)
    assert len(told) == said
    assert made._of_worker[1:] == ("native", 1.0, confined)
    assert Pool.STARTUP == 60.0


def test_which_workers_are_forks_and_which_are_supervised(monkeypatch):
    monkeypatch.setattr(pool.sys, "platform", "linux")
    assert pool._forked(systems(), "native")
    assert not pool._forked(systems(), "fmpy")
    assert not pool._forked(systems(foreign=True), "native")
    assert not pool._forked([*systems(), *systems(foreign=True)], "native")
    assert pool._supervised([*systems(), *systems(foreign=True)])
    assert pool._supervised(systems(foreign=True))
    assert not pool._supervised(systems())
    monkeypatch.setattr(pool.sys, "platform", "win32")
    assert not pool._forked(systems(), "native")
    assert not pool._supervised(systems(foreign=True))


# ---- the parent's side of a worker ----------------------------------------------------------------------------------
class Ears:
    """The parent's end of a pipe."""

    def __init__(self, answers=()):
        self.answers, self.sent, self.closed = list(answers), [], False

    def recv_bytes(self, most):
        assert most == 2**26
        found = self.answers.pop(0)
        if isinstance(found, Exception):
            raise found
        return found if isinstance(found, bytes) else json.dumps(found).encode()

    def send(self, tasks):
        self.sent.append([t.index for t in tasks])

    def poll(self):
        return bool(self.answers)

    def close(self):
        self.closed = True


class Process:
    def __init__(self):
        self.exitcode, self.did = None, []

    def join(self, seconds="ever"):
        self.did.append(("join", seconds))

    def kill(self):
        self.did.append("kill")

    def terminate(self):
        self.did.append("terminate")


def worker(tmp_path, answers=(), tasks=(), begun=0, supervised=False):
    made = _Worker.__new__(_Worker)
    made.pipe, made.process, made._names = Ears(answers), Process(), ["one"]
    made._begun, made._folder, made._supervised = SimpleNamespace(value=begun), str(tmp_path / "w"), supervised
    made.tasks, made.answered, made.since, made.ready, made.share = pool.deque(tasks), 0, 0.0, False, 1
    return made


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(value=0.0)
    monkeypatch.setattr(pool, "time", SimpleNamespace(monotonic=lambda: now.value))
    return now


def test_rows_of_answers_and_how_many_tasks_fit(tmp_path, clock):
    ok = ["ok", "", {"m": 1}]
    w = worker(tmp_path, [[], [ok, ["refused", "no", {}]], [ok]], [task(k) for k in range(5)])
    clock.value = 1.0
    assert w.take() == []
    assert (w.ready, w.since, w.share, w.answered) == (True, 1.0, 1, 0)
    clock.value = 1.01  # 2 rows in 10 ms: 4 in twice as long, but at most twice as many as before
    rows = w.take()
    assert rows[0] == row_of(task(0), "one", "ok", "", {"m": 1.0})
    assert rows[1] == row_of(task(1), "one", "refused", "no", {})
    assert isinstance(rows[0]["metrics"]["m"], float)
    assert (w.share, w.answered, [t.index for t in w.tasks]) == (2, 2, [2, 3, 4])
    clock.value = 5.0
    w.take()
    assert (w.share, w.answered, w.since) == (1, 3, 5.0)
    w = worker(tmp_path, [[ok] * 64], [task(k) for k in range(64)])
    w.share, clock.value = 60, 0.001
    w.take()
    assert w.share == 64
    w = worker(tmp_path, [[ok] * 3], [task(k) for k in range(3)])
    w.share, clock.value = 60, 0.02
    w.take()
    assert w.share == 3


@pytest.mark.parametrize(
    "answer",
    [EOFError(), OSError(), b"{", [1], [["ok", ""]], {"a": 1}, [["ok", "", {"m": "x"}]], [["ok", "", []]],
     [["ok", "", {}]] * 3, b"[" * 100_000, "text"],
)  # fmt: skip
def test_what_is_no_answer_counts_as_the_end_of_a_worker(tmp_path, answer):
    w = worker(tmp_path, [answer], [task(0), task(1)])
    with pytest.raises(EOFError):
        w.take()
    assert len(w.tasks) == 2


def test_tasks_are_timed_from_the_first(tmp_path, clock):
    w = worker(tmp_path)
    clock.value = 3.0
    w.give([])
    assert (w.since, w.pipe.sent) == (0.0, [])
    w.give([task(0)])
    clock.value = 4.0
    w.give([task(1), task(2)])
    assert (w.since, w.pipe.sent) == (3.0, [[0], [1, 2]])
    w.pipe.send = lambda tasks: (_ for _ in ()).throw(BrokenPipeError())
    w.give([task(3)])
    assert [t.index for t in w.tasks] == [0, 1, 2, 3]


@pytest.mark.parametrize(("begun", "answered", "blamed"), [(0, 0, 0), (1, 0, 0), (3, 1, 1), (9, 1, 2), (4, 4, 0)])
def test_the_task_that_was_begun_last_is_blamed(tmp_path, begun, answered, blamed):
    w = worker(tmp_path, tasks=[task(k) for k in range(3)], begun=begun)
    w.answered = answered
    assert w.blamed().index == blamed
    assert [t.index for t in w.tasks] == [k for k in range(3) if k != blamed]


@pytest.mark.parametrize("supervised", [False, True])
def test_a_worker_ends_with_its_folder(tmp_path, supervised):
    w = worker(tmp_path, supervised=supervised)
    (tmp_path / "w").mkdir()
    w.end()
    assert w.pipe.closed
    first = "terminate" if supervised else "kill"
    assert w.process.did == [first, ("join", 10.0 if supervised else None), "kill", ("join", "ever")]
    assert not (tmp_path / "w").exists()


# ---- the pool -------------------------------------------------------------------------------------------------------
@pytest.fixture
def made(tmp_path, monkeypatch, clock):
    """A pool whose workers are given; `ready` says which pipes have something."""

    def make(*workers, n=2, timeout=5.0):
        p = Pool(systems(), "native", n, timeout, 1.0)
        p._workers = list(workers)
        waits = []
        monkeypatch.setattr(
            pool.multiprocessing.connection,
            "wait",
            lambda pipes, timeout: (waits.append((len(pipes), timeout)), [x for x in pipes if x.poll()])[1],
        )
        for w in workers:
            (tmp_path / "w").mkdir(exist_ok=True)
            w.ready = True
        return p, waits

    return make


def test_a_task_over_its_time_is_a_row_and_the_others_return(tmp_path, made, clock):
    w = worker(tmp_path, tasks=[task(0), task(1), task(2)], begun=2)
    p, waits = made(w)
    waiting = _Waiting([], 0)
    clock.value = 5.0
    assert list(p._listen(waiting)) == []
    clock.value = 5.001
    (row,) = p._listen(waiting)
    assert (row["index"], row["status"]) == (1, "timeout")
    assert [t.index for t in waiting.take(5)] == [0, 2]
    assert p._workers == []
    assert waits == [(1, 0.2)] * 2
    assert list(p._listen(waiting)) == []
    assert waits[-1] == (0, 0.0)


def test_a_worker_that_is_not_ready_has_a_minute_more(tmp_path, made, clock):
    w = worker(tmp_path, tasks=[task(0)])
    p, _ = made(w)
    w.ready = False
    clock.value = 65.0
    assert list(p._listen(_Waiting([], 0))) == []
    clock.value = 65.1
    assert [r["status"] for r in p._listen(_Waiting([], 0))] == ["timeout"]


def test_a_task_that_ends_its_worker_twice_is_a_row(tmp_path, made):
    p, _ = made()
    waiting = _Waiting([], 0)
    for rows in (0, 1):
        w = worker(tmp_path, tasks=[task(4), task(5)], begun=1)
        w.ready, w.process.exitcode = True, -9
        p._workers = [w]
        found = list(p._listen(waiting))
        assert len(found) == rows
        assert p._workers == []
    assert found[0]["reason"] == "ended its process twice, with status -9"
    assert (found[0]["status"], found[0]["index"]) == ("killed", 4)
    left = [t.index for t in waiting.take(9)]
    assert sorted(left) == [4, 5, 5]
    assert left[0] == 5


def test_a_worker_that_has_ended_but_left_an_answer_is_heard(tmp_path, made):
    w = worker(tmp_path, [[["ok", "", {}]]], [task(0)])
    w.process.exitcode = 0
    p, _ = made(w)
    assert [r["status"] for r in p._listen(_Waiting([], 0))] == ["ok"]


def test_workers_that_never_begin_end_the_study(tmp_path, made):
    p, _ = made(n=1)
    waiting = _Waiting([], 0)
    p._died = {0}
    for _ in range(2):
        w = worker(tmp_path, [EOFError()], [task(0)])
        p._workers = [w]
        assert [r["status"] for r in p._listen(waiting)] == ["killed"]
    p._workers = [worker(tmp_path, [EOFError()], [task(0)])]
    with pytest.raises(InputError, match=r"exit with status None before they begin; .* if __name__ == '__main__'"):
        list(p._listen(waiting))
    p._unborn, p._workers = 2, [w := worker(tmp_path, [EOFError()], [task(0)])]
    w.ready = True  # it had begun
    assert [r["status"] for r in p._listen(waiting)] == ["killed"]
    assert p._unborn == 0


def test_tasks_go_out_in_shares_and_the_last_ones_singly(tmp_path, made, monkeypatch):
    p, _ = made(n=2)
    given = []

    class Fake:
        def __init__(self, *of):
            self.tasks, self.share, self.number = [], 8, len(p._workers)

        def give(self, tasks):
            given.append((self.number, [t.index for t in tasks]))
            self.tasks = tasks

    def listen(waiting):
        for w in p._workers:
            yield from ({"index": t.index} for t in w.tasks)
            w.tasks = []

    monkeypatch.setattr(pool, "_Worker", Fake)
    monkeypatch.setattr(p, "_listen", listen)
    rows = list(p.run([task(k) for k in range(20)], 20))
    assert sorted(r["index"] for r in rows) == list(range(20))
    sizes = [len(t) for _, t in given]
    assert sizes[:4] == [5, 3, 3, 2]  # a quarter of what is left, for two workers
    assert sizes[-1] == 1
    assert [n for n, _ in given[:4]] == [0, 1, 0, 1]
    assert Pool(systems(), "native", None, 1.0, 1.0)._n == len(os.sched_getaffinity(0))


def test_a_pool_stops_and_ends_its_workers(tmp_path, made):
    w = worker(tmp_path)
    p, _ = made(w)
    with p:
        assert p._workers == [w]  # forks start with their tasks
    assert w.process.did == ["kill", "kill", ("join", None), "kill", ("join", "ever")]

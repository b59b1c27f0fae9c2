"""Runs of a study: their ids, interrupted studies, failed runs that are tried again, the pool of workers."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.scenario import Run, build
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.studies import task
from hystfmu.studies.pool import Pool
from hystfmu.studies.run import is_final, with_limits
from hystfmu.studies.spec import Study
from hystfmu.studies.task import Runner, Task, identity

if sys.platform == "win32":
    pytest.skip("signals and limits of POSIX", allow_module_level=True)

# slow enough to be interrupted
LONG: dict[str, Any] = {"method": "sobol", "n": 48, "engine": "native", "of_scenario": {"step": 1e-5}}
RUN = "import sys; import hystfmu as hy; hy.study(sys.argv[1], sys.argv[2], workers=2)"
SPAWNED = "from hystfmu.studies import pool; pool._forked = lambda systems, run: False; "


_QUIET: list[bytes] = []


@pytest.fixture(params=["forked", pytest.param("spawned", marks=pytest.mark.stress)])
def program(request: pytest.FixtureRequest) -> str:
    """Runs the long study with workers of one kind."""
    return RUN if request.param == "forked" else SPAWNED + RUN


@pytest.fixture
def quiet(write: Any, tmp_path: Path) -> bytes:
    """The table of an uninterrupted run, made once."""
    if not _QUIET:
        _QUIET.append(hy.study(write(**LONG), tmp_path / "quiet", workers=2).table.read_bytes())
    return _QUIET[0]


def start(program: str, path: Path, folder: Path, **more: Any) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.Popen(
        [sys.executable, "-c", program, str(path), str(folder)], env=environment, stderr=subprocess.PIPE, text=True,
        start_new_session=True, **more,
    )  # fmt: skip


def rows(folder: Path) -> int:
    journal = folder / "journal.jsonl"
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def wait_for(folder: Path, n: int, process: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 60
    while rows(folder) < n:
        assert process.poll() is None, process.stderr and process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.005)


def children(pid: int) -> list[int]:
    """Return the worker processes of a parent."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            text = entry.read_text()
            command = (entry.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(text.rsplit(")", 1)[1].split()[1]) == pid and b"resource_tracker" not in command:
            found.append(int(entry.parent.name))
    return found


@pytest.mark.turn("interrupted studies")
@pytest.mark.skipif(not Path("/proc").exists(), reason="needs /proc")
def test_killed_workers(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    folder = tmp_path / "out"
    process = start(program, write(**LONG), folder)
    for n in (5, 25, 50):
        wait_for(folder, n, process)
        os.kill(children(process.pid)[0], signal.SIGKILL)
    assert process.wait(120) == 0, process.stderr and process.stderr.read()
    assert (folder / "results.parquet").read_bytes() == quiet


@pytest.mark.stress
@pytest.mark.skipif(not Path("/proc").exists(), reason="needs /proc")
def test_a_killed_parent(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    folder = tmp_path / "out"
    path = write(**LONG)
    process = start(program, path, folder)
    wait_for(folder, 40, process)
    workers = children(process.pid)
    process.kill()
    process.wait()
    kept = rows(folder)
    end = time.monotonic() + 20
    while any(Path(f"/proc/{w}/cmdline").exists() and Path(f"/proc/{w}/cmdline").read_bytes() for w in workers):
        assert time.monotonic() < end, "workers without a parent must end"
        time.sleep(0.05)
    outcome = hy.study(path, folder, workers=2)
    assert outcome.ran == len(outcome.rows) - kept  # finished runs are not repeated
    assert outcome.table.read_bytes() == quiet


@pytest.mark.stress
def test_a_full_disk(write: Any, tmp_path: Path, program: str, quiet: bytes) -> None:
    """Emulate a full disk by a limit on file sizes, which raises the same error at the same call."""
    import resource

    folder, path = tmp_path / "out", write(**LONG)
    process = start(
        program, path, folder, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
    )
    assert process.wait(120) != 0
    assert process.stderr is not None
    assert "rows are safe: free some space and run the study again" in process.stderr.read().splitlines()[-1]
    kept = rows(folder)
    assert 0 < kept < 96
    outcome = hy.study(path, folder, workers=2)
    assert outcome.ran == len(outcome.rows) - kept
    assert outcome.table.read_bytes() == quiet


@pytest.mark.turn("interrupted studies")
def test_workers_that_cannot_start_end_the_study_with_one_line(write: Any, tmp_path: Path) -> None:
    """A script from standard input has no file for a worker to import."""
    path = write(engine="fmpy")
    script = f"import hystfmu as hy\nhy.study({str(path)!r}, {str(tmp_path / 'out')!r}, workers=1)\n"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable], input=script, env=environment, capture_output=True, text=True, timeout=100, cwd=tmp_path
    )
    assert done.returncode == 1
    assert "before they begin; a script that runs a study must be a file" in done.stderr.splitlines()[-1]


def test_workers_end_with_the_pool(write: Any) -> None:
    study = Study(write())
    with Pool([build(c) for c in study.cases], Run("native", seconds=10.0), 2) as pool:
        assert list(pool.run([], 5)) == []
        assert {w.process.daemon for w in pool._workers} == {True}  # a parent that fails does not wait for them


# ---- again -----------------------------------------------------------------------------------------------------------
forked = pytest.mark.skipif(sys.platform != "linux", reason="only forked workers see another runner")


class Slow(Runner):
    """Task 3 needs 1 s more than the others."""

    def _metrics(self, task: Task) -> dict[str, float]:
        if task.index == 3:
            time.sleep(1.0)
        return super()._metrics(task)


class Large(Runner):
    """Task 3 needs 800 MB more than the others."""

    def _metrics(self, task: Task) -> dict[str, float]:
        if task.index == 3:
            np.empty(100_000_000)  # the limit is on the address space
        return super()._metrics(task)


class Unlucky(Runner):
    """Task 3 fails as long as there is no mark."""

    mark: Path

    def _metrics(self, task: Task) -> dict[str, float]:
        if task.index == 3 and not self.mark.exists():
            raise Stopped("the licence server is busy")
        return super()._metrics(task)


@pytest.mark.some(0.5)
@forked
@pytest.mark.parametrize(
    ("runner", "limit", "low", "high"), [(Slow, "timeout", 0.3, 30.0), (Large, "memory", 0.3, 4.0)]
)
def test_a_run_that_failed_at_a_limit_runs_again_when_it_is_raised(
    runner: type, limit: str, low: float, high: float, write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hystfmu.studies.pool.Runner", runner)
    whole = hy.study(write(), tmp_path / "whole", workers=1).table.read_bytes()
    folder = tmp_path / "out"
    first = hy.study(write(**{limit: low}), folder, workers=1)
    assert [(r["index"], r["status"]) for r in first.failed] == [(3, limit)]
    for again in (low, low / 2):
        repeated = hy.study(write(**{limit: again}), folder, workers=1)
        assert repeated.ran == 0
        assert repeated.table.read_bytes() == first.table.read_bytes()
    other = {"timeout": "memory", "memory": "timeout"}[limit]
    assert hy.study(write(**{limit: low, other: 100.0}), folder, workers=1).ran == 0
    raised = hy.study(write(**{limit: high}), folder, workers=1)
    assert raised.ran == 1
    assert raised.table.read_bytes() == whole
    assert hy.study(write(**{limit: low}), folder, workers=1).ran == 0  # the run that ended stays


@forked
def test_retry_runs_failed_rows_again_and_no_others(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, folder = write(), tmp_path / "out"
    whole = hy.study(path, tmp_path / "whole", workers=1).table.read_bytes()
    Unlucky.mark = tmp_path / "mark"
    monkeypatch.setattr("hystfmu.studies.pool.Runner", Unlucky)

    def facts(*options: str) -> tuple[int, int]:
        done = CliRunner().invoke(main, ["study", str(path), "-o", str(folder), "-j", "1", "--json", *options])
        found = json.loads(done.stdout)
        return found["ran"], found["failed"]

    assert facts() == (24, 1)
    assert facts("--retry", "failed") == (1, 1)
    Unlucky.mark.touch()
    assert facts() == (0, 1)
    assert facts("--retry", "failed") == (1, 0)
    assert facts("--retry", "failed") == (0, 0)
    assert (folder / "results.parquet").read_bytes() == whole


# ---- tasks ----------------------------------------------------------------------------------------------------------
def test_the_id_of_a_run_is_a_hash_of_its_content() -> None:
    content = json.dumps(["mark", {"a": 1.0, "b": 2.0}], sort_keys=True).encode()
    want = hashlib.sha256(content).hexdigest()[:24]
    assert identity("mark", {"b": 2.0, "a": 1.0}) == want  # in any order
    assert len({want, identity("other", {"a": 1.0}), identity("mark", {"b": 2.0, "a": 1.0}, True)}) == 3
    assert Task(0, 0, 0, "", {}, {}).margins is False


def test_the_fingerprint_of_a_case_changes_with_what_its_results_depend_on(write: Any) -> None:
    study = Study(write())
    one, half = (build(c) for c in study.cases)
    assert task.fingerprint(one) == task.fingerprint(build(study.cases[0])) != task.fingerprint(half)
    assert len(task.fingerprint(one)) == 64
    case = one.case
    m = dict(case.metrics)
    m["last"] = m["last"].model_copy(update={"limit": 3.0, "text": "other"})
    assert task.fingerprint(replace(one, case=replace(case, metrics=m))) == task.fingerprint(one)  # only a judgement
    turned = dict(reversed(case.metrics.items()))
    assert task.fingerprint(replace(one, case=replace(case, metrics=turned))) == task.fingerprint(one)
    m["last"] = m["last"].model_copy(update={"signal": "command.d"})
    assert task.fingerprint(replace(one, case=replace(case, metrics=m))) != task.fingerprint(one)


@pytest.mark.parametrize(("status", "limits", "retry", "final"), [
    ("ok", None, True, True), ("timeout", (1.0, 9.0), False, False), ("timeout", (2.0, 1.0), False, True),
    ("timeout", (3.0, 1.0), False, True), ("memory", (9.0, 1.0), False, False), ("memory", (1.0, 4.0), False, True),
    ("killed", (9.0, 1.0), False, False), ("refused", (0.1, 0.1), False, True),
    ("refused", (9.0, 9.0), True, False), ("timeout", None, False, True),
])  # fmt: skip
def test_what_failed_at_a_limit_runs_again_under_a_higher_one(
    status: str, limits: Any, retry: bool, final: bool
) -> None:
    spec: Any = SimpleNamespace(timeout=2.0, memory=4.0)
    row = {"status": status} | (
        {} if limits is None else {"limits": dict(zip(("timeout", "memory"), limits, strict=True))}
    )
    assert is_final(row, spec, retry) is final
    kept = with_limits({"status": status}, spec)
    assert kept == {"status": status} | ({} if status == "ok" else {"limits": {"timeout": 2.0, "memory": 4.0}})


# ---- pool ------------------------------------------------------------------------------------------------------------
N, DEADLY, ONCE, ENDLESS = 400, {111, 112, 299}, {40, 260}, {200}


class Dangerous:
    """A runner of short tasks, some of which kill or hang their process."""

    folder: Path

    def __init__(self, systems: Any, run: Run) -> None:
        self.done = 0

    def __call__(self, task: Task) -> dict[str, Any]:
        mark = self.folder / str(task.index)
        if task.index in DEADLY or (task.index in ONCE and not mark.exists()):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if task.index in ENDLESS:
            time.sleep(60)
        time.sleep(2e-4)
        self.done += 1
        return {"status": "ok", "reason": "", "metrics": {"done": self.done}}

    def close(self) -> None:
        """Nothing to remove."""


@pytest.mark.skipif(sys.platform != "linux", reason="it replaces the runner, which only forked workers see")
def test_every_task_has_one_row_and_the_task_at_fault_is_identified(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Dangerous.folder = tmp_path
    monkeypatch.setattr("hystfmu.studies.pool.Runner", Dangerous)
    systems = [build(c) for c in Study(write()).cases]
    tasks = [Task(k, k, 0, str(k), {}, {}) for k in range(N)]
    with Pool(systems, Run("native", seconds=0.5), 2) as pool:
        rows = list(pool.run(tasks, N))
    assert sorted(row["index"] for row in rows) == list(range(N))
    status = {row["index"]: row["status"] for row in rows}
    assert {k for k, s in status.items() if s == "killed"} == DEADLY
    assert {k for k, s in status.items() if s == "timeout"} == ENDLESS
    assert {status[k] for k in ONCE} == {"ok"}
    assert max(row["metrics"].get("done", 0) for row in rows) > 20  # tasks were sent and reported in groups

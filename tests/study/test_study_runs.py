"""Ids and fingerprints of runs, final failures, samplers; the pool of workers."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from hystfmu.scenario import Run, build
from hystfmu.studies import task
from hystfmu.studies.pool import Pool
from hystfmu.studies.run import is_final, with_limits
from hystfmu.studies.spec import Study
from hystfmu.studies.task import Task, identity


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


@pytest.mark.parametrize(
    ("status", "limits", "retry", "final"),
    [
        ("ok", None, True, True), ("timeout", (1.0, 9.0), False, False), ("timeout", (2.0, 1.0), False, True),
        ("timeout", (3.0, 1.0), False, True), ("memory", (9.0, 1.0), False, False), ("memory", (1.0, 4.0), False, True),
        ("killed", (9.0, 1.0), False, False), ("refused", (0.1, 0.1), False, True),
        ("refused", (9.0, 9.0), True, False), ("timeout", None, False, True),
    ],
)  # fmt: skip
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

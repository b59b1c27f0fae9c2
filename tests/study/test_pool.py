"""Workers with many short tasks: a task that kills or hangs its worker is identified."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from hystfmu.scenario import Run, build
from hystfmu.studies import Study
from hystfmu.studies.pool import Pool
from hystfmu.studies.task import Task

if sys.platform != "linux":
    pytest.skip("the test replaces the runner, which only forked workers see", allow_module_level=True)

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

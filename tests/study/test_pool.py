"""Workers that hold many short tasks: who is to blame when one of them dies or hangs in the middle."""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from hystfmu.scenario import build
from hystfmu.studies import Study
from hystfmu.studies.pool import Pool
from hystfmu.studies.task import Task

if sys.platform != "linux":
    pytest.skip("workers are forks, which see what a test puts in their place", allow_module_level=True)

N, DEADLY, ONCE, ENDLESS = 400, {111, 112, 299}, {40, 260}, {200}


class Dangerous:
    """In the place of a runner: short tasks, some of which kill or hang their process."""

    folder: Path

    def __init__(self, systems: Any, engine: str) -> None:
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
        return {"index": task.index, "status": "ok", "done": self.done}

    def close(self) -> None:
        """Nothing to remove."""


def test_one_row_each_and_the_blame_on_the_right_one(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Dangerous.folder = tmp_path
    monkeypatch.setattr("hystfmu.studies.pool.Runner", Dangerous)
    systems = [build(c) for c in Study(write()).cases]
    tasks = [Task(k, k, 0, str(k), {}, {}) for k in range(N)]
    with Pool(systems, "native", 2, 0.5, 4.0) as pool:
        rows = list(pool.run(tasks, N))
    assert sorted(row["index"] for row in rows) == list(range(N))
    status = {row["index"]: row["status"] for row in rows}
    assert {k for k, s in status.items() if s == "killed"} == DEADLY
    assert {k for k, s in status.items() if s == "timeout"} == ENDLESS
    assert {status[k] for k in ONCE} == {"ok"}
    assert max(row.get("done", 0) for row in rows) > 20  # tasks came in groups, of which most were told at once

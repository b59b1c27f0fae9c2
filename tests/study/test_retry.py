"""Which failures of a study are final: not those at a limit that was raised, and none with --retry failed."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.scenario.outcome.trace import Stopped
from hystfmu.studies.task import Runner, Task

pytest.importorskip("pyarrow")
if sys.platform != "linux":
    pytest.skip("the test replaces the runner, which only forked workers see", allow_module_level=True)


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


@pytest.mark.parametrize(
    ("runner", "limit", "low", "high"), [(Slow, "timeout", 0.3, 30.0), (Large, "memory", 0.3, 4.0)]
)
def test_a_run_that_failed_at_a_limit_runs_again_when_it_is_raised(
    runner: type, limit: str, low: float, high: float, write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hystfmu.studies.pool.Runner", runner)
    monkeypatch.setattr("hystfmu.studies.store.PART_ROWS", 10)  # the limit is also kept in parts
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

"""The score of the last `make mutants`: how many small faults the tests find."""

from pathlib import Path

import pytest
from mutation import summary

WORK = Path(__file__).parents[2] / "build" / "mutants"


@pytest.mark.stress
def test_the_last_mutants_are_killed(capsys: pytest.CaptureFixture[str]) -> None:
    journals = sorted(WORK.glob("seed-*.jsonl"), key=lambda p: p.stat().st_mtime)
    if not journals:
        pytest.skip("no run to report: `make mutants` first")
    rows = summary.rows(journals[-1])
    killed, decided = summary.score(rows)
    with capsys.disabled():
        print(f"\n{journals[-1].stem}\n{summary.table(rows)}\n{summary.survivors(rows)}")
    assert killed >= summary.LEAST * decided

"""`hystfmu reproduce`: what is missing is told before anything runs; the rest runs, and the exit status is 1."""

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from hystfmu.cli import main
from papers.table import Report


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names that were computed, which stubs do in no time."""
    names: list[str] = []

    def stub(name: str) -> object:
        return lambda *_: (names.append(name), Report(name, "stub", (), ()))[1]

    for name in ("dbo_piezo", "boucwen_benchmark", "loops"):
        monkeypatch.setattr(f"papers.{name}.table", stub(name))
    return names


def test_a_folder_without_one_set_runs_the_others(tmp_path: Path, ran: list[str]) -> None:
    done = CliRunner().invoke(main, ["reproduce", "loops", "dbo_piezo", "--data", str(tmp_path), "--json"])
    assert (done.exit_code, ran) == (1, ["loops"])
    (line,) = done.stderr.splitlines()
    assert line == f"skipped dbo_piezo: {tmp_path}: The folder must hold dbo_piezo/Test_Vi_Do_Di.dat or " + (
        "Test_Vi_Do_Di.dat. Got neither."
    )
    assert [r["name"] for r in json.loads(done.stdout)] == ["loops"]


def test_nothing_to_run_is_one_line_and_exit_status_2(tmp_path: Path, ran: list[str]) -> None:
    for names in (["dbo_piezo"], ["boucwen_benchmark"]):
        done = CliRunner().invoke(main, ["reproduce", *names, "--data", str(tmp_path)])
        assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])
    done = CliRunner().invoke(main, ["reproduce", "loops", "no_such_paper"])
    assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])


def test_a_missing_package_is_told_first(ran: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    done = CliRunner().invoke(main, ["reproduce", "boucwen_benchmark", "loops"])
    assert (done.exit_code, ran) == (1, ["boucwen_benchmark"])
    assert done.stderr.startswith("skipped loops: ")
    assert "pip install 'hystfmu[study]'" in done.stderr


def test_a_package_without_papers_says_in_one_line_where_they_are(tmp_path: Path, ran: list[str]) -> None:
    done = CliRunner().invoke(main, ["reproduce", "loops", "--papers", str(tmp_path / "papers")])
    assert (done.exit_code, len(done.stderr.splitlines()), ran) == (2, 1, [])
    assert f"{tmp_path}/papers: The papers must be in a folder scenarios/papers, as in the repository" in done.stderr

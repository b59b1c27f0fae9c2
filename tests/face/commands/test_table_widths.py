"""Tables of every command in a terminal of 80 columns: no line is longer, no word breaks; colours and their absence."""

import contextlib
import os
import random
import re
import shlex
import string
import subprocess
import sys
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.report import terminal
from papers.row import Row
from papers.table import Report

ROOT = Path(__file__).parents[3]
KIND = "prandtl_ishlinskii"
TABLES = {
    "blocks": ["blocks", "blocks zhao_tan", "blocks sliding_mode"],
    "fit": ["fit --models", f"fit a.csv --model {KIND} --set N=5 --train :2000 -o m.toml -v"],
    "predict": ["predict good.model.toml a.csv -o y.csv"],
    "check": ["check good.model.toml b.csv"],
    "export": ["export loop --controller -o c.fmu"],
    "validate": ["validate good.fmu -v"],
    "run": ["run loop --case sine_10 -v", "run loop other --case sine_10 --engine native", "run changed --record"],
    "margins": ["margins loop --case sine_10", "margins loop --case sine_10 --delays"],
    "compare": ["compare before after -o d.html"],
    "study": ["study size.study.toml -o out -j 1"],
    "start": [f"start a.csv --model {KIND} -o mine -v"],
    "reproduce": ["reproduce zhao_tan_2008"],
    "design": ["design integral mine/loop -o mine/integral"],
}
WITHOUT = {"inverse", "ssp", "simulate"}
MINUTES = {"demo"}  # its tables come from `table` and from `hystfmu run`


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Records, a model, scenarios, reports, a study."""
    made = tmp_path_factory.mktemp("tables")
    for seed, name in enumerate("ab"):
        hy.synthetic.piezo(40, 500.0, seed=seed).to_csv(made / f"{name}.csv")
    model = hy.fit(hy.read(made / "a.csv"), KIND, N=5)
    model.save(made / "good.model.toml")
    model.export(made / "good.fmu")
    for name in ("loop", "other"):
        hy.Scenario.load(ROOT / "scenarios" / "pid").save(made / name)
    hy.run(made / "loop", case="sine_10", engine="native", report=made / "before")
    hy.run(made / "loop", case="sine_10", engine="native", set={"pid.Kp": "*0.9"}, report=made / "after")
    changed = hy.Scenario("changed", step=1e-4, stop=0.01).add("source", hy.blocks.Reference(frequency=100.0))
    changed.metric("peak", "peak", "source.r").case("of_a_long_name").save(made / "changed")
    hy.run(made / "changed", record=True)
    changed.case("new").save(made / "changed")
    (made / "size.study.toml").write_text(
        'name = "size"\nscenario = "loop"\ncases = ["sine_10"]\nmethod = "grid"\nengine = "native"\n[parameters]\n'
        '"pid.Kp" = { values = [0.9, 1.0, 1.1] }\n'
    )
    return made


@pytest.fixture
def narrow(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(folder)
    monkeypatch.setattr(terminal, "width", lambda: 80)
    rows = [Row("tracking error of the compensator over all of the records", 1.0, 1.1, 1.2, target=2.0, seeds=5)]
    report = Report("zhao_tan_2008", "a source with a title", tuple(rows), ())
    monkeypatch.setattr("papers.zhao_tan_2008.table", lambda *_: report)
    return folder


def test_every_command_is_here_or_has_no_table() -> None:
    assert {*TABLES, *WITHOUT, *MINUTES} == {*main.commands}


@pytest.mark.parametrize("words", [words for listed in TABLES.values() for words in listed])
def test_no_line_is_longer_than_the_terminal(words: str, narrow: Path) -> None:
    done = CliRunner().invoke(main, shlex.split(words))
    assert done.exit_code in (0, 1), done.output
    assert re.search(r"^-+(  -+)+$", done.stdout, re.M), "a table"
    long = [x for x in done.stdout.splitlines() if len(x) > 80 and "hystfmu " not in x]  # commands may be copied
    assert not long


@pytest.mark.parametrize("seed", range(40))
def test_no_word_of_a_table_breaks(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = random.Random(seed)

    def cell() -> str:
        words = ("".join(drawn.choices(string.ascii_letters + "-/.", k=drawn.randint(1, 20))) for _ in range(99))
        return " ".join(next(words) for _ in range(drawn.choice([0, 1, 1, 2, 9])))

    n = drawn.randint(2, 16)
    head, rows = [cell() for _ in range(n)], [[cell() for _ in range(n)] for _ in range(3)]
    monkeypatch.setattr(terminal, "width", lambda: 80)
    shown = terminal.table(head, rows, keys=drawn.randint(1, 2))
    assert max(map(len, shown.splitlines())) <= 80
    words = [w for row in (head, *rows) for c in row for w in c.split()]
    assert not set(words) - set(shown.split())
    assert all(w in words or set(w) == {"-"} for w in shown.split())


def test_a_table_in_a_pipe_is_not_wrapped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    head, row = ["name", "meaning"], ["a", "some words " * 20]
    assert len(terminal.table(head, [row]).splitlines()) == 3


def at_terminal(words: str, **more: str) -> str:
    """Return what a terminal of 80 columns gets on stdout."""
    pty = pytest.importorskip("pty", reason="this system has no pseudo-terminal")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "hystfmu.cli", *words.split()]
    with subprocess.Popen(command, stdout=theirs, env=os.environ | {"COLUMNS": "80"} | more):
        os.close(theirs)
        shown = b""
        with contextlib.suppress(OSError):  # the end, on Linux
            while part := os.read(ours, 65536):
                shown += part
    os.close(ours)
    return shown.decode().replace("\r\n", "\n")


def test_a_verdict_has_a_colour_in_a_terminal_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    shown = at_terminal("run loop --engine native --case sine_10")
    assert click.style("ok", fg="green") in shown
    assert "\x1b" not in at_terminal("run loop --engine native --case sine_10", NO_COLOR="1")
    assert max(len(x) for x in click.unstyle(shown).splitlines()) <= 80

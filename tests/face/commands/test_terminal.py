"""What a person at a terminal sees: progress, -v and -q, what an interrupt leaves, tables of 80 columns, colours."""

import contextlib
import json
import os
import random
import re
import shlex
import signal
import string
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.identify import METHODS, options
from hystfmu.report import terminal
from papers.table import Report, Row

pty = pytest.importorskip("pty", reason="this system has no pseudo-terminal")
BAR = re.compile(r"\x1b\[\?25l(\w[\w ]*)  \[#*-*\] +(\d+)%")


def words_of(*words: str) -> list[str]:
    return [sys.executable, "-m", "hystfmu.cli", *words]


def at_terminal(
    *words: str, cwd: Path, interrupt: Callable[[str], bool] = lambda shown: False, both: bool = False, **more: str
) -> tuple[int, str, str]:
    """Run a command whose stderr, or both streams, is a terminal; return its status, stdout and what is shown.

    The first time that `interrupt` holds of what it has shown so far, it gets what Ctrl-C sends.
    """
    ours, theirs = pty.openpty()
    shown, sent, end = b"", False, time.monotonic() + 120
    with (cwd / "stdout").open("wb") as out:
        process = subprocess.Popen(
            words_of(*words), cwd=cwd, env=os.environ | more, stdout=theirs if both else out, stderr=theirs,
            stdin=subprocess.DEVNULL, preexec_fn=_hear_interrupts,
        )  # fmt: skip
    os.close(theirs)
    with contextlib.suppress(OSError):  # Linux tells so that the other side is closed
        while (part := os.read(ours, 65536)) and time.monotonic() < end:
            shown += part
            if not sent and interrupt(shown.decode(errors="replace")):
                process.send_signal(signal.SIGINT)
                sent = True
    os.close(ours)
    return process.wait(60), (cwd / "stdout").read_text(), shown.decode(errors="replace")


def _hear_interrupts() -> None:
    """A job that a shell has put behind the prompt ignores SIGINT, and so would its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture
def loop(tmp_path: Path) -> Path:
    """A scenario of a source alone, with a limit that it keeps and one that it breaks, and a study of it."""
    scenario = hy.Scenario("loop", step=1e-4, stop=2.0).add("source", hy.blocks.Reference(frequency=50.0))
    scenario.metric("peak", "peak", "source.r", limit=1.5).metric("lead", "peak", "source.r_lead", limit=0.5)
    scenario.case("small", set={"source.amplitude": 0.25}).case("large").save(tmp_path / "loop")
    (tmp_path / "size.study.toml").write_text(
        'name = "size"\nscenario = "loop"\nmethod = "grid"\n[parameters]\n'
        f'"source.amplitude" = {{ values = {[1 + k / 1000 for k in range(200)]} }}\n'
    )
    return tmp_path


def here(folder: Path, *words: str) -> Result:
    with contextlib.chdir(folder):
        return CliRunner().invoke(main, list(words))


@pytest.mark.turn("a terminal")
def test_progress_is_on_a_terminal_alone_and_not_with_q(loop: Path) -> None:
    command = ["run", "loop", "--case", "large"]
    status, out, err = at_terminal(*command, cwd=loop)
    assert status == 1
    assert {name for name, _ in BAR.findall(err)} == {"running"}
    assert "\x1b" not in out
    assert not BAR.search(out)
    piped = here(loop, *command)
    assert (piped.exit_code, piped.stderr) == (1, "")
    _, out, err = at_terminal(*command, "-q", cwd=loop)
    assert err == ""
    assert "passed" not in out
    assert "exceeds the limit 0.5" in out, "what is wrong is told with -q too"


def test_the_metric_stands_beside_the_verdict(loop: Path) -> None:
    here(loop, "run", "loop", "--record")
    lines = here(loop, "run", "loop").stdout.splitlines()
    assert lines[0].split()[:6] == ["scenario", "case", "verdict", "metric", "value", "limit"]
    small, large = (line.split() for line in lines[2:4])
    assert small[2:6] == ["ok", "lead", "0.25", "0.5"], "half of this limit, a sixth of the other"
    assert large[2:6] == ["FAILED", "lead", "1", "0.5"]
    more = here(loop, "run", "loop", "-v").stdout.splitlines()
    assert sum(line.split()[:2] == ["loop", "large"] for line in more) == 3, "once for the case, once for each metric"


def test_v_and_q_contradict_each_other(loop: Path) -> None:
    done = here(loop, "run", "loop", "-v", "-q")
    assert done.exit_code == 2
    assert done.stderr == "hystfmu: -v prints more and -q less. Got both.\n"


ALONE = [n for n, c in main.commands.items() if n != "blocks" and not isinstance(c, click.Group)]
WITHIN = [f"design {n}" for n in main.commands["design"].commands]  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", [*ALONE, *WITHIN])
def test_every_command_has_an_example_and_both_options(name: str) -> None:
    shown = CliRunner().invoke(main, [*name.split(), "--help"]).stdout
    assert f"Example: hystfmu {name}" in shown
    assert "-v, --verbose" in shown
    assert "-q, --quiet" in shown


@pytest.mark.turn("interrupted studies")
def test_an_interrupted_study_says_how_to_go_on_and_does(loop: Path) -> None:
    command = ["study", "size.study.toml", "-o", "out dir", "-j", "1"]
    begun = re.compile(r"[1-9]\d*/400 runs")
    status, out, err = at_terminal(*command, cwd=loop, interrupt=lambda shown: bool(begun.search(shown)))
    assert (status, out) == (130, "")
    last = err.replace("\r\n", "\r").strip("\r").split("\r")[-1]
    assert last == (
        "hystfmu: interrupted; finished runs are kept; to continue: hystfmu study size.study.toml -o 'out dir' -j 1"
    )
    done = here(loop, *command, "--json")
    told = json.loads(done.stdout)
    assert told["rows"] == 400
    assert 0 < told["ran"] < 400


@pytest.mark.stress
@pytest.mark.parametrize(
    "command", [["start", "piezo.csv", "-o", "mine"], ["demo", "-o", "mine"]], ids=["start", "demo"]
)
def test_an_interrupt_leaves_whole_files_and_a_status_of_its_own(command: list[str], tmp_path: Path) -> None:
    hy.synthetic.piezo(60, 1000.0).to_csv(tmp_path / "piezo.csv")
    status, _, err = at_terminal(*command, cwd=tmp_path, interrupt=lambda shown: bool(BAR.search(shown)))
    assert status == 130
    assert "Traceback" not in err
    assert err.rstrip().endswith(f"finished steps are kept; to continue: hystfmu {' '.join(command)}")
    left = [p for p in (tmp_path / "mine").rglob("*") if p.is_file()] if (tmp_path / "mine").exists() else []
    assert {p.suffix for p in left} <= {".csv"}, "no file of a step that did not end"
    for p in left:
        assert len(hy.read(p).t) > 1000


def test_an_interrupt_of_an_import_has_the_same_status(tmp_path: Path) -> None:
    """Data classes run code made from strings; an interrupt that meets it would be the end of `python -m`."""
    (tmp_path / "numpy.py").write_text('exec("raise KeyboardInterrupt")')
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    words = words_of("blocks", "pid")
    done = subprocess.run(words, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "hystfmu: interrupted; no file is incomplete; to repeat: hystfmu blocks pid\n"


@pytest.mark.stress
def test_an_interrupted_start_goes_on_behind_the_fit(tmp_path: Path) -> None:
    hy.synthetic.piezo(40, 500.0).to_csv(tmp_path / "piezo.csv")
    command = ["start", "piezo.csv", "-o", "mine", "--model", "prandtl_ishlinskii"]
    behind = re.compile(r"tuning|running the loop|margins|report  ")
    status, out, err = at_terminal(*command, cwd=tmp_path, interrupt=lambda shown: bool(behind.search(shown)))
    assert (status, "from the run before" in out) == (130, False)
    assert err.rstrip().endswith(f"finished steps are kept; to continue: hystfmu {' '.join(command)}")
    file = tmp_path / "mine" / "piezo.model.toml"
    before = file.stat().st_mtime_ns
    done = here(tmp_path, *command)
    assert done.exit_code == 0, done.output
    assert "from the run before" in done.stdout
    assert file.stat().st_mtime_ns == before
    assert (tmp_path / "mine" / "report.html").exists()
    refused = here(tmp_path, *command, "--seed", "1")
    assert refused.exit_code == 2
    assert "mine: The folder contains results of another record or of other options" in refused.stderr
    other = here(tmp_path, *command, "--seed", "1", "--force")
    assert "from the run before" not in other.stdout
    assert file.stat().st_mtime_ns > before


@pytest.mark.stress
def test_an_interrupted_demo_goes_on_behind_its_finished_fits(tmp_path: Path) -> None:
    def second(shown: str) -> bool:
        return "fitting prandtl_ishlinskii" in shown or "fitting zhao_tan_mlp" in shown

    status, _, err = at_terminal("demo", "--full", "-o", "mine", cwd=tmp_path, interrupt=second)
    assert status == 130
    assert "fitting actuator" in err
    kept = {p: p.stat().st_mtime_ns for p in (tmp_path / "mine" / "models").iterdir()}
    status, _, err = at_terminal("demo", "--full", "-o", "mine", cwd=tmp_path, interrupt=second)
    assert status == 130
    assert "fitting actuator" not in err
    assert kept.items() <= {p: p.stat().st_mtime_ns for p in (tmp_path / "mine" / "models").iterdir()}.items() != set()


def test_the_kinds_of_model_are_listed_with_every_option() -> None:
    shown = CliRunner().invoke(main, ["fit", "--models"]).stdout
    listed = dict(zip(*[iter(re.split(r"^(\w+): ", shown, flags=re.MULTILINE)[1:])] * 2, strict=True))
    assert tuple(listed) == METHODS
    for key, text in listed.items():
        for o in options(key):
            assert o.text, f"{key}: {o.name} has no text"
            line = next(line for line in text.splitlines()[1:] if line.split()[:1] == [o.name])
            assert o.rule in line
            assert line.endswith(o.text)


@pytest.mark.turn("good FMUs")
def test_validate_says_what_it_tried_when_all_is_well(tmp_path: Path) -> None:
    hy.Model("creep", hy.blocks.Creep().graph).export(tmp_path / "creep.fmu")
    done = here(tmp_path, "validate", "creep.fmu")
    assert done.exit_code == 0
    rows = [re.split(r" {2,}", line) for line in done.stdout.splitlines()]
    tried = {row[0]: row[1:] for row in rows if len(row) == 3}
    assert tried["making 100 steps"] == ["1 instance, 100 values read, 100 values set, 100 steps", "0"]
    checks = len(tried) - 2  # head and rule
    assert checks >= 20
    assert done.stdout.splitlines()[-1] == f"creep.fmu: 0 problems in {checks} checks"


# ---- widths of tables ------------------------------------------------------------------------------------------------
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


@pytest.mark.some(2)
@pytest.mark.parametrize("words", [
    pytest.param(words, marks=[pytest.mark.stress] * (name in ("start", "design")))
    for name, listed in TABLES.items()
    for words in listed
])  # fmt: skip
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


@pytest.mark.turn("a terminal")
def test_a_verdict_has_a_colour_in_a_terminal_alone(folder: Path) -> None:
    words = ["run", "loop", "--engine", "native", "--case", "sine_10"]
    shown, plain = (
        at_terminal(*words, cwd=folder, both=True, COLUMNS="80", **more)[2] for more in ({}, {"NO_COLOR": "1"})
    )
    assert click.style("ok", fg="green") in shown
    assert not re.search(r"\x1b\[\d+m", plain)
    assert max(len(x) for x in click.unstyle(shown).splitlines()) <= 80

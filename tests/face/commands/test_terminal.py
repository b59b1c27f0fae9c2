"""What a person at a terminal sees: progress, -v and -q, and what an interrupt leaves; a pseudo-terminal shows it."""

import contextlib
import json
import os
import re
import signal
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
from hystfmu.report.terminal import Bar, span

pty = pytest.importorskip("pty", reason="this system has no pseudo-terminal")
BAR = re.compile(r"(\w[\w ]*)  \[#*-*\] +(\d+) %")


def words_of(*words: str) -> list[str]:
    return [sys.executable, "-m", "hystfmu.cli", *words]


def at_terminal(*words: str, cwd: Path, interrupt: Callable[[str], bool] = lambda shown: False) -> tuple[int, str, str]:
    """Run a command whose stderr is a terminal; return its status, stdout and stderr.

    The first time that `interrupt` holds of what it has shown so far, it gets what Ctrl-C sends.
    """
    ours, theirs = pty.openpty()
    shown, sent, end = b"", False, time.monotonic() + 120
    with (cwd / "stdout").open("wb") as out:
        process = subprocess.Popen(
            words_of(*words), cwd=cwd, stdout=out, stderr=theirs, stdin=subprocess.DEVNULL, preexec_fn=_hear_interrupts
        )
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
        f'"source.amplitude" = {{ values = {[1 + k / 1000 for k in range(400)]} }}\n'
    )
    return tmp_path


def here(folder: Path, *words: str) -> Result:
    with contextlib.chdir(folder):
        return CliRunner().invoke(main, list(words))


def test_the_bar_shows_part_rate_and_time_left() -> None:
    now = 0.0
    bar = Bar("fitting", lambda: now)
    now = 30.0
    assert bar.line(0.25) == "fitting  [#####---------------]  25 %  30 s, 0.83 %/s, 1 min 30 s left"
    assert bar.line(0.0) == "fitting  [--------------------]   0 %  30 s"
    assert bar.line(0.5, "7/14 runs, 3 runs/s") == (
        "fitting  [##########----------]  50 %  30 s, 7/14 runs, 3 runs/s, 30 s left"
    )
    assert [span(s) for s in (0.4, 59.4, 61, 3599, 7384)] == ["0 s", "59 s", "1 min 01 s", "59 min 59 s", "2 h 03 min"]


def test_progress_is_on_a_terminal_alone_and_not_with_q(loop: Path) -> None:
    status, out, err = at_terminal("run", "loop", cwd=loop)
    assert status == 1
    assert {name for name, _ in BAR.findall(err)} == {"running"}
    assert "\x1b" not in out
    assert not BAR.search(out)
    piped = subprocess.run(words_of("run", "loop"), cwd=loop, capture_output=True, text=True, timeout=60)
    assert (piped.returncode, piped.stderr) == (1, "")
    _, out, err = at_terminal("run", "loop", "-q", cwd=loop)
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


def test_an_interrupted_study_says_how_to_go_on_and_does(loop: Path) -> None:
    command = ["study", "size.study.toml", "-o", "out dir", "-j", "1"]
    begun = re.compile(r"[1-9]\d*/800 runs")
    status, out, err = at_terminal(*command, cwd=loop, interrupt=lambda shown: bool(begun.search(shown)))
    assert (status, out) == (130, "")
    last = err.replace("\r\n", "\r").strip("\r").split("\r")[-1]
    assert last == (
        "hystfmu: interrupted; finished runs are kept; to go on with the others: "
        "hystfmu study size.study.toml -o 'out dir' -j 1"
    )
    done = here(loop, *command, "--json")
    told = json.loads(done.stdout)
    assert told["rows"] == 800
    assert 0 < told["ran"] < 800


@pytest.mark.parametrize(
    "command", [["start", "piezo.csv", "-o", "mine"], ["demo", "-o", "mine"]], ids=["start", "demo"]
)
def test_an_interrupt_leaves_whole_files_and_a_status_of_its_own(command: list[str], tmp_path: Path) -> None:
    hy.synthetic.piezo(60, 1000.0).to_csv(tmp_path / "piezo.csv")
    status, _, err = at_terminal(*command, cwd=tmp_path, interrupt=lambda shown: bool(BAR.search(shown)))
    assert status == 130
    assert "Traceback" not in err
    assert err.rstrip().endswith(f"finished steps are kept; to go on with the others: hystfmu {' '.join(command)}")
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
    assert done.stderr == "hystfmu: interrupted; files are whole or as they were; again: hystfmu blocks pid\n"


def test_an_interrupted_start_goes_on_behind_the_fit(tmp_path: Path) -> None:
    hy.synthetic.piezo(40, 500.0).to_csv(tmp_path / "piezo.csv")
    command = ["start", "piezo.csv", "-o", "mine", "--model", "prandtl_ishlinskii"]
    behind = re.compile(r"tuning|running the loop|margins|report  ")
    status, out, err = at_terminal(*command, cwd=tmp_path, interrupt=lambda shown: bool(behind.search(shown)))
    assert (status, "from the run before" in out) == (130, False)
    assert err.rstrip().endswith(f"finished steps are kept; to go on with the others: hystfmu {' '.join(command)}")
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
            line = next(line for line in text.splitlines() if line.split()[:1] == [o.name])
            assert o.rule in line
            assert line.endswith(o.text)


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

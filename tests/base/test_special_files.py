"""Devices and pipes in place of files: every reader and writer refuses them in one line, reads no byte, never waits."""

import os
import signal
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from bad_fmu import bad_fmu
from click.testing import CliRunner
from invoked import invoked

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.scenario import Cases, build, simulate
from hystfmu.scenario.outcome.trace import Stopped

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and devices of POSIX")
READERS = [
    *("fit IN.csv -o m.model.toml", "fit IN.csv.gz -o m.model.toml", "fit IN.mat -o m.model.toml", "fit IN.h5"),
    *("predict IN.model.toml data.csv -o y.csv", "predict good.model.toml IN.csv -o y.csv", "start IN.csv"),
    *("check IN.model.toml data.csv", "check good.model.toml IN.csv", "inverse IN.model.toml -o i.model.toml"),
    *("export IN.model.toml -o x.fmu", "validate IN.fmu"),
    *("run IN.toml", "simulate IN.ssp", "run of_file", "run good --set @IN.json", "run with_model", "run with_fmu"),
    *("run extended", "run with_baseline", "run with_rows", "margins IN.toml", "ssp IN.toml -o x.ssp"),
    *("compare IN.json IN.json -o x.html", "study IN.study.toml -o out", "study good.study.toml -o of_pipe"),
    "study good.study.toml -o of_columns",
]
WRITERS = [
    *("fit data.csv --model play_gain -o OUT", "predict good.model.toml data.csv -o OUT"),
    *("export good.model.toml -o OUT", "run good -o OUT", "ssp good -o OUT"),
    *("compare good/report.json good/report.json -o OUT", "inverse good.model.toml -o OUT"),
]
REFUSED = ("a device, pipe or socket", "must stay within the folder of the scenarios")  # a link leads to the device
PEAK = {"peak": {"kind": "peak", "signal": "m.y"}}
GOOD: dict[str, Any] = {
    "name": "good", "step": 1e-3, "stop": 0.01, "order": ["command"], "units": {"command": {"block": "disturbance"}},
    "metrics": {"peak": {"kind": "peak", "signal": "command.d", "limit": 9.0}},
}  # fmt: skip


@pytest.fixture(autouse=True)
def no_wait() -> Iterator[None]:
    """A reader that waits for a pipe, or reads a device without end, is ended by an alarm: a failure."""

    def fail(number: int, frame: Any) -> None:
        raise TimeoutError("waits or reads without end")

    before = signal.signal(signal.SIGALRM, fail)
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


def special(path: Path, kind: str) -> None:
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with good files of every kind."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    Path("data.csv").write_text("\n".join(["t,u,y", *(f"{k * 0.1:.1f},{k % 7},{k % 5}" for k in range(40))]))
    hy.Model("creep", hy.blocks.Creep().graph).save("good.model.toml")
    changes: dict[str, dict[str, Any]] = {
        "good": {},
        "of_file": {},
        "with_model": {"order": ["m"], "units": {"m": {"model": "IN.model.toml"}}, "metrics": PEAK},
        "with_fmu": {"order": ["f"], "units": {"f": {"fmu": "IN.fmu"}}, "metrics": PEAK},
        "with_baseline": {},
        "with_rows": {},
    }
    for name, change in changes.items():
        Path(name).mkdir()
        Path(name, "scenario.toml").write_text(tomli_w.dumps(GOOD | change))
    Path("extended").mkdir()
    Path("extended", "scenario.toml").write_text(tomli_w.dumps({"extends": "IN.toml", "name": "extended"}))
    study = {"name": "s", "scenario": "good", "method": "grid", "parameters": {"command.step": {"values": [1.0]}}}
    Path("good.study.toml").write_text(tomli_w.dumps(study))
    return tmp_path


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("command", READERS)
def test_a_reader(command: str, kind: str, folder: Path) -> None:
    for suffix in ("csv", "csv.gz", "mat", "h5", "model.toml", "toml", "study.toml", "fmu", "ssp", "json"):
        special(Path(f"IN.{suffix}"), kind)
    if "study good" in command:
        Path("of_pipe").mkdir()
        special(Path("of_pipe", "journal.jsonl"), kind)
        Path("of_columns").mkdir()
        special(Path("of_columns", "columns.json"), kind)
    for name in ("with_model/IN.model.toml", "with_fmu/IN.fmu", "extended/IN.toml", "with_baseline/baseline.toml"):
        special(Path(name), kind)
    if "with_rows" in command:
        CliRunner().invoke(main, ["run", "with_rows", "--record", "--yes"])
        Path("with_rows/baseline.csv").unlink(missing_ok=True)
        special(Path("with_rows/baseline.csv"), kind)
    if "of_file" in command:
        Path("of_file/scenario.toml").unlink()
        special(Path("of_file/scenario.toml"), kind)
    done = invoked(command.split(), status=2)
    (line,) = done.stderr.splitlines()
    assert any(why in line for why in REFUSED)


@pytest.mark.parametrize("kind", ["pipe", "device", "read-only", "missing folder"])
@pytest.mark.parametrize("command", WRITERS)
def test_a_writer(command: str, kind: str, folder: Path) -> None:
    out = folder / ("x.fmu" if "export" in command else "x.ssp" if "ssp" in command else "x.model.toml")
    if kind == "missing folder":
        out = folder / "missing" / out.name
    elif kind == "read-only":
        out.write_text("kept")
        out.chmod(0o444)
    elif kind == "pipe":
        os.mkfifo(out)
    else:
        out.symlink_to("/dev/null")
    before = os.lstat(out) if out.parent.exists() else None
    done = invoked(command.replace("OUT", str(out)).split(), status=2)
    (line,) = done.stderr.splitlines()
    assert f"{out}: cannot be written: " in line
    if before is None:
        assert not out.parent.exists()
    else:
        after = os.lstat(out)
        assert (after.st_ino, after.st_mode, after.st_size) == (before.st_ino, before.st_mode, before.st_size)


def test_run_makes_the_folder_of_a_file_for_a_server(folder: Path) -> None:
    out = folder / "new" / "junit.xml"
    assert CliRunner().invoke(main, ["run", "good", "--junit", str(out)]).exit_code == 0
    assert out.read_text().startswith("<?xml")


def test_a_new_file_follows_the_umask_and_a_link_stays(folder: Path) -> None:
    """By commands that write through different modules."""
    (folder / "there").mkdir()
    before = os.umask(0o027)
    try:
        invoked(["run", "good", "--record", "--yes"])
        for command, name in (("export good.model.toml -o", "x.fmu"), ("ssp good -o", "x.ssp"), ("run good -o", "x")):
            link, file = folder / name, folder / "there" / name
            link.symlink_to(file)
            invoked([*command.split(), str(link)])
            assert link.is_symlink()
            assert stat.S_IMODE(file.stat().st_mode) == 0o640
    finally:
        os.umask(before)
    assert sorted(os.listdir(folder / "there")) == ["x", "x.fmu", "x.ssp"]  # no temporary file


@pytest.mark.turn("foreign code")
@pytest.mark.parametrize("kind", [
    "mkfifo(FILE, 0600)",
    pytest.param('symlink("/dev/zero", FILE)', marks=pytest.mark.stress),
    pytest.param('symlink("/etc/passwd", FILE)', marks=pytest.mark.stress),
])  # fmt: skip
def test_results_that_a_foreign_fmu_replaced_are_not_waited_for(
    kind: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It runs once more when its process ends, after the results are written."""
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)
    extra = "#include <sys/stat.h>\n__attribute__((destructor)) static void replace(void) {\n"
    for name in ("ended.json", "result0.json"):
        extra += f'  if (!unlink("{name}") && {kind.replace("FILE", f"{name!r}").replace(chr(39), chr(34))}) return;\n'
    bad_fmu(folder / "bad.fmu", "", 0.5, extra + "}\n", "-Wl,-z,nodelete")
    scenario = GOOD | {
        "order": ["command", "bad"],
        "units": {"command": {"block": "disturbance"}, "bad": {"fmu": "bad.fmu"}},
        "connections": {"bad.u": "command.d"},
    }
    Path("scenario.toml").write_text(tomli_w.dumps(scenario))
    with pytest.raises(Stopped, match="the process that ran bad ended with status 0"):
        simulate(build(Cases(folder).cases[0]))
    assert [p.partition(":")[0] for p in hy.validate(folder / "bad.fmu")] == ["the check failed"]
    alone = CliRunner().invoke(main, ["simulate", "bad.fmu", "--step", "1e-3", "--stop", "0.01", "-o", "alone.csv"])
    assert "the process that ran the FMU ended with status 0" in alone.output


def test_a_journal_of_a_study_that_is_a_pipe(folder: Path) -> None:
    from hystfmu.studies.store import Store

    pytest.importorskip("pyarrow")
    (folder / "out").mkdir()
    os.mkfifo(folder / "out" / "journal.jsonl")
    with pytest.raises(InputError, match="a device, pipe or socket"):
        Store(folder / "out", ["a"], ["m"])

"""Foreign FMUs have no network, write into their own folder only and read no files of the user."""

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from bad_fmu import LOOP, bad_fmu
from click.testing import CliRunner
from users import User

import hystfmu as hy
from hystfmu.base import child
from hystfmu.base.child import Child
from hystfmu.base.confine import Box, call, unconfined
from hystfmu.cli import main
from hystfmu.scenario import Cases, Run, build, simulate

if unconfined():
    pytest.skip(f"foreign FMUs may {unconfined()} here: needs Landlock and seccomp", allow_module_level=True)

ATTEMPTS = Path(__file__).with_name("confined_attempts.c").read_text()
ALL, OWN = 1023, 128 + 256 + 512
LIMITED = LOOP | {"metrics": {"last": {"kind": "final", "signal": "bad.y", "limit": 0.5}}}
STUDY = {"name": "bad", "scenario": "loop", "method": "grid", "parameters": {"command.step": {"values": [0.0, 1.0]}}}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The home folder of a user, who has a secret."""
    folder = tmp_path / "home"
    folder.mkdir()
    (folder / "secret").write_text("secret")
    (folder / "moved").touch()
    monkeypatch.setenv("HOME", str(folder))
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # where the unconfined FMU finds a temporary folder
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as s:
        s.setblocking(False)
        yield s


def called(server: socket.socket) -> bool:
    """Whether a connection waits."""
    try:
        server.accept()[0].close()
    except BlockingIOError:
        return False
    return True


def fmu(folder: Path, home: Path, server: socket.socket) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "scenario.toml").write_text(tomli_w.dumps(LIMITED))
    defined = f'-DHOME="{home}"', f"-DPORT={server.getsockname()[1]}"
    bad_fmu(folder / "bad.fmu", "{ attempts(); y = did; return fmi2OK; }", -1.0, ATTEMPTS, *defined)
    return folder


def done(home: Path, server: socket.socket) -> set[str]:
    """What can be seen of the attempts."""
    seen = {name for name in ("stolen", "by_another", "away") if (home / name).exists()}
    seen |= set() if (home / "secret").read_text() == "secret" else {"truncated"}
    return seen | ({"connected"} if called(server) else set())


ALONE = "simulate loop/bad.fmu --step 1e-3 --stop 0.01 -o alone.csv"
EVERYTHING = {"stolen", "by_another", "away", "truncated", "connected"}


@pytest.mark.some(1)
@pytest.mark.parametrize(
    ("engine", "confined"),
    [("fmpy", True), ("native", True), ("fmpy", False), pytest.param("native", False, marks=pytest.mark.stress)],
)
def test_a_run(engine: Any, confined: bool, tmp_path: Path, home: Path, server: socket.socket) -> None:
    system = build(Cases(fmu(tmp_path / "loop", home, server)).cases[0])
    assert simulate(system, run=Run(engine, confined=confined))["bad.y"][-1] == (OWN if confined else ALL)
    assert done(home, server) == (set() if confined else EVERYTHING)


@pytest.mark.turn("foreign code")
@pytest.mark.some(1)
@pytest.mark.parametrize("options", [[], ["--unconfined"]], ids=["confined", "unconfined"])
@pytest.mark.parametrize("command", ["run loop", ALONE, "study bad.study.toml -o out -j 1", "validate loop/bad.fmu"])
def test_commands(
    command: str, options: list[str], tmp_path: Path, home: Path, server: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)
    monkeypatch.chdir(fmu(tmp_path / "loop", home, server).parent)
    Path("bad.study.toml").write_text(tomli_w.dumps(STUDY))
    if command.startswith("study"):
        pytest.importorskip("pyarrow")
    told = CliRunner().invoke(main, [*command.split(), *options])
    assert told.exit_code in (0, 1), told.output
    assert done(home, server) == (EVERYTHING if options else set()), told.output


@pytest.mark.turn("good FMUs")
def test_our_fmus_run_as_before(tmp_path: Path, home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)  # it runs nothing
    model = hy.Model("creep", hy.blocks.Creep().graph)
    assert hy.validate(model.export(tmp_path / "creep.fmu", 3)) == []


def test_confined_code_has_no_capability(tmp_path: Path) -> None:
    """Programs that it starts get none either: the bounding set is empty if this system permits that."""
    code = "print(*(line for line in open('/proc/self/status') if line.startswith('Cap')), sep='')"
    (free, _), (held, _) = (Child("-c", code, box=box).finish(60.0) for box in (None, Box.of(tmp_path)))
    may = len(free) == 5 and int(free[2].split()[1], 16) >> 8 & 1  # CAP_SETPCAP in the effective set
    names = ["CapInh", "CapPrm", "CapEff", *["CapBnd"] * may, "CapAmb"]
    assert {f"{name}:\t{0:016x}" for name in names} <= set(held)


def test_what_a_system_cannot_keep_from_is_told_once(
    tmp_path: Path, home: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(child, "_TOLD", set())
    monkeypatch.setattr(child, "unconfined", lambda: "use the network")
    for _ in range(2):
        assert Child("-c", "print(1)", box=Box.of(tmp_path)).finish(60.0) == (["1"], True)
    told = "hystfmu: foreign FMUs are not confined on this system: they may use the network\n"
    assert capfd.readouterr().err == told


def test_a_system_without_either_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hystfmu.base.confine.sys.platform", "darwin")
    assert unconfined() == "read and write your files and use the network and act on your other processes"


def test_an_old_landlock_says_what_it_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    for version, may in ((1, "truncate your files"), (2, "truncate your files"), (3, ""), (9, "")):
        monkeypatch.setattr("hystfmu.base.confine._landlock", lambda v=version: v)
        assert unconfined() == may


def test_a_box_that_cannot_be_entered_runs_nothing(tmp_path: Path) -> None:
    made = Child("-c", "print(1)", box=Box.of(tmp_path / "missing"))
    lines, _ = made.finish(60.0)
    assert made.status == 125
    assert lines == [f"this process cannot be confined: [Errno 2] No such file or directory: '{tmp_path / 'missing'}'"]
    assert os.listdir(tmp_path) == []
    with pytest.raises(FileNotFoundError):
        call("chdir", b"/no folder")


SPEAKS = r"""
#include <string.h>
#include <sys/stat.h>
static void speak(void) {
  static const char words[] = WORDS;
  unsigned n = sizeof words - 1;
  for (int file = 3; file < 64; file++) {
    struct stat found;
    if (fstat(file, &found) || !S_ISSOCK(found.st_mode)) continue;
    unsigned char head[4] = {n >> 24, n >> 16, n >> 8, n};
    if (write(file, head, 4) == 4 && write(file, words, n) < 0) return;
  }
}
"""
PICKLED = "cos\\nsystem\\n(S'touch stolen'\\ntR."


@pytest.mark.turn("foreign code")
@pytest.mark.some(1)
@pytest.mark.parametrize(
    "words",
    [PICKLED, '[[1, 2, {}], [\\"ok\\", \\"\\", {}], 3]', '[[\\"ok\\", \\"\\", {\\"last\\": []}]]', "{}"],
    ids=["pickled", "more rows than tasks", "no number", "no list"],
)
def test_what_a_worker_with_foreign_code_sends_is_not_believed(words: str, tmp_path: Path, home: Path) -> None:
    """The FMU answers in place of its worker: its run is a failed one, and the parent runs no code of it."""
    pytest.importorskip("pyarrow")

    (tmp_path / "loop").mkdir()
    (tmp_path / "loop" / "scenario.toml").write_text(tomli_w.dumps(LIMITED))
    bad_fmu(tmp_path / "loop" / "bad.fmu", "speak()", 0.5, SPEAKS.replace("WORDS", f'"{words}"'))
    (tmp_path / "bad.study.toml").write_text(tomli_w.dumps(STUDY))
    outcome = hy.study(tmp_path / "bad.study.toml", tmp_path / "out", workers=1)
    assert not (home / "stolen").exists()
    assert [row["status"] for row in outcome.rows] == ["ok", "killed"]


# ---- What foreign FMUs rightly do works in confinement: threads, files of their own, processes, a Python inside
WORK = Path(__file__).with_name("confined_work.c").read_text()


@pytest.mark.turn("foreign code")
@pytest.mark.parametrize("name", [pytest.param("root", marks=pytest.mark.stress), "user"])
def test_an_fmu_works(name: str) -> None:
    with closing(User(name)) as user:
        works(user)


def works(user: User) -> None:
    defect = "{ static int n; if (!n++) all(); y = did; return fmi2OK; }"
    bad_fmu(user.folder / "x.fmu", defect, -1.0, WORK, "-pthread", "-D_GNU_SOURCE")
    user.give(user.folder)
    words = ["simulate", "x.fmu", "--step", "1e-3", "--stop", "0.01", "-o", "out.csv"]
    told = user.python("-c", "from hystfmu.cli import main; main()", *words, HYSTFMU_CACHE=str(user.folder / "cache"))
    assert told.returncode == 0, told.stdout + told.stderr
    lines = Path(user.folder / "out.csv").read_text().split()
    assert float(lines[-1].split(",")[-1]) == 63

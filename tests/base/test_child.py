"""Child processes end with all that they have started, whatever that does to stay."""

import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from bad_fmu import SLEEPS, bad_fmu

import hystfmu as hy
from hystfmu.base.child import MOST_LOG, Child
from hystfmu.scenario import Cases, Run, build, simulate
from hystfmu.scenario.outcome.trace import Stopped

if sys.platform != "linux":
    pytest.skip("a sub-reaper of Linux", allow_module_level=True)

# leaves a process in a session of its own, whose parent is gone, with the output of its maker open
LEAVES = r"""
#include <sys/prctl.h>
static void leave(void) {
  if (fork()) return;
  setsid();
  if (fork()) _exit(0);
  prctl(15, NAME); // its name
  for (;;) sleep(1);
}
"""
PYTHON = """
import ctypes, os, sys, time
def leave():
    if os.fork(): return
    os.setsid()
    if os.fork(): os._exit(0)
    ctypes.CDLL(None).prctl(15, NAME, 0, 0, 0)
    while True: time.sleep(1)
"""
CHILDS = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
LOOP: dict[str, Any] = {
    "name": "bad",
    "step": 1e-3,
    "stop": 0.01,
    "order": ["command", "bad"],
    "units": {
        "command": {"block": "disturbance", "values": {"step": 1.0, "amplitude": 0.0}},
        "bad": {"fmu": "bad.fmu"},
    },
    "connections": {"bad.u": "command.d"},
    "metrics": {"last": {"kind": "final", "signal": "bad.y"}},
}


@pytest.fixture
def name() -> str:
    """Of the process that is left: at most 15 letters."""
    return f"left {os.getpid()} {time.monotonic_ns() % 1000}"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HYSTFMU_CACHE", str(tmp_path / "cache"))


def left(name: str) -> list[int]:
    """Processes of this name."""
    found = []
    for comm in Path("/proc").glob("[0-9]*/comm"):
        try:
            if comm.read_text().strip() == name:
                found.append(int(comm.parent.name))
        except OSError:
            continue
    return found


def scenario(folder: Path, name: str, defect: str) -> Path:
    import tomli_w

    folder.mkdir(exist_ok=True)
    (folder / "scenario.toml").write_text(tomli_w.dumps(LOOP))
    bad_fmu(folder / "bad.fmu", defect, extra=LEAVES.replace("NAME", f'"{name}"'))
    return folder


ONCE = "{ static int n; if (!n++) leave(); }"


@pytest.mark.turn("processes left behind")
@pytest.mark.some(1)
@pytest.mark.parametrize("engine", ["fmpy", "native"])
def test_a_run_that_ends_well_is_no_failure_when_its_fmu_leaves_a_process(
    engine: Any, tmp_path: Path, name: str
) -> None:
    system = build(Cases(scenario(tmp_path / "loop", name, ONCE)).cases[0])
    assert simulate(system, run=Run(engine, seconds=60.0))["bad.y"][-1] == 1.0
    assert left(name) == []


@pytest.mark.turn("processes left behind")
def test_the_time_limit_holds_when_a_process_keeps_the_output(tmp_path: Path, name: str) -> None:
    system = build(Cases(scenario(tmp_path / "loop", name, f"{{ {ONCE} {SLEEPS}; }}")).cases[0])
    with pytest.raises(Stopped, match="not finished after 4 s"):
        simulate(system, run=Run(seconds=4.0))
    assert left(name) == []


@pytest.mark.turn("processes left behind")
@pytest.mark.usefixtures("without_fmutool")
def test_a_check_ends_what_the_fmu_has_started(tmp_path: Path, name: str) -> None:
    extra = LEAVES.replace("NAME", f'"{name}"') + "__attribute__((constructor)) static void at_load(void) { leave(); }"
    bad_fmu(tmp_path / "bad.fmu", extra=extra)
    assert "did not finish" not in "".join(hy.validate(tmp_path / "bad.fmu"))
    assert left(name) == []


@pytest.fixture
def without_fmutool(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)


@pytest.mark.turn("processes left behind")
def test_a_worker_that_dies_is_seen_although_its_pipe_is_held(tmp_path: Path, name: str) -> None:
    """A dead worker is a killed run, not one that exceeds its time."""
    pytest.importorskip("pyarrow")
    scenario(tmp_path / "loop", name, f"{{ {ONCE} abort(); }}")
    study = tmp_path / "bad.study.toml"
    lines = ['name = "bad"', 'scenario = "loop"', 'method = "grid"', "timeout = 100.0", "[parameters]"]
    study.write_text("\n".join([*lines, '"command.step" = { values = [0.25, 1.0] }']))
    outcome = hy.study(study, tmp_path / "out", workers=1)
    assert [row["status"] for row in outcome.rows] == ["ok", "killed"]
    assert left(name) == []


def child(code: str, name: str, **more: Any) -> Child:
    return Child("-c", PYTHON.replace("NAME", repr(name.encode())) + code, **more)


@pytest.mark.some(1)
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSEGV, signal.SIGTERM])
def test_the_status_is_that_of_the_child(number: int, name: str) -> None:
    made = child(f"leave(); os.kill(os.getpid(), {int(number)})", name)
    assert made.finish(60.0)[1]
    assert made.status == -number
    assert left(name) == []
    made = child("leave(); print('last'); sys.exit(7)", name)
    assert made.finish(60.0) == (["last"], True)
    assert made.status == 7
    assert left(name) == []


def test_generations_of_processes_that_make_others_end(name: str) -> None:
    """Each starts the next in a new session and waits: the time limit ends them all."""
    code = "for k in range(12):\n    leave()\n    if os.fork(): time.sleep(600)\n    os.setsid()\ntime.sleep(600)"
    made = child(code, name)
    while len(left(name)) < 6:
        time.sleep(0.01)
    assert not made.finish(0.1)[1]
    assert (left(name), made.ending) == ([], "ended with status 1")


def test_all_end_with_a_killed_parent(name: str) -> None:
    code = PYTHON.replace("NAME", repr(name.encode())) + "leave(); time.sleep(600)"
    program = f"from hystfmu.base.child import Child; Child('-c', {code!r}).finish(600.0)"
    with subprocess.Popen([sys.executable, "-c", program], env=CHILDS) as parent:
        while not left(name):
            time.sleep(0.01)
        parent.kill()
    while left(name):  # ends only when they do
        time.sleep(0.01)


def test_the_child_ends_with_a_killed_supervisor(name: str) -> None:
    made = Child("-c", f"import ctypes, time; ctypes.CDLL(None).prctl(15, {name.encode()!r}); time.sleep(600)")
    while not left(name):
        time.sleep(0.01)
    os.kill(made._process.pid, signal.SIGKILL)
    while left(name):  # ends only when it does
        time.sleep(0.01)
    assert made.finish(60.0) == ([], True)


@pytest.mark.parametrize(("parent", "python", "told"), [
    ("os.getppid()", "/no python", (125, "this process cannot run /no python: No such file or directory\n", "")),
    ("0", sys.executable, (1, "", "")),  # the parent has ended
])  # fmt: skip
def test_a_supervisor_without_python_or_parent_runs_nothing(parent: str, python: str, told: Any) -> None:
    code = f"import os, sys; sys.executable = {python!r}; sys.argv = ['', str({parent}), 'null', '-c', 'print(1)']\n"
    code += "from hystfmu.base.supervisor import main; main()"
    done = subprocess.run([sys.executable, "-c", code], env=CHILDS, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == told


def test_other_systems_end_the_group_of_the_child_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pipe ends with the last process that has it."""
    monkeypatch.setattr(sys, "platform", "darwin")
    code = "import os, signal, sys, time\nsignal.signal(signal.SIGTERM, lambda *_: print('asked', flush=True))\n"
    code += "if not os.fork(): time.sleep(600)\nos.write(int(sys.argv[1]), b'1')\ntime.sleep(float(sys.argv[2]))"
    for sleeps, limit in ((0, 60.0), (600, 0.1)):
        reads, writes = os.pipe()
        made = Child("-c", code, str(writes), str(sleeps), keep=[writes])
        os.close(writes)
        assert os.read(reads, 1) == b"1"
        assert made.finish(limit) == ([], sleeps == 0)
        assert select.select([reads], [], [], 10.0)[0] == [reads]
        assert (os.read(reads, 1), made.status) == (b"", 0 if sleeps == 0 else -signal.SIGKILL)
        os.close(reads)


@pytest.mark.turn("processes left behind")
def test_all_end_with_a_killed_study(tmp_path: Path, name: str) -> None:
    """Its workers, the endless FMU in one of them, and the processes of that FMU."""
    pytest.importorskip("pyarrow")
    scenario(tmp_path / "loop", name, f"{{ {ONCE} prctl(15, NAME); {SLEEPS}; }}".replace("NAME", f'"{name}"'))
    study = tmp_path / "bad.study.toml"
    lines = ['name = "bad"', 'scenario = "loop"', 'method = "grid"', "[parameters]"]
    study.write_text("\n".join([*lines, '"command.step" = { values = [1.0, 2.0, 3.0] }']))
    program = "import sys; import hystfmu as hy; hy.study(sys.argv[1], sys.argv[2], workers=2)"
    words = [sys.executable, "-c", program, str(study), str(tmp_path / "out")]
    with subprocess.Popen(words, env=CHILDS) as parent:
        while len(left(name)) < 4:  # two workers and one left by each
            assert parent.poll() is None
            time.sleep(0.01)
        parent.kill()
    while left(name):  # ends only when they do
        time.sleep(0.01)


def test_a_line_that_is_being_written_is_dropped_whole(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hystfmu.base.child._MOST_OUTPUT", 0)
    monkeypatch.setattr("hystfmu.base.child._LOOK", 0.02)
    made = child("os.write(1, b'whole\\npart'); time.sleep(1.0); os.write(1, b'of a line\\nlast\\n')", name)
    lines, in_time = made.finish(100.0)
    assert in_time
    assert lines == ["whole", "of a line", "last"]


def test_output_is_kept_from_its_end_and_bounded_on_the_disk(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hystfmu.base.child._MOST_OUTPUT", 1 << 20)
    monkeypatch.setattr("hystfmu.base.child._LOOK", 0.02)
    code = "for k in range(3000):\n    print(f'{k:01000d}', flush=True)\nprint('last')"
    made = child(code, name)
    lines, in_time = made.finish(100.0)
    assert in_time
    assert lines[-1] == "last"
    assert sum(map(len, lines)) <= MOST_LOG
    made = child("while True: print('x' * 1000, flush=True)", name)
    lines, in_time = made.finish(1.0)
    assert not in_time
    assert set("".join(lines)) == {"x"}  # a line may be short: its start was dropped while it was written

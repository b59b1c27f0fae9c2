"""Effects that the binary of an FMU must not have on its process.

A step makes no allocation and no system call and is not refused for rounding of the time.  Memory does not grow.  The
floating-point environment and the locale stay unchanged.  Threads, instances and FMUs share nothing.
"""

import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from embedded import graphs
from targets import CORE, CORE_SOURCES, FMI_SOURCES, MEANING, Target, fmi_headers, run

import hystfmu
from hystfmu.graph.graph import sample_time

HERE = Path(__file__).parent
BINARY = Path(hystfmu.__file__).with_name("_fmu.so")
FLAGS = [*MEANING, "-std=gnu99", "-Wall", "-Wextra", "-Werror", f"-I{CORE.parent}", f"-isystem{fmi_headers()}"]
GCC = Target("gcc", ["gcc", "-O2"])
Build = Callable[[str], Path]

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="inspects a Linux process")


@pytest.fixture(scope="session")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Write resource folders and the list of models that the programs read."""
    folder = tmp_path_factory.mktemp("models")
    lines = []
    # `steps` takes the first one, in steps of its own: a model without a sample time
    for name, graph in sorted(graphs().items(), key=lambda item: sample_time(item[1]) is not None):
        (folder / name).mkdir()
        (folder / name / "block.bin").write_bytes(graph.to_bytes())
        words: list[object] = [folder / name, graph.token]
        for kind in ("input", "output"):
            chosen = [p for p in graph.ports if p.kind == kind]
            words += [len(chosen), *(n for p in chosen for n in (p.reference, p.size))]
        lines.append(" ".join(map(str, words)))
    (folder / "models").write_text("\n".join(lines) + "\n")
    return folder / "models"


@pytest.fixture(scope="session")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Build a program by name, linked with libc only."""
    if why := GCC.missing():
        pytest.skip(why)
    folder = tmp_path_factory.mktemp("programs")

    def one(name: str) -> Path:
        if not (folder / name).exists():
            GCC.build(folder / name, [HERE / f"{name}.c"], [*FLAGS, "-rdynamic", "-ldl", "-lm"])
        return folder / name

    return one


# ---- a step ---------------------------------------------------------------------------------------------------------
def status(*command: object) -> int:
    return subprocess.run([str(c) for c in command], capture_output=True, timeout=60).returncode


def test_no_allocation_lock_or_system_call_in_a_step(build: Build, models: Path) -> None:
    program = build("quiet_step")
    if status(program, BINARY, models) == 77:
        pytest.skip("no seccomp here")
    assert status(program, BINARY, models) == 0
    assert status(program, BINARY, models, "allocate") == 3  # the test can fail
    assert status(program, BINARY, models, "allocate", "call the system") == -31  # SIGSYS


def test_steps_are_not_refused_for_rounding(build: Build, models: Path) -> None:
    out = run([str(build("process")), "steps", str(BINARY), str(models)], 60, STEPS="20000")
    assert out.count("none refused") == 16


@pytest.mark.stress
def test_ten_million_steps_are_not_refused_for_rounding(build: Build, models: Path) -> None:
    out = run([str(build("process")), "steps", str(BINARY), str(models)], 600, STEPS="10000000")
    assert out.count("10000000 steps") == 16


# ---- a process ------------------------------------------------------------------------------------------------------
def test_two_fmus_in_one_process(build: Build, models: Path, tmp_path: Path) -> None:
    other = shutil.copy(BINARY, tmp_path / "other name äö.so")
    run([str(build("process")), "neighbours", str(BINARY), str(models), str(other)], 60)


def test_a_thousand_instances_and_loads(build: Build, models: Path) -> None:
    run([str(build("process")), "instances", str(BINARY), str(models)], 60)
    exact = "glibc.malloc.tcache_count=0"  # the cache of a thread would count as held memory
    run([str(build("process")), "reload", str(BINARY), str(models)], 60, GLIBC_TUNABLES=exact)


def hold_still(build: Build, models: Path, steps: int, seconds: float) -> None:
    """Run every graph in both standards over many steps and compare the memory in use."""
    exact = "glibc.malloc.tcache_count=0"
    command = [str(build("process")), "endurance", str(BINARY), str(models)]
    out = run(command, seconds, STEPS=str(steps), GLIBC_TUNABLES=exact)
    assert out.count(f": {steps} steps, ") == 2 * len(graphs())


def test_steps_hold_no_memory(build: Build, models: Path) -> None:
    hold_still(build, models, 200, 60)


@pytest.mark.stress
def test_a_million_steps_of_every_graph_hold_no_memory(
    build: Build, models: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hold_still(build, models, 1_000_000, 1200)
    with capsys.disabled():
        print(f"\n1e6 steps of {len(graphs())} graphs in both standards: memory in use is constant")


@pytest.mark.turn("a decimal comma")
def test_rounding_mode_and_locale_are_unchanged(build: Build, models: Path, tmp_path: Path) -> None:
    """Use a locale with a decimal comma if available; messages keep the decimal point."""
    made = tmp_path / "de_DE.UTF-8"
    localedef = shutil.which("localedef")
    if localedef and Path("/usr/share/i18n/locales/de_DE").exists():
        subprocess.run([localedef, "-i", "de_DE", "-f", "UTF-8", str(made)], capture_output=True, timeout=60)
    comma = made.is_dir()
    out = run(
        [str(build("process")), "environment", str(BINARY), str(models)],
        60,
        LOCPATH=str(tmp_path) if comma else "",
        LC_ALL="de_DE.UTF-8" if comma else "C",
    )
    assert ("writes 0,5" if comma else "writes 0.5") in out
    messages = [line for line in out.splitlines() if "step starts at" in line]
    assert len(messages) == 4
    assert all(re.search(r"t = 0\.25 s, but the unit is at t = 0 s", m) for m in messages)


# ---- sanitizers -----------------------------------------------------------------------------------------------------
def instrumented(compiler: list[str], folder: Path, source: Path) -> Path:
    """Build a program that contains the core and the FMI layer."""
    target = Target(" ".join(compiler), compiler)
    if why := target.missing():
        pytest.skip(why)
    flags = [*FLAGS, "-Wno-unused-command-line-argument", "-g", "-rdynamic", "-ldl", "-lm", "-lpthread"]
    return target.build(folder / source.stem, [*CORE_SOURCES, *FMI_SOURCES, source], flags)


@pytest.mark.stress
def test_eight_threads_under_the_thread_sanitizer(models: Path, tmp_path: Path) -> None:
    program = instrumented(["clang", "-O1", "-fsanitize=thread"], tmp_path, HERE / "threads.c")
    run([str(program), str(models)], 600, TSAN_OPTIONS="halt_on_error=1")


@pytest.mark.stress
def test_random_calls_under_valgrind(models: Path, tmp_path: Path) -> None:
    if not shutil.which("valgrind"):
        pytest.skip("no valgrind")
    program = instrumented(["gcc", "-O1"], tmp_path, HERE.parent / "c" / "drive_fmi.c")
    memcheck = ["valgrind", "--quiet", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=all"]

    def one(name: str) -> None:
        graph = graphs()[name]
        references = str(sum(p.size for p in graph.ports))
        run([*memcheck, str(program), str(models.parent / name), graph.token, references, "5000", "3"], 300)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(one, graphs()))

"""An exported controller gives, sample by sample, the commands of its scenario: FMI 2.0, FMI 3.0 and C source."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from called import Array, Called, built_from_source, run_on_target, same_bits
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.cli import main
from hystfmu.scenario import build
from hystfmu.scenario.engine.native import Native

ROOT = Path(__file__).parents[3]
AHEAD = {"r_ahead": "reference.r_lead", "r_dot": "reference.dr_lead", "r_ddot": "reference.ddr_lead"}
LOOP = {"r": "reference.r", "y": "sensor.y", **AHEAD}
SCAN = {"r": "reference.r", "y": "adc.y", "feedforward_r": "feedforward.r"}
# scenario, case, what stands before its inputs, its command
SHIPPED = [
    ("pid", "sine_10", LOOP, "inverse.y"),
    ("pid", "quantised_10", LOOP, "inverse.y"),
    ("pid", "saturation_10", LOOP, "inverse.y"),
    ("pid_observer", "everything_10", LOOP, "inverse.y"),
    ("internal_model", "windup_10", LOOP, "limited.y"),
    ("repetitive", "saturation_10", LOOP, "limited.y"),
    ("h_infinity", "noise_10", LOOP, "limited.y"),
    ("lead_lag", "random", LOOP, "inverse.y"),
    ("sliding_mode_2005", "sine_100", LOOP, "sliding_mode.u"),
    ("iterative_learning", "sine_100", LOOP, "inverse.y"),
    ("adaptive_pid", "load_100", LOOP, "inverse.u"),
    ("cascade", "random", AHEAD, "inverse.y"),
    ("cascade_static", "exact_sine_10", {"r": "reference.r"}, "inverse.y"),
    ("stage/irc_repetitive", "scan_100", SCAN, "inverse.y"),
    ("stage/irc_repetitive", "staircase", SCAN, "inverse.y"),
    ("stage/integral_notch", "scan_100", {"r": "reference.r", "y": "adc.y"}, "inverse.y"),
    ("stage/h_infinity", "scan_100", SCAN, "inverse.y"),
    ("stage/ppf", "scan_50", SCAN, "inverse.y"),
]


def recorded(scenario: str, case: str, ends: dict[str, str], command: str) -> tuple[dict[str, Array], Array]:
    """What the controller of a native run got and gave at its samples."""
    loop = hy.Scenario.load(ROOT / "scenarios" / scenario).record(*ends.values(), command)
    result = loop.run(case, engine="native")
    trace, ripple = result.trace, result.system.case.ripple
    assert trace is not None
    columns = {name: trace[end][::ripple].copy() for name, end in ends.items()}
    want = trace[command][::ripple].copy()
    assert np.ptp(want) > 0
    return columns, want


@pytest.mark.parametrize(("scenario", "case", "ends", "command"), SHIPPED)
def test_commands_of_a_shipped_loop(
    scenario: str, case: str, ends: dict[str, str], command: str, tmp_path: Path
) -> None:
    columns, want = recorded(scenario, case, ends, command)
    loop = hy.Scenario.load(ROOT / "scenarios" / scenario)
    for fmi in (2, 3):
        fmu = loop.export_controller(tmp_path / f"{fmi}.fmu", fmi, case=case)
        called = Called(fmu, tmp_path / f"{fmi}")
        assert set(ends) <= set(called.inputs)
        same_bits(lambda c=called: c, columns, want)


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize(("scenario", "case"), [("pid", "sine_10"), ("stage/irc_repetitive", "scan_100")])
def test_commands_of_the_c_source(scenario: str, case: str, fmi: int, tmp_path: Path) -> None:
    if not shutil.which("cc"):
        pytest.skip("no C compiler")
    _, _, ends, command = next(row for row in SHIPPED if row[:2] == (scenario, case))
    columns, want = recorded(scenario, case, ends, command)
    words = [
        "export",
        str(ROOT / "scenarios" / scenario),
        "--controller",
        "--case",
        case,
        "--fmi",
        str(fmi),
        "--source",
    ]
    done = CliRunner().invoke(main, [*words, "-o", str(tmp_path / "c.fmu")])
    assert done.exit_code == 0, done.output
    made = built_from_source(tmp_path / "c.fmu", tmp_path / "built")
    same_bits(lambda: Called(made, tmp_path / "called"), columns, want)


COMPILERS = {"c": ["cc", "-std=c99"], "c++": ["g++", "-x", "c++", "-std=c++20"]}


@pytest.mark.parametrize(
    ("scenario", "case", "language"),
    [("repetitive", "saturation_10", "c"), ("stage/irc_repetitive", "staircase", "c"), ("pid", "sine_10", "c++")],
)
def test_commands_of_the_files_for_a_target(scenario: str, case: str, language: str, tmp_path: Path) -> None:
    if not shutil.which(COMPILERS[language][0]):
        pytest.skip("no compiler")
    _, _, ends, command = next(row for row in SHIPPED if row[:2] == (scenario, case))
    columns, want = recorded(scenario, case, ends, command)
    words = ["export", str(ROOT / "scenarios" / scenario), "--controller", "--case", case, "--name", "loop"]
    done = CliRunner().invoke(main, [*words, "--c", str(tmp_path / "target")])
    assert done.exit_code == 0, done.output
    got = run_on_target(tmp_path / "target", "loop", columns, COMPILERS[language])
    assert got.tobytes() == want.tobytes()


def test_program_of_the_page_compiles(tmp_path: Path) -> None:
    if not shutil.which("cc"):
        pytest.skip("no C compiler")
    page = (ROOT / "python" / "docs" / "howto" / "deploy.md").read_text()
    (program,) = re.findall(r"^```c\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    words = ["export", str(ROOT / "scenarios" / "pid"), "--controller", "--c", str(tmp_path)]
    assert CliRunner().invoke(main, words).exit_code == 0
    (tmp_path / "control.c").write_text(program + "int tuned(void) { return pid_tune(pid_pid_Ki, 3000); }\n")
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "control.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr


def test_files_for_a_target_need_no_allocator(tmp_path: Path) -> None:
    if not shutil.which("cc"):
        pytest.skip("no C compiler")
    words = ["export", str(ROOT / "scenarios" / "adaptive_pid"), "--controller", "--c", str(tmp_path)]
    assert CliRunner().invoke(main, words).exit_code == 0
    made = ["cc", "-std=c99", "-O1", "-ffreestanding", "-c", "adaptive_pid.c", "-o", "made.o"]
    subprocess.run(made, cwd=tmp_path, check=True, timeout=200)
    listed = subprocess.run(["nm", "--undefined-only", "made.o"], cwd=tmp_path, capture_output=True, text=True)
    needed = {line.split()[-1] for line in listed.stdout.splitlines()}
    assert needed <= {"memcpy", "memset", "memcmp", "memmove", "memchr", "strlen", "strcmp", "_GLOBAL_OFFSET_TABLE_"}


RICH = {"noise.sigma": 1e-4, "disturbance.amplitude": 0.02, "disturbance.frequency": 31.0}
TONES = {"feedforward.f": [100.0, 300.0] + 23 * [0.0], "feedforward.a": [0.8, 0.06] + 23 * [0.0]}
UNREAD = {("stage/integral_notch", "feedforward_r")}
LONG = [
    ("pid", RICH),
    ("pid_observer", RICH),
    ("internal_model", RICH),
    ("repetitive", RICH),
    ("h_infinity", RICH),
    ("lead_lag", RICH),
    ("sliding_mode", RICH),
    ("super_twisting", RICH),
    ("adaptive_pid", {"noise.sigma": 1e-4, "gain.step": 0.2, "gain.t_step": 0.5}),
    ("stage/irc_repetitive", TONES),
    ("stage/integral_notch", TONES),
    ("stage/h_infinity", TONES),
    ("stage/ppf_repetitive", TONES),
    ("stage/law_2005", TONES),
]


@pytest.mark.stress
@pytest.mark.parametrize("form", ["fmi2", "fmi3", "source2", "source3"])
@pytest.mark.parametrize(("scenario", "settings"), LONG, ids=[name for name, _ in LONG])
def test_commands_over_100000_steps(scenario: str, settings: dict[str, float], form: str, tmp_path: Path) -> None:
    loop = hy.Scenario.load(ROOT / "scenarios" / scenario)
    loop.case("long", stop=10.0, set=settings)
    ends = dict(SCAN if scenario.startswith("stage") else LOOP)
    ends = {k: v for k, v in ends.items() if (scenario, k) not in UNREAD}
    command = {"adaptive_pid": "inverse.u"} | dict.fromkeys(("internal_model", "repetitive", "h_infinity"), "limited.y")
    signals = [*ends.values(), command.get(scenario, "inverse.y")]
    # a result keeps the excerpt of a long run that a plot needs: all rows come from the engine
    trace = Native(build(loop.ready().named("long")), signals).run()
    fmu = loop.export_controller(tmp_path / "c.fmu", 3 if "3" in form else 2, case="long", source="source" in form)
    fmu = built_from_source(fmu, tmp_path / "built") if "source" in form else fmu
    want = trace[signals[-1]][::10]
    assert len(want) == 100_001
    same_bits(lambda: Called(fmu, tmp_path / "called"), {name: trace[end][::10] for name, end in ends.items()}, want)

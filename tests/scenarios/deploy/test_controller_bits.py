"""A controller as it is deployed: the bits of its commands, and a bumpless start."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from called import Array, Called, built_from_source, run_on_target, same_bits
from click.testing import CliRunner
from invoked import invoked

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


@pytest.mark.some(2)
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


@pytest.mark.turn("compiled loops")
@pytest.mark.some(1)
@pytest.mark.parametrize(("scenario", "case", "fmi"), [("pid", "sine_10", 2), ("stage/irc_repetitive", "scan_100", 3)])
def test_commands_of_the_c_source(scenario: str, case: str, fmi: int, tmp_path: Path) -> None:
    if not shutil.which("cc"):
        pytest.skip("no C compiler")
    _, _, ends, command = next(row for row in SHIPPED if row[:2] == (scenario, case))
    columns, want = recorded(scenario, case, ends, command)
    words = ["export", str(ROOT / "scenarios" / scenario), "--controller", "--case", case, "--fmi", str(fmi)]
    invoked([*words, "--source", "-o", str(tmp_path / "c.fmu")])
    made = built_from_source(tmp_path / "c.fmu", tmp_path / "built")
    same_bits(lambda: Called(made, tmp_path / "called"), columns, want)


COMPILERS = {"c": ["cc", "-std=c99"], "c++": ["g++", "-x", "c++", "-std=c++20"]}


@pytest.mark.turn("compiled loops")
@pytest.mark.some(1)
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
    invoked([*words, "--c", str(tmp_path / "target")])
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


@pytest.mark.turn("compiled loops")
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


# ---- bumpless start --------------------------------------------------------------------------------------------------
SCENARIOS = ["pid", "internal_model", "repetitive", "h_infinity", "sliding_mode_2005", "stage/irc_repetitive"]
# nothing in these reads the command; where its limits are read, the hand-over is a part of the history
UNTOLD = ("pid", "sliding_mode_2005", "stage/irc_repetitive")


def controller(scenario: str, folder: Path, fmi: int = 2) -> Called:
    fmu = hy.Scenario.load(ROOT / "scenarios" / scenario).export_controller(folder / "c.fmu", fmi)  # type: ignore[arg-type]
    return Called(fmu, folder / "called")


def measured(called: Called, n: int) -> list[dict[str, float]]:
    """Smooth inputs; none of them stands still."""
    t = called.h * np.arange(n)
    columns = {"r": np.sin(60 * t), "y": 0.9 * np.sin(60 * t - 0.1), "r_ahead": np.sin(60 * t + 0.01)}
    columns |= {"r_dot": 60 * np.cos(60 * t), "feedforward_r": np.sin(60 * t + 0.01)}
    known = {name: column for name, column in columns.items() if name in called.inputs}
    return [dict(zip(known, row, strict=True)) for row in np.column_stack(list(known.values())).tolist()]


@pytest.mark.some(3)
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("scenario", SCENARIOS)
def test_first_command_is_the_one_that_acts(scenario: str, fmi: int, tmp_path: Path) -> None:
    called = controller(scenario, tmp_path, fmi)
    n = 1200  # the hand-over takes 1000 steps
    rows = measured(called, n)
    own = np.array([called.command(rows[0]), *map(called.sample, rows[1:])])
    for present in np.random.default_rng().uniform(-0.9, 0.9, 2).tolist():
        called.fmu.reset()
        got = np.array([called.command(rows[0] | {"u_present": present}), *map(called.sample, rows[1:])])
        assert got[:2] == pytest.approx([present, present], abs=1e-12)  # the initialisation and the first step
        assert np.abs(np.diff(got)).max() <= 1.05 * np.abs(np.diff(own)).max() + abs(present - own[1]) / 1000 + 1e-9
        if scenario in UNTOLD:
            assert got[1010:].tobytes() == own[1010:].tobytes()
    called.free()


def test_a_command_may_be_given_at_any_step(tmp_path: Path) -> None:
    called = controller("pid", tmp_path)
    rows = measured(called, 1500)
    own = np.array([called.command(rows[0]), *map(called.sample, rows[1:])])
    called.fmu.reset()
    called.command(rows[0])
    got = np.array(
        [
            called.read(["u"])[0],
            *(called.sample(row | ({"u_present": -0.4} if k >= 300 else {})) for k, row in enumerate(rows[1:], 1)),
        ]
    )
    assert got[:300].tobytes() == own[:300].tobytes()
    assert got[300] == pytest.approx(-0.4, abs=1e-12)
    # on a straight line to the own command
    left = (got - own)[300:1301] / (got - own)[300]
    assert left == pytest.approx(1 - np.arange(1001) / 1000, abs=1e-9)
    assert got[1300:].tobytes() == own[1300:].tobytes()
    called.free()


def test_time_of_the_hand_over_is_tunable(tmp_path: Path) -> None:
    called = controller("pid", tmp_path)
    assert float(called.variables["handover_T"].start) == pytest.approx(1000 * called.h)
    rows = measured(called, 60)
    own = np.array([called.command(rows[0]), *map(called.sample, rows[1:])])
    called.fmu.reset()
    called.write({"handover_T": 20 * called.h})
    got = np.array([called.command(rows[0] | {"u_present": 0.5}), *map(called.sample, rows[1:])])
    assert np.flatnonzero(got != own)[-1] == pytest.approx(20, abs=1)
    called.free()


@pytest.mark.parametrize("given", [True, False])
def test_a_device_at_rest_stays_there(given: bool, tmp_path: Path) -> None:
    """A lag held at 0.6 by a command that its controller does not know of; its feed-forward would start at 0."""
    h, gain = 1e-3, 0.8
    loop = hy.Scenario("lag", step=h, stop=0.1)
    loop.add("plant", hy.blocks.Scaling(gain=gain)).add("reference", hy.blocks.Reference(frequency=10.0))
    loop.add("pid", hy.blocks.Pid(Kp=0.0, Ki=40.0), inputs={"u_ff": 0.0}).add("delay", hy.blocks.Delay(n=1))
    loop.connect("reference.r", "pid.y_d").connect("plant.y", "pid.y").connect("pid.u", "delay.u")
    loop.connect("delay.y", "plant.u").metric("tracking", "rms_percent", "plant.y", against="reference.r")
    called = Called(loop.export_controller(tmp_path / "c.fmu"), tmp_path / "called")
    y, u = 0.6, 0.6 / gain
    rows = {"r": 0.6} | ({"u_present": u} if given else {})
    called.command(rows | {"y": y})
    error = []
    for _ in range(3000):
        command = called.sample(rows | {"y": y})
        y += h / 0.01 * (gain * u - y)  # with the step of computing time
        u = command
        error.append(abs(y - 0.6))
    called.free()
    assert error[-1] < 1e-6
    # a straight line of 0.75 per second disturbs an integral of 40 1/s by 0.75 / 40; without it the device falls to 0
    assert max(error) < 1.1 * 0.75 / 40 if given else max(error) > 0.3

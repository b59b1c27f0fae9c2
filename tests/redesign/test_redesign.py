"""Repetitive parts and replaced controllers for loops of the user's own: commands, numpy, devices that differ."""

import json
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from own_loop import F_N, KI, LATE, SLOPES, H, N, command, held_mode, loop, plant

import hystfmu as hy
from hystfmu.cli.options import structures as named
from hystfmu.design import structures


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    folder = tmp_path_factory.mktemp("loops")
    loop().save(folder / "loop")
    return folder, command("design", "repetitive", folder / "loop", "-o", folder / "learning", "--json")


@pytest.mark.turn("a redesigned loop")
def test_the_written_scenario_runs_and_keeps_its_margins(designed: tuple[Path, Result]) -> None:
    folder, made = designed
    told = json.loads(made.stdout)
    assert made.exit_code == 0, made.stderr
    assert told["passed"]
    assert told["steps"] == N
    (case,) = told["cases"]
    assert case["after"] < 0.2 * case["before"]
    assert command("run", folder / "learning").exit_code == 0
    assert command("margins", folder / "learning").exit_code == 0


@pytest.mark.turn("a redesigned loop")
def test_taps_of_the_file_are_those_of_the_design_bit_for_bit(designed: tuple[Path, Result]) -> None:
    folder, _ = designed
    unit = tomllib.loads((folder / "learning" / "scenario.toml").read_text())["units"]["repetitive"]
    found = hy.redesign.repetitive(folder / "loop")
    assert unit["block"] == "repetitive"
    assert unit["values"]["q"] == found.filters.q.tolist()
    assert unit["values"]["l"] == found.filters.l.tolist()
    assert unit["dims"] == {"n": N, "n_q": len(found.filters.q) - 1, "n_l": len(found.filters.l) // 2}


@pytest.mark.parametrize("off", [0.8, 0.9, 1.0, 1.1, 1.2])
@pytest.mark.parametrize("slope", [*SLOPES, 1.0])
def test_errors_shrink_where_modes_slopes_and_delays_are_off(
    designed: tuple[Path, Result], off: float, slope: float
) -> None:
    """T from the correction to the output, from the mode's step response and nothing of the project."""
    folder, _ = designed
    values = tomllib.loads((folder / "learning" / "scenario.toml").read_text())["units"]["repetitive"]["values"]
    q, taps = (np.array(values[k]) for k in "ql")
    z = np.exp(1j * np.concatenate([np.geomspace(1e-4, 0.1, 400), np.linspace(0.1, np.pi, 4000)]))
    G = held_mode(F_N * off, z)
    Q = q[0] + sum(v * (z**j + z**-j) for j, v in enumerate(q[1:], 1))
    L = sum(v * z ** float(i - len(taps) // 2) for i, v in enumerate(taps))
    for late in (LATE, LATE + 1) if off == 1 else (LATE,):
        path = slope * G * z ** -float(late)
        T = path / (1 + KI * H * z / (z - 1) * path)
        assert np.abs(Q - L * T).max() < 1, (off, slope, late)


@pytest.mark.parametrize("f", [0.8, 1.2])
def test_a_device_with_its_mode_20_percent_off_stays_stable(designed: tuple[Path, Result], f: float) -> None:
    """After 200 periods the error is below that without learning, and has not grown since the 50th."""
    folder, _ = designed
    made = hy.Scenario.load(folder / "learning")
    table = made.table
    table["units"]["device"] = loop(f).table["units"]["device"]
    del table["case"]
    errors = {}
    for periods in (50, 200):
        table["stop"] = periods * N * H
        table["metrics"]["miss"]["after"] = (periods - 1) * N * H
        errors[periods] = made.changed(table).run(engine="native").verdicts[0].value
    table["units"]["repetitive"]["values"]["l"] = [0.0] * len(table["units"]["repetitive"]["values"]["l"])
    without = made.changed(table).run(engine="native").verdicts[0].value
    assert errors[200] <= 1.05 * errors[50]
    assert errors[200] < 0.5 * without


@pytest.mark.turn("a redesigned loop")
def test_what_cannot_be_stable_is_refused_with_what_is_reachable(designed: tuple[Path, Result]) -> None:
    folder, _ = designed
    asked = ["design", "repetitive", folder / "loop", "-o", folder / "fast"]
    refused = command(*asked, "--cutoff", 4000)
    assert refused.exit_code == 2
    assert refused.stderr.count("\n") == 1
    assert not (folder / "fast").exists()
    reachable = refused.stderr.split("a cutoff of ")[1].split(" Hz")[0]
    assert command(*asked, "--cutoff", reachable).exit_code == 0


@pytest.mark.parametrize(("words", "rule"), [
    (["--frequency", 103], "whole number of steps"), (["--frequency", 100, "--period", 0.01], "Got both"),
    (["--gain", 1.5], "gain"), (["--cutoff", 6000], "cutoff"), (["--period", "nan"], "period"),
])  # fmt: skip
def test_bad_words_are_refused_in_one_line(designed: tuple[Path, Result], words: list[object], rule: str) -> None:
    folder, _ = designed
    refused = command("design", "repetitive", folder / "loop", "-o", folder / "none", *words)
    assert refused.exit_code == 2
    assert rule in refused.stderr
    assert refused.stderr.count("\n") == 1
    assert not (folder / "none").exists()


def test_a_second_memory_an_open_loop_and_its_own_folder_are_refused(designed: tuple[Path, Result]) -> None:
    folder, _ = designed
    for source, out, rule in (
        (folder / "learning", folder / "none", "Got"),
        ("scenarios/open_loop", folder / "none", "must have feedback"),
        (folder / "loop", folder / "loop", "folder of its own"),
    ):
        refused = command("design", "repetitive", source, "-o", out)
        assert refused.exit_code == 2
        assert rule in refused.stderr
        assert "Traceback" not in refused.stderr


@pytest.mark.stress
@pytest.mark.parametrize("name", ["irc", "ppf"])
def test_shipped_loops_of_the_stage_learn_their_scan(name: str) -> None:
    found = hy.redesign.repetitive(f"scenarios/stage/{name}", period=0.01)
    after = {r.case: r.verdicts[0].value for r in found.results}
    assert found.results.passed
    scans = {"scan_100", "low_100", "high_100", "two_steps_100"}
    assert set(after) == scans | {f"bouc_wen_{case}" for case in scans}
    assert all(after[k] < 0.55 * found.before[k] for k in after)
    assert after["scan_100"] < 0.25


def of_pid(*cases: str) -> hy.Scenario:
    """The shipped scenario `pid` with few of its seventy cases."""
    pid = hy.Scenario.load("scenarios/pid")
    table = pid.table
    table["case"] = [case for case in table["case"] if case["name"] in cases]
    return pid.changed(table)


@pytest.mark.turn("a redesigned loop")
def test_nothing_winds_up_while_a_command_is_limited() -> None:
    """The shipped case holds the command at 0.95 of its range: a reference that no command reaches is not learnt."""
    found = hy.redesign.repetitive(of_pid("sine_10", "saturation_10", "up_400_10"), gain=0.2)
    after = {r.case: r.verdicts[0].value for r in found.results}
    assert found.results.passed
    assert after["saturation_10"] < 1.05 * found.before["saturation_10"]
    assert after["up_400_10"] < 0.8 * found.before["up_400_10"]


@pytest.mark.turn("a redesigned loop")
def test_a_range_that_the_reference_leaves_winds_nothing_up(tmp_path: Path) -> None:
    """Commands beyond the range of an amplifier behind the inverse: after 150 periods the error is that without."""
    table = loop().table
    table["units"]["clamp"] = {"block": "scaling", "values": {"lo": [-0.75], "hi": [0.75]}}
    table["connections"] |= {"clamp.u": "undo.volts", "computing.u": "clamp.y"}
    table["order"].insert(table["order"].index("computing"), "clamp")
    table["case"] = [{"name": "half", "set": {"wanted.amplitude": 0.4}}, {"name": "full"}]
    loop().changed(table).save(tmp_path / "loop")
    made = hy.redesign.repetitive(tmp_path / "loop")
    (half, full) = (r.verdicts[0].value for r in made.results)
    assert half < 0.2 * made.before["half"]
    assert full == pytest.approx(made.before["full"], rel=0.02)
    long = made.scenario.table
    for case in long["case"]:
        case["stop"], case["after"] = 150 * N * H, 149 * N * H
    assert made.scenario.changed(long).run("full", engine="native").verdicts[0].value < 1.05 * made.before["full"]


# ---- replaced controllers --------------------------------------------------------------------------------------------
NAMES = sorted(named())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    into = tmp_path_factory.mktemp("loops")
    made = loop().case("scan").case("open", set={"law.Ki": 0.0}).case("slow", set={"wanted.frequency": 1 / (2 * N * H)})
    made.save(into / "loop")
    return into


@pytest.fixture(scope="module")
def told_of(folder: Path) -> Callable[[str], dict[str, Any]]:
    """What the command says of a structure, designed once."""

    @cache
    def told(name: str) -> dict[str, Any]:
        done = command("design", name, folder / "loop", "-o", folder / name, "--json")
        assert done.exit_code == 0, done.stderr
        return json.loads(done.stdout)  # type: ignore[no-any-return]

    return told


def test_there_is_a_command_for_every_structure() -> None:
    assert {k: s.text for k, s in structures.STRUCTURES.items()} == named()


@pytest.mark.turn("a redesigned loop")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", NAMES)
def test_the_written_scenario_has_the_controller_alone_and_stays_stable_with_the_mode_off(
    folder: Path, told_of: Callable[[str], dict[str, Any]], name: str
) -> None:
    told = told_of(name)
    table = tomllib.loads((folder / name / "scenario.toml").read_text())
    assert set(table["units"]) == {"device", "gauge", "wanted", name, "undo", "computing"}
    ends = {k: v for k, v in table["connections"].items() if name in (k.split(".")[0], v.split(".")[0])}
    assert ends == {
        f"{name}.y_d": "wanted.r", f"{name}.u_ff": "wanted.r", f"{name}.y": "gauge.y", "undo.v": f"{name}.u",
    }  # fmt: skip
    assert [c["name"] for c in table["case"]] == ["scan", "slow"]
    assert told["Ms_db"] <= 6
    assert told["margins"]["stable"]
    assert command("run", folder / name).exit_code == 0
    assert command("margins", folder / name).exit_code == 0
    assert told["loops"] > 4
    for f in (0.95, 1.05):
        assert_stable(folder / name, f)


def assert_stable(folder: Path, f: float) -> None:
    """The error on a device with its mode off by a factor does not grow."""
    table = hy.Scenario.load(folder).table
    table["units"]["device"] = loop(f).table["units"]["device"]
    del table["case"]
    errors = []
    for periods in (20, 100):
        table["stop"] = periods * N * H
        table["metrics"]["miss"]["after"] = (periods - 1) * N * H
        errors.append(hy.Scenario.load(folder).changed(table).run(engine="native").verdicts[0].value)
    assert errors[1] <= 1.02 * errors[0] + 1e-9


@pytest.mark.turn("a redesigned loop")
def test_a_structure_that_knows_the_mode_is_faster_than_the_integral(told_of: Callable[[str], dict[str, Any]]) -> None:
    assert told_of("irc")["bandwidth_hz"] > 2 * told_of("integral")["bandwidth_hz"]


@pytest.mark.turn("a redesigned loop")
@pytest.mark.parametrize("name", ["integral", "irc"])
def test_peaks_of_the_sensitivity_are_those_of_the_gains_in_the_file(
    folder: Path, told_of: Callable[[str], dict[str, Any]], name: str
) -> None:
    """C from its definition: backward integral, and the lag for an input on lines between the samples."""
    told = told_of(name)
    blocks = tomllib.loads((folder / name / "scenario.toml").read_text())["units"][name]["graph"]["blocks"]
    values = {b["name"]: b.get("values", {}) for b in blocks}
    z = np.exp(1j * np.concatenate([np.geomspace(1e-4, 0.3, 4000), np.linspace(0.3, np.pi, 20000)]))
    C = values["pid"]["Ki"] * H * z / (z - 1) + values["pid"].get("Kp", 0.0)
    if name == "irc":
        (b,), (T, one) = values["damping"]["b"], values["damping"]["a"]
        assert one == 1.0
        p, x = np.exp(-H / T), H / T
        C = C + b * ((1 - (1 - p) / x) * z + (1 - p) / x - p) / (z - p)
    S = 1 / np.abs(1 + C * held_mode(F_N, z) * z ** -float(LATE))
    assert told["Ms_db"] == pytest.approx(20 * np.log10(S.max()), abs=0.05)


@pytest.mark.turn("a redesigned loop")
def test_what_cannot_be_reached_is_refused_with_what_can(
    folder: Path, told_of: Callable[[str], dict[str, Any]]
) -> None:
    refused = command("design", "irc", folder / "loop", "-o", folder / "none", "--bandwidth", 900)
    assert refused.exit_code == 2
    most = float(refused.stderr.partition("Got at most ")[2].split(" Hz")[0])
    assert told_of("irc")["bandwidth_hz"] <= 1.005 * most < 900
    assert not (folder / "none").exists()


@pytest.mark.parametrize("gain", [1e-2, -20.0])
def test_a_plant_without_inverse_of_any_gain_gets_the_bandwidth_that_it_can_have(gain: float) -> None:
    """The noise makes a slower loop the best one, unless a bandwidth is required; Ms by hand, at the largest slope."""
    g = plant()
    (b,) = g.node("mode").value("b")
    noisy = hy.Scenario("noisy", step=H, stop=N * H).add("device", g.replace(g.node("mode").with_values(b=[gain * b])))
    noisy.add("wanted", hy.blocks.Reference(frequency=1 / (N * H), amplitude=0.8 * abs(gain)))
    noisy.add("sensor", hy.blocks.Noise(sigma=0.5 * abs(gain))).add("seen", hy.blocks.Sum(n=2))
    noisy.add("law", hy.blocks.Pid(Kp=0.0, Ki=50.0 / gain))
    noisy.connect("device.gap", "seen.u_1").connect("sensor.w", "seen.u_2").connect("seen.y", "law.y")
    noisy.connect("wanted.r", "law.y_d").connect("law.u", "device.volts")
    noisy.metric("miss", "rms_percent", "device.gap", "wanted.r")
    slow, fast = (hy.redesign.controller(noisy, "integral", off=0.0, bandwidth=f).tuned for f in (0.0, 8.0))
    assert slow.bandwidth < 5 < 8 <= fast.bandwidth
    z = np.exp(1j * np.geomspace(1e-4, np.pi, 20000))
    peak = -20 * np.log10(np.abs(1 + fast.Ki * H * z / (z - 1) * held_mode(F_N, z)).min())
    assert (fast.ms_db, fast.set_ms_db) == pytest.approx((peak, peak), abs=0.05)


def test_a_notch_needs_a_mode_and_a_name_is_one_of_the_structures(folder: Path) -> None:
    static = hy.Scenario("static", step=H, stop=3 * N * H)
    static.add("device", hy.blocks.PrandtlIshlinskii(w0=0.7, r=[0.1, 0.4], w=[0.2, 0.1]))
    static.add("wanted", hy.blocks.Reference(frequency=100.0)).add("law", hy.blocks.Pid(Kp=0.0, Ki=50.0))
    static.add("late", hy.blocks.Delay(n=1))
    for a, b in (
        ("wanted.r", "law.y_d"),
        ("wanted.r", "law.u_ff"),
        ("device.y", "law.y"),
        ("law.u", "late.u"),
        ("late.y", "device.u"),
    ):
        static.connect(a, b)
    static.metric("miss", "rms_percent", "device.y", "wanted.r").save(folder / "static")
    refused = command("design", "notch", folder / "static", "-o", folder / "none")
    assert refused.exit_code == 2
    assert "needs a mode" in refused.stderr
    assert command("design", "integral", folder / "static", "-o", folder / "slow").exit_code == 0
    with pytest.raises(hy.InputError, match="must be one of integral"):
        hy.redesign.controller(folder / "loop", "magic")


@pytest.mark.turn("a redesigned loop")
@pytest.mark.some(1)
@pytest.mark.parametrize("name", ["integral", pytest.param("irc", marks=pytest.mark.stress)])
def test_a_controller_of_a_shipped_scenario_keeps_the_limits_of_its_command(name: str, tmp_path: Path) -> None:
    of_pid("sine_10", "saturation_10", "up_400_10").save(tmp_path / "pid")
    done = command("design", name, tmp_path / "pid", "-o", tmp_path / "made", "--json")
    assert done.exit_code in (0, 1), done.stderr
    table = tomllib.loads((tmp_path / "made" / "scenario.toml").read_text())
    (case,) = (c for c in table["case"] if c["name"] == "saturation_10")
    assert case["set"][f"{name}.pid_u_min"] == -0.95
    assert table["metrics"]["variation"]["signal"] == f"{name}.u"
    assert command("run", tmp_path / "made", "--engine", "native").exit_code == done.exit_code

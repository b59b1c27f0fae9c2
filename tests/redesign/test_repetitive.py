"""Repetitive parts for loops of the user's own: through the command line, against numpy, and on devices that differ."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

import hystfmu as hy
from hystfmu.cli import main

H, F_N, ZETA, KI, LATE = 1e-4, 700.0, 0.04, 90.0, 1
N = 100  # steps in a period
SLOPES = (0.8, 1.25)


def plant(f: float = 1.0) -> hy.Graph:
    """Plays, then a mode whose natural frequency differs by a factor f."""
    w = 2 * np.pi * F_N * f
    return hy.Graph(
        [
            hy.Node("plays", "prandtl_ishlinskii", {"n": 2}, {"w0": 0.7, "r": [0.1, 0.4], "w": [0.2, 0.1]}),
            hy.Node("mode", "transfer_function", {"nb": 0, "na": 2}, {"b": [w**2], "a": [1.0, 2 * ZETA * w, w**2]}),
        ],
        [("plays.y", "mode.u")],
        [hy.Input("volts", ("plays.u",))],
        [hy.Output("gap", "mode.y")],
    )


def loop(f: float = 1.0, periods: int = 3) -> hy.Scenario:
    """An integral around the inverse of the plays; no unit has the name that `hystfmu start` would give it."""
    plays = hy.Graph.single(hy.Node("plays", "prandtl_ishlinskii", {"n": 2}, dict(plant().nodes[0].values)))
    made = hy.Scenario("stage", step=H, stop=periods * N * H)
    made.add("device", plant(f)).add("gauge", hy.blocks.Scaling(), text="unity").add(
        "wanted", hy.blocks.Reference(frequency=1 / (N * H), amplitude=0.8, shape="triangle", turn=0.3)
    )
    made.add("law", hy.blocks.Pid(Kp=0.0, Ki=KI)).add("undo", hy.Model("inverse", _inverse(plays), H))
    made.add("computing", hy.blocks.Delay(n=LATE))
    for source, target in (
        ("device.gap", "gauge.u"),
        ("gauge.y", "law.y"),
        ("wanted.r", "law.y_d"),
        ("wanted.r", "law.u_ff"),
        ("law.u", "undo.v"),
        ("undo.volts", "computing.u"),
        ("computing.y", "device.volts"),
    ):
        made.connect(source, target)
    made.metric("miss", "rms_percent", "device.gap", "wanted.r", limit=20.0, after=(periods - 1) * N * H)
    return made.margins(corners=["*"], slopes=SLOPES, stable_to_steps=1.0)


def _inverse(plays: hy.Graph) -> hy.Graph:
    """The exact inverse of plays, by the project, with names of its own for the ports."""
    g = hy.Model("plays", plays, H).inverse().graph
    return hy.Graph(
        g.nodes, g.wires, [hy.Input("v", g.inputs[0].to)], [hy.Output("volts", g.outputs[0].source)], sort=False
    )


def command(*words: object) -> Result:
    return CliRunner().invoke(main, [str(w) for w in words])


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    folder = tmp_path_factory.mktemp("loops")
    loop().save(folder / "loop")
    return folder, command("design", "repetitive", folder / "loop", "-o", folder / "learning", "--json")


def test_the_written_scenario_runs_and_keeps_its_margins(designed: tuple[Path, Result]) -> None:
    folder, made = designed
    told = json.loads(made.stdout)
    assert made.exit_code == 0, made.stderr
    assert told["passed"]
    assert told["steps"] == N
    (case,) = told["cases"]
    assert case["with"] < 0.2 * case["without"]
    assert command("run", folder / "learning").exit_code == 0
    assert command("margins", folder / "learning").exit_code == 0


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
    G = _held_mode(F_N * off, z)
    Q = q[0] + sum(v * (z**j + z**-j) for j, v in enumerate(q[1:], 1))
    L = sum(v * z ** float(i - len(taps) // 2) for i, v in enumerate(taps))
    for late in (LATE, LATE + 1) if off == 1 else (LATE,):
        path = slope * G * z ** -float(late)
        T = path / (1 + KI * H * z / (z - 1) * path)
        assert np.abs(Q - L * T).max() < 1, (off, slope, late)


def _held_mode(f: float, z: np.ndarray) -> np.ndarray:
    """Response of a mode behind a held command, from its discrete poles and its step response at two samples."""
    w, d = 2 * np.pi * f, np.sqrt(1 - ZETA**2)
    t = H * np.arange(1, 3)
    y = 1 - np.exp(-ZETA * w * t) * (np.cos(w * d * t) + ZETA / d * np.sin(w * d * t))
    a = np.array([1.0, -2 * np.exp(-ZETA * w * H) * np.cos(w * d * H), np.exp(-2 * ZETA * w * H)])
    b = [y[0], y[1] - y[0] + a[1] * y[0]]
    return np.asarray((b[0] * z + b[1]) / (z**2 + a[1] * z + a[2]))


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


def test_what_cannot_be_stable_is_refused_with_what_is_reachable(designed: tuple[Path, Result]) -> None:
    folder, _ = designed
    asked = ["design", "repetitive", folder / "loop", "-o", folder / "fast"]
    refused = command(*asked, "--cutoff", 4000)
    assert refused.exit_code == 2
    assert refused.stderr.count("\n") == 1
    assert not (folder / "fast").exists()
    reachable = refused.stderr.split("a cutoff of ")[1].split(" Hz")[0]
    assert command(*asked, "--cutoff", reachable).exit_code == 0


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (["--frequency", 103], "whole number of steps"),
        (["--frequency", 100, "--period", 0.01], "Got both"),
        (["--gain", 1.5], "gain"),
        (["--cutoff", 6000], "cutoff"),
        (["--period", "nan"], "period"),
    ],
)
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


@pytest.mark.parametrize("name", ["irc", "ppf"])
def test_shipped_loops_of_the_stage_learn_their_scan(name: str) -> None:
    found = hy.redesign.repetitive(f"scenarios/stage/{name}", period=0.01)
    after = {r.case: r.verdicts[0].value for r in found.results}
    assert found.results.passed
    assert set(after) == {"scan_100", "low_100", "high_100", "two_steps_100"}
    assert all(after[k] < 0.5 * found.before[k] for k in after)
    assert after["scan_100"] < 0.25

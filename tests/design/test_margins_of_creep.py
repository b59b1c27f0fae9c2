"""Margins of scenario loops whose plant answers at once: creep beside a gain, integrators, parts of a step of delay."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy.linalg import expm

import hystfmu as hy
from hystfmu.cli import main

H, FINE = 0.01, 20
SPAN = {"span_u": [-3.0, 3.0], "h": H}
PLAYS = {"w0": 1.0, "r": [0.3, 0.9], "w": [0.3, 0.2]}


def drawn() -> tuple[int, np.random.Generator]:
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    return seed, np.random.default_rng(seed)


def loop(plant: Any, Kp: float, Ki: float, late: int = 0, **more: Any) -> hy.Scenario:
    """PI law and a plant at twenty times its rate, behind a delay of some of these fine steps."""
    made = hy.Scenario("creeping", step=H, stop=1.0, ripple=FINE).add("plant", plant, fine=True)
    made.add("reference", hy.blocks.Reference(amplitude=0.5, frequency=1.0), fine=True)
    made.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki), inputs={"u_ff": 0.0})
    command = "pid.u"
    if late:
        made.add("late", hy.blocks.Delay(n=late), fine=True).connect("pid.u", "late.u")
        command = "late.y"
    made.connect(command, "plant.u").connect("reference.r", "pid.y_d").connect("plant.y", "pid.y")
    return made.metric("tracking", "rms", "plant.y", "reference.r")


def margins(made: hy.Scenario, folder: Path, *more: str) -> Result:
    return CliRunner().invoke(main, ["margins", str(made.save(folder)), *more])


def figures(run: Result) -> dict[str, Any]:
    (row,) = json.loads(run.output)["loops"]
    return dict(row["margins"])


def creeping(w: np.ndarray, T: np.ndarray) -> hy.Model:
    """Plays, then creep with a direct gain of 1, as the kind `actuator` writes it where it finds no resonance."""
    nodes = [
        hy.Node("hysteresis", "prandtl_ishlinskii", {}, PLAYS),
        hy.Node("creep", "creep", {"n": len(w)}, {"w0": 1.0, "w": w, "T": T, "start": 1.0}),
    ]
    ends = [hy.Input("u", ("hysteresis.u",))], [hy.Output("y", "creep.y")]
    return hy.Model("actuator", hy.Graph(nodes, [("hysteresis.y", "creep.u")], *ends), provenance=SPAN, step=H)


def ends_of(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: float, Kp: float, Ki: float, late: float) -> np.ndarray:
    """Poles of the sampled loop, stepped in twentieths: commands come late, and a sample sees what has come."""
    n, steps = len(A), int(np.ceil(late)) + 2
    M = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * H / FINE)
    shift = round(late * FINE)

    def step(s: np.ndarray) -> np.ndarray:
        x, sent, total = s[:n], s[n : n + steps], s[-1]  # commands of this step and of those before, newest first
        for k in range(FINE):
            v = sent[(FINE - 1 + shift - k) // FINE] if shift else sent[0]
            x = M[:n, :n] @ x + M[:n, n] * v
        y = (C @ x)[0] + D * v
        total = total - H * y
        return np.concatenate([x, [-Kp * y + Ki * total], sent[:-1], [total]])

    return np.linalg.eigvals(np.column_stack([step(e) for e in np.eye(n + steps + 1)]))


def assert_limits(found: dict[str, Any], poles: Any) -> None:
    """The upper gain margin is where the poles of the loop stepped by hand leave the unit circle, and no earlier."""
    db = found["gain_db"]
    inside, outside = (np.abs(poles(10 ** ((db + d) / 20))).max() for d in (-1e-3, 1e-3))
    assert inside < 1 < outside
    assert found["gain_low_db"] is None
    assert found["conditionally_stable"] is False


@pytest.mark.parametrize("late", [0, 1, 7, 20, 33])
def test_creep_without_dynamics_has_margins(tmp_path: Path, late: int) -> None:
    """No inverse in the loop: the plant counts with its largest slope, plays 1.5 times creep at rest 1 + sum w."""
    _, rng = drawn()
    w, T = rng.uniform(0.02, 0.3, 2), 10 ** rng.uniform(-2, 1, 2)
    Kp, Ki = rng.uniform(0, 0.2), rng.uniform(5, 15)
    run = margins(loop(creeping(w, T), Kp, Ki, late), tmp_path / "loop", "--json")
    assert run.exit_code == 0, run.output
    found, (row,) = figures(run), json.loads(run.output)["loops"]
    k = (
        max(row["slopes"], key=abs) / (1 + w.sum())
        if not row["slopes"][0] <= 1 <= row["slopes"][1]
        else 1 / (1 + w.sum())
    )
    space = np.diag(-1 / T), (1 / T)[:, None], k * w[None], k
    assert_limits(found, lambda gain: ends_of(*space, gain * Kp, gain * Ki, late / FINE))


@pytest.mark.parametrize("late", [0, 7, 20, 33])
@pytest.mark.parametrize("lead", [0.0, 0.3])
def test_an_integrator_and_a_pi_plant_behind_a_delay_have_margins(tmp_path: Path, late: int, lead: float) -> None:
    """G = (1 + lead s) / s under a PI law."""
    nb, b = (0, [1.0]) if not lead else (1, [lead, 1.0])
    plant = hy.blocks.TransferFunction(na=1, nb=nb, b=b, a=[1.0, 0.0])
    run = margins(loop(plant, 1.3, 0.9, late), tmp_path / "loop", "--json")
    assert run.exit_code == 0, run.output
    space = np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), lead
    assert_limits(figures(run), lambda gain: ends_of(*space, gain * 1.3, gain * 0.9, late / FINE))


def test_creep_that_only_the_inverse_has_stays_in_the_loop(tmp_path: Path) -> None:
    """The plant has plays alone, the inverse undoes creep: slopes of 1 / (1 + w), and the inverse of creep in L.

    Margins hold for slope 1, so that L has the static gain of the inverse undone.
    """
    w, T, Kp, Ki = 0.4, 0.5, 0.1, 12.0
    plays = hy.Graph.single(hy.Node("plays", "prandtl_ishlinskii", {}, PLAYS))
    made = hy.Scenario("creeping", step=H, stop=4.0)
    made.add("plant", hy.Model("prandtl_ishlinskii", plays, provenance=SPAN, step=H))
    made.add("reference", hy.blocks.Reference(amplitude=1.0, frequency=0.5))
    made.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki))
    made.add("inverse", creeping(np.array([w]), np.array([T])).inverse())
    for ends in (
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("plant.y", "pid.y"),
        ("pid.u", "inverse.u"),
        ("inverse.y", "plant.u"),
    ):
        made.connect(*ends)
    made.metric("tracking", "rms", "plant.y", "reference.r")
    run = margins(made, tmp_path / "loop", "--json")
    assert run.exit_code == 0, run.output
    (row,) = json.loads(run.output)["loops"]
    assert row["slopes"] == pytest.approx([1 / (1 + w)] * 2, rel=1e-6)
    z = np.exp(1j * np.geomspace(1e-5, 1, 40_000) * np.pi)
    s = -np.expm1(-H / T)
    # y = (u - w (1 - s) q_last) / (1 + w s) gives u over a step of creep, whose lag is q = q_last + s (y - q_last)
    q = s / (1 + w * s) / (1 - (1 - s) / z + s * w * (1 - s) / (1 + w * s) / z)
    L = (Kp + Ki * H * z / (z - 1)) * (1 - w * q) / z  # what the plays and their inverse leave is a gain of 1
    assert row["margins"]["Ms_db"] == pytest.approx(float(-20 * np.log10(np.abs(1 + (1 + w) * L).min())), abs=1e-4)


def test_behind_creep_a_command_at_its_limit_has_no_slope(tmp_path: Path) -> None:
    """A device of 0.8 of the gain asks for more than the range: 0 while the command stands at its limit, else 0.8.

    Creep moves the output meanwhile; differences of the output alone had slopes of either sign. The range reaches at
    most 0.8 * 3.48 * 1.6 = 4.5 with the largest creep drawn, and the reference 5.
    """
    seed, rng = drawn()
    w, T = rng.uniform(0.05, 0.3, 2), 10 ** rng.uniform(-1.5, 0.5, 2)
    model = creeping(w, T)
    less = hy.Node("less", "scaling", {"n": 1}, {"gain": 0.8})
    limit = hy.Node("limit", "scaling", {"n": 1}, {"lo": -2.5, "hi": 2.5})
    graph = hy.Graph(
        [limit, *model.graph.nodes, less],
        [("limit.y", "hysteresis.u"), *model.graph.wires, ("creep.y", "less.u")],
        [hy.Input("u", ("limit.u",))],
        [hy.Output("y", "less.y")],
    )
    made = hy.Scenario("creeping", step=H, stop=4.0)
    made.add("plant", hy.Model("actuator", graph, provenance=SPAN, step=H))
    made.add("reference", hy.blocks.Reference(amplitude=5.0, frequency=0.5))
    made.add("pid", hy.blocks.Pid(Kp=0.1, Ki=12.0))
    made.add("inverse", model.inverse())
    for ends in (
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("plant.y", "pid.y"),
        ("pid.u", "inverse.u"),
        ("inverse.y", "plant.u"),
    ):
        made.connect(*ends)
    made.metric("tracking", "rms", "plant.y", "reference.r")
    run = margins(made, tmp_path / "loop", "--json")
    assert run.exit_code == 0, run.output
    (row,) = json.loads(run.output)["loops"]
    assert row["slopes"] == pytest.approx([0.0, 0.8], abs=1e-6), seed


GAIN = hy.blocks.TransferFunction(na=1, nb=0, b=[2.0], a=[0.05, 1.0])


def test_a_loop_that_is_unstable_on_its_own_path_fails(tmp_path: Path) -> None:
    run = margins(loop(GAIN, 0.5, 4000.0), tmp_path / "loop")
    assert run.exit_code == 1
    line = (
        "creeping: margins.stable_to_steps: must be at least 0 at nominal, slopes 2.00 to 2.00. Got an unstable loop."
    )
    assert line in run.output.splitlines()
    assert "ok" not in run.output.split()
    named = margins(loop(GAIN, 0.5, 4000.0).margins(expected_unstable=["nominal"]), tmp_path / "named")
    assert named.exit_code == 0, named.output
    assert named.output.split()[-1] == "expected"


@pytest.mark.parametrize(("name", "why"), [("nominal", "is stable, or has none"), ("missing", "does not exist")])
def test_a_case_that_is_expected_to_be_unstable_must_be(tmp_path: Path, name: str, why: str) -> None:
    run = margins(loop(GAIN, 0.5, 1.0).margins(expected_unstable=[name]), tmp_path / "loop")
    assert run.exit_code == 2
    assert f"margins.expected_unstable: The case must have an unstable loop. Got '{name}', which {why}." in run.output
    assert "Traceback" not in run.output


def test_loops_of_two_inputs_and_outputs_are_refused_in_one_line() -> None:
    run = CliRunner().invoke(main, ["margins", str(Path(__file__).parents[2] / "scenarios/stage/xy_raster")])
    assert run.exit_code == 1
    (line,) = run.output.splitlines()
    assert line.startswith("no margins: stage_xy_raster, 1 case: The loop must have one input and one output to have ")
    assert line.endswith("Got 2 outputs with references of their own: x.y, y.y.")

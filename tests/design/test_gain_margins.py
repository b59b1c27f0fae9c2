"""Both gain margins against frequency responses and poles of their own, and loops with creep as state spaces."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.linalg import expm
from scipy.signal import cont2discrete

import hystfmu as hy
from hystfmu.cli import main

pytest.importorskip("control")
ROOT = Path(__file__).parents[2] / "scenarios"
H = 1e-4
W = 2 * np.pi * 500


def drawn() -> tuple[int, np.random.Generator]:
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    return seed, np.random.default_rng(seed)


def held(b: list[float], a: list[float], h: float, hold: str, z: np.ndarray) -> np.ndarray:
    num, den, _ = cont2discrete((b, a), h, hold)
    return np.polyval(num.ravel(), z) / np.polyval(den, z)


def test_margins_of_the_internal_model_are_those_of_its_equations() -> None:
    """L = C z^-1 G0 / (1 + C G0 (1 - z^-1)), C three integrators and a biquad; -1 is passed on both sides."""
    run = CliRunner().invoke(main, ["margins", str(ROOT / "internal_model"), "--case", "sine_10", "--json"])
    assert run.exit_code == 0, run.output
    found = json.loads(run.output)["loops"][0]["margins"]
    w = np.linspace(1e-3, np.pi, 400_001)
    z = np.exp(1j * w)
    total = H * z / (z - 1)
    g0 = held([9869604.401089357], [1.0, 4398.22971502571, 9869604.401089357], H, "zoh", z)
    biquad = held([9.206e-07, 0.0007443, 1.0], [3.219e-09, 3.291e-05, 1.0], H, "foh", z)
    C = 226.0 * total * (1 + 4754.0 * total) * (1 + 3915.0 * total) * biquad
    L = C * g0 / z / (1 + C * g0 * (1 - 1 / z))
    at = np.flatnonzero((L.imag[:-1] * L.imag[1:] < 0) & (L.real[:-1] < 0))
    share = L.imag[at] / (L.imag[at] - L.imag[at + 1])
    factors = -20 * np.log10(-(L.real[at] + share * (L.real[at + 1] - L.real[at])))
    assert found["gain_db"] == pytest.approx(factors[factors > 0].min(), abs=0.01)
    assert found["gain_low_db"] == pytest.approx(factors[factors < 0].max(), abs=0.01)
    assert (found["gain_low_db"], found["gain_db"]) == pytest.approx((-10.49, 10.68), abs=0.1)
    assert found["conditionally_stable"] is True


def test_a_conditionally_stable_loop_is_named_in_words() -> None:
    run = CliRunner().invoke(main, ["margins", str(ROOT / "internal_model"), "--case", "sine_10"])
    assert (
        "conditionally stable, and unstable if the gain decreases by more than 'gain down': internal_model"
        in run.output
    )
    assert "-10.5" in run.output
    run = CliRunner().invoke(main, ["margins", str(ROOT / "pid"), "--case", "sine_10"])
    assert "conditionally" not in run.output


def creep(w: list[float], T: list[float], w0: float = 1.0) -> hy.Node:
    return hy.Node("creep", "creep", {"n": len(w)}, {"w0": w0, "w": w, "T": T})


def in_series(*nodes: hy.Node) -> hy.Graph:
    wires = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    ends = [hy.Input("u", (f"{nodes[0].name}.u",))], [hy.Output("y", f"{nodes[-1].name}.y")]
    return hy.Graph(list(nodes), wires, *ends, step=H)


def lag2(wn: float, zeta: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return np.array([[0.0, 1.0], [-(wn**2), -2 * zeta * wn]]), np.array([[0.0], [wn**2]]), np.array([[1.0, 0.0]])


INTEGRATOR = np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1))


def own_space(w: np.ndarray, T: np.ndarray, parts: list[tuple[np.ndarray, ...]]) -> tuple[np.ndarray, ...]:
    """Creep with a direct gain of 1, then parts in series, held for a step by one matrix exponential."""
    A, B, C, D = np.diag(-1 / T), (1 / T)[:, None], w[None], 1.0
    for F, G, row in parts:
        A = np.block([[A, np.zeros((len(A), len(F)))], [G @ C, F]])
        B, C, D = np.vstack([B, G * D]), np.hstack([np.zeros((1, len(A) - len(F))), row]), 0.0
    n = len(A)
    M = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * H)
    return M[:n, :n], M[:n, n:], C, np.array([[D]])


def closed_poles(space: tuple[np.ndarray, ...], pid: dict[str, float], late: int, gain: float = 1.0) -> np.ndarray:
    """Poles of the loop, stepped by hand from each state: plant, commands on their way, integral and derivative.

    A sample is taken before the command of its step comes, so a direct gain of the plant answers the last one.
    """
    F, G, C, D = space
    n, past = len(F), late + int(D.any())

    def step(s: np.ndarray) -> np.ndarray:
        x, line, total, seen = s[:n], s[n : n + past], s[-2], s[-1]
        coming = line[late - 1] if late else None  # what reaches the plant in this step, if it is on its way already
        e = -((C @ x)[0] + (D[0, 0] * line[late] if D.any() else 0.0))
        d = (e - seen) / (pid["tau"] + H)
        total = total + H * e
        u = gain * (pid["Kp"] * e + pid["Ki"] * total + pid["Kd"] * d)
        x = F @ x + G[:, 0] * (u if coming is None else coming)
        return np.concatenate([x, np.concatenate([[u], line])[:past], [total, e - pid["tau"] * d]])

    return np.linalg.eigvals(np.column_stack([step(v) for v in np.eye(n + past + 2)]))


def apart(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest distance of a pole of either set from the other set."""
    distance = np.abs(found[:, None] - expected[None])
    return float(max(distance.min(0).max(), distance.min(1).max()))


@pytest.mark.parametrize("_", range(3))
def test_a_conditionally_stable_loop_with_creep_has_the_poles_of_its_state_space(_: int) -> None:
    """Two integrators, two modes and creep of up to 100 s behind a PID: three integrators, so the gain may not fall."""
    import control

    seed, rng = drawn()
    T, w = np.sort(10 ** rng.uniform(-2.5, 2, 5)), rng.uniform(0.02, 0.06, 5)
    modes = [(W * rng.uniform(0.9, 1.1), rng.uniform(0.3, 0.8)), (W * rng.uniform(2.5, 3.5), rng.uniform(0.02, 0.2))]
    nodes = [creep(w.tolist(), T.tolist())]
    for k, (wn, zeta) in enumerate(modes):
        values = {"b": [wn**2], "a": [1.0, 2 * zeta * wn, wn**2]}
        nodes.append(hy.Node(f"g{k}", "transfer_function", {"na": 2, "nb": 0}, values))
    for k in range(2):
        nodes.append(hy.Node(f"i{k}", "transfer_function", {"na": 1, "nb": 0}, {"b": [1.0], "a": [1.0, 0.0]}))
    lead, late = rng.uniform(0.02, 0.04), int(rng.integers(0, 3))
    c = rng.uniform(0.3, 0.5) * 2 * np.pi * 40
    pid = {"Kp": 0.5 * c / lead, "Ki": 0.2 * c / lead**2, "Kd": 1.5 * c, "tau": 1e-4}
    L = hy.design.loop(in_series(*nodes), hy.Node("pid", "pid", {}, pid), H, delay=late)
    space = own_space(w, T, [*(lag2(*m) for m in modes), INTEGRATOR, INTEGRATOR])
    expected = closed_poles(space, pid, late)
    found = hy.design.margins(L)
    assert apart(np.asarray(control.feedback(L, 1).poles()), expected) < 1e-9, seed
    assert L.nstates == len(expected), seed
    assert str(found).startswith("conditionally stable: gain margins -"), seed
    assert_limits(lambda f: closed_poles(space, pid, late, f), found)


def assert_limits(poles, margins: hy.design.Margins) -> None:
    """Stable right inside both gain margins, and unstable right outside of them; halfway to each of them stable too."""
    for db, sign in ((margins.gain_db, 1), (margins.gain_low_db, -1)):
        if np.isfinite(db):
            assert (
                np.abs(poles(10 ** ((db - sign * 1e-4) / 20))).max()
                < 1
                < np.abs(poles(10 ** ((db + sign * 1e-4) / 20))).max()
            )
        assert np.abs(poles(10 ** ((db if np.isfinite(db) else sign * 40) / 40))).max() < 1


@pytest.mark.parametrize("_", range(40))
def test_gain_margins_are_where_the_poles_of_drawn_loops_leave_the_circle(_: int) -> None:
    """Creep, up to two modes, delay and any PID: half of the loops are unstable, and such a one has no margins."""
    seed, rng = drawn()
    T, w = np.sort(10 ** rng.uniform(-3, 1.5, 3)), rng.uniform(0.0, 0.1, 3)
    modes = [(W * rng.uniform(0.2, 4), 10 ** rng.uniform(-2, 0)) for _ in range(rng.integers(0, 3))]
    nodes = [creep(w.tolist(), T.tolist())]
    for k, (wn, zeta) in enumerate(modes):
        values = {"b": [wn**2], "a": [1.0, 2 * zeta * wn, wn**2]}
        nodes.append(hy.Node(f"g{k}", "transfer_function", {"na": 2, "nb": 0}, values))
    late = int(rng.integers(0, 4))
    pid = {
        "Kp": rng.uniform(0, 1),
        "Ki": 10 ** rng.uniform(0, 4),
        "Kd": 10 ** rng.uniform(-6, -3),
        "tau": 10 ** rng.uniform(-5, -3),
    }
    found = hy.design.margins(hy.design.loop(in_series(*nodes), hy.Node("pid", "pid", {}, pid), H, delay=late))
    space = own_space(w, T, [lag2(*m) for m in modes])

    def poles(gain: float) -> np.ndarray:
        return closed_poles(space, pid, late, gain)

    assert found.stable == (np.abs(poles(1.0)).max() < 1), seed
    if found.stable:
        assert_limits(poles, found)
    else:
        assert str(found) == "unstable: no margins"
        assert np.isnan([found.gain_db, found.gain_low_db, found.phase_deg, found.delay_steps]).all()
        assert found.Ms_db == np.inf
        assert not found.conditional


def test_a_plant_that_feedback_alone_holds_loses_it_where_the_gain_falls() -> None:
    """G = 2 / (0.05 s - 1), L(1) = -2 Kp: the limit below lies at frequency 0, on no curve; above, at z = -1."""
    plant = hy.Node("g", "transfer_function", {"na": 1, "nb": 0}, {"b": [2.0], "a": [0.05, -1.0]})
    found = hy.design.margins(hy.design.loop(plant, hy.Node("c", "pid", {}, {"Kp": 3.0}), H))
    assert found.conditional
    assert found.gain_low_db == pytest.approx(-20 * np.log10(6.0), abs=1e-6)
    e = np.exp(H / 0.05)  # x+ = e x + 2 (e - 1) u: the pole e - 2 Kp (e - 1) reaches -1
    assert found.gain_db == pytest.approx(20 * np.log10((1 + e) / (2 * (e - 1)) / 3.0), abs=1e-6)


def test_a_static_plant_answers_the_last_command() -> None:
    """I control of a gain: z - 1 + k h g, lost at k h g = 2; two steps of delay inside: at 2 sin(pi/10)."""
    gain = hy.Node("gain", "scaling", {"n": 1}, {"gain": 2.0})
    pid = hy.Node("c", "pid", {}, {"Kp": 0.0, "Ki": 1000.0})
    for nodes, limit in (((gain,), 2.0), ((gain, hy.Node("late", "delay", {"n": 2})), 2 * np.sin(np.pi / 10))):
        found = hy.design.margins(hy.design.loop(in_series(*nodes), pid, H))
        assert found.gain_db == pytest.approx(20 * np.log10(limit / (1000.0 * H * 2.0)), abs=1e-6)


def test_a_plant_of_several_inputs_is_refused() -> None:
    plant = hy.Node("sum", "sum", {"n": 2})
    graph = hy.Graph(
        [plant], [], [hy.Input("a", ("sum.u[1]",)), hy.Input("b", ("sum.u[2]",))], [hy.Output("y", "sum.y")]
    )
    with pytest.raises(hy.InputError, match=r"^The plant of a loop must have one input and one output\. Got 2 and 1"):
        hy.design.loop(graph, hy.Node("c", "pid"), H)

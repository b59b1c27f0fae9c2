"""Gain margins against responses and poles of their own: state spaces with creep, plants that answer at once."""

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from invoked import invoked
from scipy.linalg import expm
from scipy.signal import cont2discrete
from series import series

import hystfmu as hy
from hystfmu.cli import main

pytestmark = pytest.mark.skipif(find_spec("control") is None, reason="python-control is not installed")
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
    run = invoked(["margins", str(ROOT / "internal_model"), "--case", "sine_10", "--json"])
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
        "conditionally stable, that is, unstable if the gain decreases by more than 'gain down': internal_model"
        in run.output
    )
    assert "-10.5" in run.output
    run = CliRunner().invoke(main, ["margins", str(ROOT / "pid"), "--case", "sine_10"])
    assert "conditionally" not in run.output


def creep(w: list[float], T: list[float], w0: float = 1.0) -> hy.Node:
    return hy.Node("creep", "creep", {"n": len(w)}, {"w0": w0, "w": w, "T": T})


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
    L = hy.design.loop(series(*nodes, step=H), hy.Node("pid", "pid", {}, pid), H, delay=late)
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
    found = hy.design.margins(hy.design.loop(series(*nodes, step=H), hy.Node("pid", "pid", {}, pid), H, delay=late))
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
        found = hy.design.margins(hy.design.loop(series(*nodes, step=H), pid, H))
        assert found.gain_db == pytest.approx(20 * np.log10(limit / (1000.0 * H * 2.0)), abs=1e-6)


def test_a_plant_of_several_inputs_is_refused() -> None:
    plant = hy.Node("sum", "sum", {"n": 2})
    graph = hy.Graph(
        [plant], [], [hy.Input("a", ("sum.u[1]",)), hy.Input("b", ("sum.u[2]",))], [hy.Output("y", "sum.y")]
    )
    with pytest.raises(hy.InputError, match=r"^The plant of a loop must have one input and one output\. Got 2 and 1"):
        hy.design.loop(graph, hy.Node("c", "pid"), H)


# ---- plants that answer at once --------------------------------------------------------------------------------------
STEP, FINE = 0.01, 20
SPAN = {"span_u": [-3.0, 3.0], "h": STEP}
PLAYS = {"w0": 1.0, "r": [0.3, 0.9], "w": [0.3, 0.2]}


def loop(plant: Any, Kp: float, Ki: float, late: int = 0, **more: Any) -> hy.Scenario:
    """PI law and a plant at twenty times its rate, behind a delay of some of these fine steps."""
    made = hy.Scenario("creeping", step=STEP, stop=1.0, ripple=FINE).add("plant", plant, fine=True)
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
    return hy.Model("actuator", hy.Graph(nodes, [("hysteresis.y", "creep.u")], *ends), provenance=SPAN, step=STEP)


def ends_of(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: float, Kp: float, Ki: float, late: float) -> np.ndarray:
    """Poles of the sampled loop, stepped in twentieths: commands come late, and a sample sees what has come."""
    n, steps = len(A), int(np.ceil(late)) + 2
    M = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * STEP / FINE)
    shift = round(late * FINE)

    def step(s: np.ndarray) -> np.ndarray:
        x, sent, total = s[:n], s[n : n + steps], s[-1]  # commands of this step and of those before, newest first
        for k in range(FINE):
            v = sent[(FINE - 1 + shift - k) // FINE] if shift else sent[0]
            x = M[:n, :n] @ x + M[:n, n] * v
        y = (C @ x)[0] + D * v
        total = total - STEP * y
        return np.concatenate([x, [-Kp * y + Ki * total], sent[:-1], [total]])

    return np.linalg.eigvals(np.column_stack([step(e) for e in np.eye(n + steps + 1)]))


def assert_upper_limit(found: dict[str, Any], poles: Any) -> None:
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
    assert_upper_limit(found, lambda gain: ends_of(*space, gain * Kp, gain * Ki, late / FINE))


@pytest.mark.parametrize("late", [0, 7, 20, 33])
@pytest.mark.parametrize("lead", [0.0, 0.3])
def test_an_integrator_and_a_pi_plant_behind_a_delay_have_margins(tmp_path: Path, late: int, lead: float) -> None:
    """G = (1 + lead s) / s under a PI law."""
    nb, b = (0, [1.0]) if not lead else (1, [lead, 1.0])
    plant = hy.blocks.TransferFunction(na=1, nb=nb, b=b, a=[1.0, 0.0])
    run = margins(loop(plant, 1.3, 0.9, late), tmp_path / "loop", "--json")
    assert run.exit_code == 0, run.output
    space = np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)), lead
    assert_upper_limit(figures(run), lambda gain: ends_of(*space, gain * 1.3, gain * 0.9, late / FINE))


def row_behind_inverse(
    folder: Path, plant: hy.Model, inverse: hy.Model, amplitude: float, Kp: float, Ki: float
) -> dict[str, Any]:
    """Margins of a loop of reference, PI law, inverse and plant."""
    made = hy.Scenario("creeping", step=STEP, stop=4.0).add("plant", plant)
    made.add("reference", hy.blocks.Reference(amplitude=amplitude, frequency=0.5))
    made.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki)).add("inverse", inverse)  # units step in this order
    for ends in (
        ("reference.r", "pid.y_d"),
        ("reference.r", "pid.u_ff"),
        ("plant.y", "pid.y"),
        ("pid.u", "inverse.u"),
        ("inverse.y", "plant.u"),
    ):
        made.connect(*ends)
    made.metric("tracking", "rms", "plant.y", "reference.r")
    run = margins(made, folder / "loop", "--json")
    assert run.exit_code == 0, run.output
    (row,) = json.loads(run.output)["loops"]
    return dict(row)


def test_creep_that_only_the_inverse_has_stays_in_the_loop(tmp_path: Path) -> None:
    """The plant has plays alone, the inverse undoes creep: slopes of 1 / (1 + w), and the inverse of creep in L.

    Margins hold for slope 1, so that L has the static gain of the inverse undone.
    """
    w, T, Kp, Ki = 0.4, 0.5, 0.1, 12.0
    plays = hy.Graph.single(hy.Node("plays", "prandtl_ishlinskii", {}, PLAYS))
    plant = hy.Model("prandtl_ishlinskii", plays, provenance=SPAN, step=STEP)
    row = row_behind_inverse(tmp_path, plant, creeping(np.array([w]), np.array([T])).inverse(), 1.0, Kp, Ki)
    assert row["slopes"] == pytest.approx([1 / (1 + w)] * 2, rel=1e-6)
    z = np.exp(1j * np.geomspace(1e-5, 1, 40_000) * np.pi)
    s = -np.expm1(-STEP / T)
    # y = (u - w (1 - s) q_last) / (1 + w s) gives u over a step of creep, whose lag is q = q_last + s (y - q_last)
    q = s / (1 + w * s) / (1 - (1 - s) / z + s * w * (1 - s) / (1 + w * s) / z)
    L = (Kp + Ki * STEP * z / (z - 1)) * (1 - w * q) / z  # what the plays and their inverse leave is a gain of 1
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
    plant = hy.Model("actuator", graph, provenance=SPAN, step=STEP)
    row = row_behind_inverse(tmp_path, plant, model.inverse(), 5.0, 0.1, 12.0)
    assert row["slopes"] == pytest.approx([0.0, 0.8], abs=1e-6), seed


GAIN = hy.blocks.TransferFunction(na=1, nb=0, b=[2.0], a=[0.05, 1.0])


def test_a_loop_that_is_unstable_on_its_own_path_fails(tmp_path: Path) -> None:
    run = margins(loop(GAIN, 0.5, 4000.0), tmp_path / "loop")
    assert run.exit_code == 1
    line = (
        "creeping: margins.stable_to_steps: must be at least 0 at nominal, sector 2.00 to 2.00. Got an unstable loop."
    )
    assert line in run.output.splitlines()
    assert "ok" not in run.output.split()
    named = margins(loop(GAIN, 0.5, 4000.0).margins(expected_unstable=["nominal"]), tmp_path / "named")
    assert named.exit_code == 0, named.output
    assert named.output.split()[-1] == "expected"


@pytest.mark.parametrize(("name", "why"), [("nominal", "is stable, or has no loop"), ("missing", "does not exist")])
def test_a_case_that_is_expected_to_be_unstable_must_be(tmp_path: Path, name: str, why: str) -> None:
    run = margins(loop(GAIN, 0.5, 1.0).margins(expected_unstable=[name]), tmp_path / "loop")
    assert run.exit_code == 2
    assert f"margins.expected_unstable: The case must have an unstable loop. Got '{name}', which {why}." in run.output
    assert "Traceback" not in run.output


def test_loops_of_two_inputs_and_outputs_are_refused_in_one_line() -> None:
    run = invoked(["margins", str(Path(__file__).parents[2] / "scenarios/stage/xy_raster")], status=1)
    (line,) = run.output.splitlines()
    assert line.startswith("no margins: stage_xy_raster, 1 case: The loop must have one input and one output to have ")
    assert line.endswith("Got 2 outputs with references of their own: x.y, y.y.")

"""Margins of whole scenario loops: tangents of sampled blocks, held dynamics, known loops, loops broken at a signal."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from invoked import invoked
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

import hystfmu as hy
from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.design import loop, margins, to_control
from hystfmu.design.delays import sampled
from hystfmu.design.loop import grid, response_of
from hystfmu.design.repetitive import PeriodMemory, iterative_learning, repetitive
from hystfmu.scenario.loop.opened import OpenedLoop
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.loop.plant import PlantSide, held
from hystfmu.scenario.loop.table import simulated_delay
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.spec import UnitSpec
from hystfmu.scenario.system.system import System, build

ROOT = Path(__file__).parents[2]
H = 1e-4
Z = np.exp(2j * np.pi * np.array([3.0, 70.0, 900.0, 4100.0]) * H)
W = 2 * np.pi * 500
PID = Node("c", "pid", {}, {"Kp": 1.26, "Ki": 9692.0, "Kd": 7.036e-4})
G0 = Node("g0", "transfer_function", {}, {"b": [W**2], "a": [1, 1.4 * W, W**2]})


def response(system, z):
    A, B, C, D = system
    return np.array([C @ np.linalg.solve(v * np.eye(len(A)) - A, B) + D for v in z])


@pytest.mark.parametrize("node", [
    PID,
    Node("c", "lead_lag", {"n": 2}, {"K": 7.2, "T_z": [2e-4, 1e-3], "T_p": [2e-3, 1e-4]}),
    Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 1e-6, "epsilon": 0.3, "k_i": 1e7}),
    Node("c", "super_twisting", {}, {"lam": 90.0, "k_1": 0.1, "k_2": 3.0, "mu": 1.0, "epsilon": 0.3}),
    Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 1e-3}),
    Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 0.0}),
    Node("c", "super_twisting", {}, {"lam": 90.0, "k_1": 0.1, "k_2": 3.0}),
], ids=lambda n: n.type)  # fmt: skip
def test_the_tangent_of_a_controller_is_its_closed_form(node):
    graph = Graph.single(node)
    measured = [i.name for i in graph.inputs].index("y")
    found = response(sampled(graph, H), Z)[:, 0, measured]
    assert found == pytest.approx(-to_control(node, H)(Z), rel=1e-5)


def test_a_graph_with_delays_becomes_their_product():
    nodes = [PID, Node("late", "delay", {"n": 3})]
    ends = [Input("y_d", ("c.y_d",)), Input("y", ("c.y",)), Input("f", ("c.u_ff",))], [Output("u", "late.y")]
    graph = Graph(nodes, [("c.u", "late.u")], *ends)
    assert response(sampled(graph, H), Z)[:, 0, 0] == pytest.approx(to_control(PID, H)(Z) / Z**3, rel=1e-9)


def test_an_unstable_graph_has_a_tangent_though_it_soon_reaches_its_limits():
    """y = clamp(u + 10 y_(k-2)): in 40 steps the smallest motion grows beyond the limits."""
    limits = Node("limits", "scaling", {"n": 1}, {"lo": -1.0, "hi": 1.0})
    nodes = [Node("past", "delay"), Node("sum", "sum", {"n": 2}, {"k": [1.0, 10.0]}), limits]
    # first in the order, the delay gives the value before the last one
    wires = [("past.y", "sum.u[2]"), ("sum.y", "limits.u"), ("limits.y", "past.u")]
    graph = Graph(nodes, wires, [Input("u", ("sum.u[1]",))], [Output("y", "limits.y")], sort=False)
    assert response(sampled(graph, H), Z)[:, 0, 0] == pytest.approx(1 / (1 - 10 / Z**2), rel=1e-9)


def test_a_memory_has_no_tangent():
    plays = Node("plays", "backlash_sum", values={"w0": 0.4, "r": [0.0, 1e-13], "w": [0.5, 0.2]})
    with pytest.raises(InputError, match="must be linear at rest"):
        sampled(Graph.single(plays), H)


def of(name, case):
    scenario = Cases(ROOT / "scenarios" / name)
    return open_loop(build(next(c for c in scenario.cases if c.name == case)))


def test_the_loop_of_a_scenario_is_that_of_its_blocks():
    found = of("pid", "sine_100")
    unit = found.system.case.units["pid"]
    pid = Node("c", "pid", {}, unit.values)
    for delay in (0, 1):  # beyond the step that the scenario has
        one, other = margins(found.open_loop(1.0, delay)), margins(loop(G0, pid, H, delay=1 + delay))
        assert vars(one) == pytest.approx(vars(other), rel=1e-6, abs=1e-9)


def test_without_an_inverse_in_the_loop_its_slopes_are_those_of_the_plant():
    assert of("sliding_mode_2005", "sine_100").slopes == pytest.approx((0.3, 1.3), abs=0.01)


def test_the_slopes_of_a_plant_over_its_identified_inverse_lie_around_one():
    low, high = of("pid_observer", "sine_10").slopes
    assert 0.8 < low < 1 < high < 1.35


def zoh(z):
    """Closed form of G0 behind a hold: partial fractions of an underdamped second-order lag."""
    a, b = 0.7 * W, W * np.sqrt(1 - 0.7**2)
    e, c, s = np.exp(-a * H), np.cos(b * H), np.sin(b * H)
    b1, b0 = 1 - e * (c + a / b * s), e**2 + e * (a / b * s - c)
    return (b1 * z + b0) / (z**2 - 2 * e * c * z + e**2)


def pid_of(values, z):
    Kp, Ki, Kd, tau = (values.get(k, 0.0) for k in ("Kp", "Ki", "Kd", "tau"))
    return Kp + Ki * H * z / (z - 1) + Kd * (z - 1) / (H * z + tau * (z - 1))


def peak_db(L):
    """Peak of the sensitivity of L(z), from a grid and a golden section around its largest value."""
    w = np.linspace(1e-4, 1, 20_001)[1:] * np.pi

    def size(a):
        return -np.abs(1 / (1 + L(np.exp(1j * np.atleast_1d(a)))))

    k = int(np.argmin(size(w)))
    found = minimize_scalar(
        lambda a: size(a)[0], bounds=(w[k - 1], w[k + 1]), method="bounded", options={"xatol": 1e-12}
    )
    return 20 * np.log10(-found.fun)


@pytest.mark.parametrize(("Kp", "Ki"), [(0.0, 2500.0), (0.3, 500.0)])
def test_the_filter_of_an_inverse_of_dynamics_is_a_part_of_the_loop(Kp: float, Ki: float):
    """Peaks of 5.2 and 3.1 dB; without the FIR filter they would be 10.2 and 1.3 dB."""
    plays = Node("plays", "prandtl_ishlinskii", {"n": 2}, {"w0": 0.7, "r": [0.1, 0.4], "w": [0.2, 0.1]})
    stack = Graph([plays, G0], [("plays.y", "g0.u")], [Input("u", ("plays.u",))], [Output("y", "g0.y")])
    plant = hy.Model("g0_plays", stack, H, provenance={"span_u": [-2.0, 2.0]})
    made = hy.Scenario("filtered", step=H, stop=0.1).add("plant", plant)
    made = made.add("reference", hy.blocks.Reference(frequency=20.0, amplitude=0.5))
    made = made.add("pid", hy.blocks.Pid(Kp=Kp, Ki=Ki), inputs={"u_ff": 0.0}).add("inverse", plant.inverse())
    made = made.connect("plant.y", "pid.y").connect("reference.r", "pid.y_d").connect("pid.u", "inverse.u")
    made = made.connect("inverse.y", "plant.u").metric("tracking", "max_percent", "plant.y", against="reference.r")
    opened = open_loop(build(made.ready().cases[0]))
    assert opened.slopes == pytest.approx((1, 1), abs=1e-6)
    *taps, _ = plant.inverse().graph.node("dynamics").value("theta")
    expected = peak_db(lambda z: pid_of({"Kp": Kp, "Ki": Ki}, z) * np.polyval(taps, z) / z ** (len(taps) - 1) * zoh(z))
    assert opened.margins().Ms_db == pytest.approx(expected, rel=1e-6)


def test_the_peak_of_a_loop_with_observer_is_that_of_its_equations():
    """Observer and law at each z as four linear equations in x and u, for y = 1.

    The estimator is x+ = F (x + (0 0 u_last)), d+ = d, corrected by M, which places all poles.
    """
    found = of("pid_observer", "sine_100")
    units, p = found.system.case.units, W * H
    F = expm(np.array([[0, p, 0], [-p, -1.4 * p, p], [0, 0, 0]]))
    pole = np.exp(-2 * np.pi * units["observer"].values["f_o"] * H)
    row = np.array([[1.0, 0, 0]])
    M = np.linalg.matrix_power(F - pole * np.eye(3), 3) @ np.linalg.inv(
        np.vstack([row @ F, row @ F @ F, row @ F @ F @ F])
    )
    M = M[:, 2:]
    ahead = F.copy()
    ahead[2] = [0, 0, 1]
    driven = np.array([[F[0, 2]], [F[1, 2]], [0.0]])
    keep = np.eye(3) - M @ row

    def L(z):
        z = np.atleast_1d(z)
        c = pid_of(units["pid"].values, z)
        E = np.zeros((len(z), 4, 4), complex)
        E[:, :3, :3] = np.eye(3) - keep @ ahead / z[:, None, None]
        E[:, :3, 3:] = -keep @ driven / z[:, None, None] ** units["observer"].dims["n"]
        E[:, 3, 2], E[:, 3, 3] = 1, 1
        right = np.concatenate([np.repeat(M[None], len(z), 0), -c[:, None, None]], 1)
        return -np.linalg.solve(E, right)[:, 3, 0] * zoh(z) * z ** -delays_of(found)

    assert found.margins().Ms_db == pytest.approx(peak_db(L), abs=1e-6)


def delays_of(found):
    """Steps of the delay units of a case."""
    return sum(u.dims.get("n", 1) for u in found.system.case.units.values() if u.block == "delay")


def test_the_command_prints_a_row_for_every_loop_and_says_what_has_none():
    run = invoked(["margins", str(ROOT / "scenarios/pid"), "--case", "sine_100", "--json"])
    (row,) = json.loads(run.output)["loops"]
    assert row["cases"] == ["sine_100"]
    assert row["margins"]["stable"]
    assert row["margins"]["gain_db"] > 6
    run = invoked(["margins", str(ROOT / "scenarios/open_loop"), "--case", "sine_100"], status=1)
    assert (
        "no margins: open_loop, 1 case: The case must have feedback. Got an open loop: plant does not act on itself."
        in run.output
    )
    assert "Traceback" not in run.output


def test_noise_gain_is_the_mean_over_all_frequencies_also_with_states_of_many_sizes():
    found = of("stage/h_infinity", "scan_100")
    z = np.exp(1j * np.pi * (np.arange(8000) + 0.5) / 8000)
    K, G = (response(part, z)[:, 0, 0] for part in (found.controller, held(found.plant, H, 0.0)))
    assert found.noise_gain() == pytest.approx(np.sqrt(np.mean(np.abs(K / (1 - K * G)) ** 2)), rel=1e-6)


# ---- broken at a signal, memories, delays ----------------------------------------------------------------------------
def system_of(name: str, case: str) -> System:
    return build(next(c for c in Cases(ROOT / "scenarios" / name).cases if c.name == case))


def test_a_chain_broken_anywhere_has_the_same_margins():
    system = system_of("pid_observer", "sine_10")
    whole, cut = (open_loop(system, (1.0, 1.0), at=at).margins() for at in ("", "sensor.y"))
    assert cut.Ms_db == pytest.approx(whole.Ms_db, rel=1e-9)
    assert cut.delay_steps == pytest.approx(whole.delay_steps, rel=1e-9)


def test_the_outer_loop_around_an_observer_is_that_of_its_responses():
    """1 + L is the return difference of the whole loop over that of the inner one, the observer without the law."""
    system = system_of("pid_observer", "sine_10")
    found = open_loop(system, (1.0, 1.0), at="pid.u")
    angles = grid()[::97]
    K = response_of(found.controller, np.exp(1j * angles))[:, 0, 0]
    G = response_of(found.held(0.0), np.exp(1j * angles))[:, 0, 0]
    observer = open_loop(replace_values(system, {"pid.Kp": 0.0, "pid.Ki": 0.0, "pid.Kd": 0.0}), (1.0, 1.0))
    F = response_of(observer.controller, np.exp(1j * angles))[:, 0, 0]
    expected = (1 - K * G) / (1 - F * G) - 1
    assert found.response()[::97] == pytest.approx(expected, rel=1e-6, abs=1e-9)


def replace_values(system: System, values: dict[str, float]) -> System:
    return build(replace(system.case, overrides=values))


def test_a_signal_outside_the_loop_is_refused_in_one_line():
    system = system_of("pid_observer", "sine_10")
    for at, why in (("reference.r", "must be an output of"), ("observer.d_hat", "which none reads")):
        with pytest.raises(InputError, match=why):
            open_loop(system, (1.0, 1.0), at=at)


def test_the_law_of_a_repetitive_block_is_its_impulse_response():
    rng = np.random.default_rng(int(np.random.SeedSequence().generate_state(1)[0]))
    q, l = rng.uniform(0, 0.3, 3), rng.normal(size=5)  # noqa: E741
    q *= 0.8 / (q[0] + 2 * q[1:].sum())
    node = Node("c", "repetitive", {"n": 20, "n_q": 2, "n_l": 2}, {"q": q, "l": l})
    graph = Graph.single(node)
    names = [i.name for i in graph.inputs]
    u = np.zeros((4000, len(names)))
    u[:, names.index("active")] = 1.0
    u[30, names.index("y")] = -1.0  # e = 1
    w = graph.run(u, H).reshape(len(u))[30:]
    for angle in (0.03, 0.7, 2.9):
        expected = np.sum(w * np.exp(-1j * angle * np.arange(len(w))))
        assert repetitive(node).response(np.array([angle]))[0] == pytest.approx(expected, rel=1e-6)


def test_observer_and_repetitive_part_become_systems_of_python_control():
    rng = np.random.default_rng(7)
    node = Node("c", "repetitive", {"n": 30, "n_q": 1, "n_l": 3}, {"q": [0.5, 0.2], "l": rng.normal(size=7)})
    angles = np.array([0.02, 0.9, 3.0])
    assert to_control(node, H)(np.exp(1j * angles)) == pytest.approx(repetitive(node).response(angles), rel=1e-9)
    observer = Node("o", "disturbance_observer", {}, {"f_n": 500.0, "zeta": 0.7, "gain": 1.0, "f_o": 2925.0})
    slow = to_control(observer, H)(np.exp(1e-6j)) * 1e-6
    fast = to_control(observer, H)(np.exp(1e-5j)) * 1e-5
    assert slow == pytest.approx(fast, rel=1e-3)  # integral action: 1 / (z - 1) at low frequencies
    with pytest.raises(InputError, match="from period to period"):
        to_control(Node("c", "iterative_learning", {"n": 20}), H)


def test_the_law_of_iterative_learning_is_that_of_its_periods():
    node = Node("c", "iterative_learning", {"n": 20}, {"gain": 0.4, "lead": 3, "smooth": 0.1})
    graph, law, rng = Graph.single(node), iterative_learning(node), np.random.default_rng(5)
    names = [i.name for i in graph.inputs]
    periods = rng.normal(size=(4, 20))
    u = np.zeros((81, len(names)))
    u[1:, names.index("y_d")] = periods.ravel()
    out = graph.run(u, H).reshape(len(u))
    angles = 2 * np.pi * np.arange(20) / 20
    w, e = (np.array([np.fft.fft(x[k : k + 20]) for k in (0, 20, 40)]) for x in (out, u[:, names.index("y_d")]))
    learnt = (
        law.factor(angles, np.zeros(20)) * w[:-1]
        + (law.factor(angles, np.ones(20)) - law.factor(angles, np.zeros(20))) * e[:-1]
    )
    assert w[1:] == pytest.approx(learnt, abs=1e-9)


def synthetic(gain: float, q: float, taps: list[float], n: int) -> OpenedLoop:
    """PI controller with a repetitive part in its reference around a first-order plant; built by hand."""
    A, B = np.array([[1.0]]), np.array([[-H, H]])
    C, D = np.array([[300.0], [0.0]]), np.array([[-0.3 - 300 * H, 0.3 + 300 * H], [-1.0, 0.0]])
    plant = (np.array([[-W]]), np.array([[W]]), np.eye(1), np.zeros((1, 1)))
    memory = PeriodMemory(n, np.array([q]), gain * np.array(taps), lifted=False)
    return OpenedLoop(None, (A, B, C, D), plant, H, (1.0, 1.0), (), PlantSide((), 0.0), (memory,))  # type: ignore[arg-type]


@pytest.mark.parametrize(("gain", "q"), [(0.3, 0.95), (0.3, 1.04), (2.5, 0.9), (1.2, 1.0), (1.9, 1.0)])
def test_stability_with_a_memory_is_that_of_all_its_states(gain: float, q: float):
    n, taps = 12, [0.3, 0.5, 0.2]
    loop = synthetic(gain, q, taps, n)
    A, B, C, D = loop.controller
    F, G, out, _ = held(loop.plant, H, 0.0)

    def step(s: np.ndarray) -> np.ndarray:
        x, k, w, e = s[:1], s[1:2], s[2 : 2 + n + 1], s[3 + n :]
        y = (out @ x)[0]
        now_w = q * w[n - 1] + gain * (taps[0] * e[n] + taps[1] * e[n - 1] + taps[2] * e[n - 2])
        into = np.array([y, now_w])
        u, now_e = C @ k + D @ into
        return np.concatenate([F @ x + G[:, 0] * u, A @ k + B @ into, [now_w], w[:-1], [now_e], e[:-1]])

    size = 2 + 2 * (n + 1)
    largest = np.abs(np.linalg.eigvals(np.column_stack([step(v) for v in np.eye(size)]))).max()
    assert abs(largest - 1) > 1e-6
    assert loop.stable(1.0, 0.0) == (largest < 1)
    if loop.learning() < 1:  # the bound is sufficient
        assert largest <= loop.radius(1.0, 0.0) + 1e-9


def linear_loop() -> hy.Scenario:
    """PID around G0 without hysteresis, off its reference by a disturbance at the start."""
    plant = hy.blocks.TransferFunction(na=2, nb=0, b=[W**2], a=[1.0, 1.4 * W, W**2])
    loop = hy.Scenario("linear", step=H, stop=0.3, ripple=50).add("plant", plant, fine=True)
    loop = loop.add("reference", hy.blocks.Reference(amplitude=0.0, offset=1.0), fine=True)
    loop = loop.add("pid", hy.blocks.Pid(Kp=1.26, Ki=9692.0, Kd=7.036e-4), inputs={"u_ff": 0.0})
    loop = loop.connect("plant.y", "pid.y").connect("reference.r", "pid.y_d").connect("pid.u", "plant.u")
    return loop.metric("tracking", "max_percent", "plant.y", against="reference.r", stroke=2.0, after=0.05)


def test_the_simulated_delay_margin_of_a_linear_loop_is_the_predicted_one():
    """The loop starts to grow where the Nyquist plot says; steps of 1/50 of a sample, 1 % of the margin."""
    system = build(linear_loop().ready().cases[0])
    opened = open_loop(system, (1.0, 1.0))
    predicted = opened.margins().delay_steps
    assert 1.5 < predicted < 2.5
    found = simulated_delay(system, opened.side.entry, growth=1.0, far=np.inf)
    assert found == pytest.approx(predicted, rel=0.02)


@pytest.mark.parametrize(
    "order", [("plant", "reference", "pid"), ("reference", "pid", "plant"), ("pid", "plant", "reference")]
)
def test_a_delay_at_the_rate_of_the_plant_counts_in_its_steps(order: tuple[str, ...]):
    """Behind the controller, wherever the plant stands: 20 of 50 fine steps are 0.4 steps further."""
    case = replace(build(linear_loop().ready().cases[0]).case, order=order)
    plain = open_loop(build(case), (1.0, 1.0))
    spec = UnitSpec.model_validate({"block": "delay", "dims": {"n": 20}, "fine": True})
    at = order.index("pid") + 1
    ends = {**case.connections, "plant.u": "late.y", "late.u": "pid.u"}
    late = replace(case, units=case.units | {"late": spec}, order=(*order[:at], "late", *order[at:]), connections=ends)
    found = open_loop(build(late), (1.0, 1.0))
    assert found.side.delay == pytest.approx(plain.side.delay + 0.4)
    assert found.margins().Ms_db == pytest.approx(plain.margins(delay=0.4).Ms_db, rel=1e-9)


def test_with_hysteresis_the_simulated_delay_margin_is_within_those_of_the_slopes():
    """The loop turns unstable between the margins of its least and its largest slope, a tenth of a step of the grid."""
    system = system_of("pid", "sine_10")
    opened = open_loop(system)
    margins = [opened.margins(float(slope)).delay_steps for slope in np.linspace(*opened.slopes, 5)]
    found = simulated_delay(system, opened.side.entry)
    assert min(margins) - 0.1 < found < max(margins) + 0.1

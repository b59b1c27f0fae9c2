"""Margins of whole scenario loops: tangents of sampled blocks, held dynamics with fractional delay, known loops."""

import json
from pathlib import Path

import control
import numpy as np
import pytest
from click.testing import CliRunner
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

from hystfmu import Graph, Input, InputError, Node, Output
from hystfmu.cli import main
from hystfmu.design import loop, margins, to_control
from hystfmu.design.delays import sampled
from hystfmu.scenario.loop.opening import open_loop
from hystfmu.scenario.loop.plant import held
from hystfmu.scenario.system.case import Cases
from hystfmu.scenario.system.system import build

ROOT = Path(__file__).parents[2]
H = 1e-4
Z = np.exp(2j * np.pi * np.array([3.0, 70.0, 900.0, 4100.0]) * H)
W = 2 * np.pi * 500
PID = Node("c", "pid", {}, {"Kp": 1.26, "Ki": 9692.0, "Kd": 7.036e-4})
G0 = Node("g0", "transfer_function", {}, {"b": [W**2], "a": [1, 1.4 * W, W**2]})


def response(system, z):
    A, B, C, D = system
    return np.array([C @ np.linalg.solve(v * np.eye(len(A)) - A, B) + D for v in z])


@pytest.mark.parametrize(
    "node",
    [
        PID,
        Node("c", "lead_lag", {"n": 2}, {"K": 7.2, "T_z": [2e-4, 1e-3], "T_p": [2e-3, 1e-4]}),
        Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 1e-6, "epsilon": 0.3, "k_i": 1e7}),
        Node("c", "super_twisting", {}, {"lam": 90.0, "k_1": 0.1, "k_2": 3.0, "mu": 1.0, "epsilon": 0.3}),
        Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 1e-3}),
        Node("c", "sliding_mode", {}, {"lam": 90.0, "eta": 1e-3, "rho": 0.0}),
        Node("c", "super_twisting", {}, {"lam": 90.0, "k_1": 0.1, "k_2": 3.0}),
    ],
    ids=lambda n: n.type,
)
def test_the_tangent_of_a_controller_is_its_closed_form(node):
    graph = Graph.single(node)
    measured = [i.name for i in graph.inputs].index("y")
    found = response(sampled(graph, H), Z)[:, 0, measured]
    assert found == pytest.approx(-to_control(node, H)(Z), rel=1e-5)


def test_the_tangent_of_the_observer_is_that_of_its_equations():
    """Written out from the estimator: x+ = F (x + (0 0 u_last)), d+ = d, corrected by M; M places all poles."""
    f_o, rng = 2925.0, np.random.default_rng(0)
    p = W * H
    F = expm(np.array([[0, p, 0], [-p, -1.4 * p, p], [0, 0, 0]]))
    z = np.exp(-2 * np.pi * f_o * H)
    row = np.array([[1.0, 0, 0]])
    seen = np.vstack([row @ F, row @ F @ F, row @ F @ F @ F])
    M = np.linalg.matrix_power(F - z * np.eye(3), 3) @ np.linalg.inv(seen)[:, 2]
    u_c, y = 1e-3 * rng.normal(size=(2, 60))
    u_c[:3] = y[:3] = 0.0
    x, last, expected = np.zeros(3), 0.0, []
    for c, m in zip(u_c, y, strict=True):
        ahead = F @ (x + np.array([0, 0, last]))
        ahead[2] = x[2]
        x = ahead + M * (m - ahead[0])
        last = c - x[2]
        expected.append(last)
    graph = Graph.single(Node("o", "disturbance_observer", {}, {"f_n": 500.0, "zeta": 0.7, "gain": 1.0, "f_o": f_o}))
    A, B, C, D = sampled(graph, H)
    names = [i.name for i in graph.inputs]
    state, found = np.zeros(len(A)), []
    for c, m in zip(u_c, y, strict=True):
        v = np.zeros(len(names))
        v[names.index("u_c")], v[names.index("y")] = c, m
        found.append((C @ state + D @ v)[0])
        state = A @ state + B @ v
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-9)


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


@pytest.mark.parametrize("delay", [0.0, 0.25, 0.5, 1.0, 1.75, 3.0])
def test_held_dynamics_with_a_fraction_of_a_step(delay):
    """Against the same dynamics in hundredths of a step, whose command changes late."""
    A = np.array([[0, 1.0], [-(W**2), -1.4 * W]])
    plant = A, np.array([[0], [W**2]]), np.array([[1.0, 0]]), np.zeros((1, 1))
    u = np.random.default_rng(1).normal(size=30)
    fine = 100
    shift = round(delay * fine)
    command = np.concatenate([np.zeros(shift), np.repeat(u, fine)])[: fine * len(u)]
    short = control.sample_system(control.ss(*plant), H / fine, "zoh")
    x, expected = np.zeros(2), []
    for k, v in enumerate(command):
        if k % fine == 0:
            expected.append(x[0])
        x = short.A @ x + short.B[:, 0] * v
    F, G, C, _ = held(plant, H, delay)
    x, found = np.zeros(len(F)), []
    for v in u:
        found.append((C @ x)[0])
        x = F @ x + G[:, 0] * v
    assert found == pytest.approx(expected, abs=1e-11)


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


@pytest.mark.parametrize("delay", [0, 1])
def test_the_peak_of_a_pid_loop_is_that_of_its_closed_forms(delay):
    found = of("pid", "sine_100")
    values = found.system.case.units["pid"].values
    own = delays_of(found) + delay
    expected = peak_db(lambda z: pid_of(values, z) * zoh(z) * z**-own)
    assert found.margins(1.0, delay).Ms_db == pytest.approx(expected, abs=1e-6)


def test_the_peak_of_a_loop_with_observer_is_that_of_its_equations():
    """Observer and law at each z as four linear equations in x and u, for y = 1: see the test of the observer above."""
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


def test_stability_agrees_with_a_run():
    """A slope of 1.3 with the delay at which the tangent turns unstable: a linear loop run step by step diverges."""
    found = of("pid_observer", "sine_100")
    for delay, stable in ((0.5, True), (4.0, False)):
        assert found.stable(1.3, delay) is stable
        A, B, C, D = found.controller
        F, G, out, _ = held(found.plant, H, delay)
        x, k, u = np.ones(len(F)), np.zeros(len(A)), 0.0
        for _ in range(4000):
            y = 1.3 * (out @ x)[0]
            u = float((C @ k)[0] + D[0, 0] * y)
            k = A @ k + B[:, 0] * y
            x = F @ x + G[:, 0] * u
        assert (abs(u) < 1e-3) is stable


def test_noise_gain_is_the_spread_of_the_command():
    found = of("pid", "sine_100")
    rng = np.random.default_rng(3)
    A, B, C, D = found.controller
    F, G, out, _ = held(found.plant, H, 0.0)
    x, k, u = np.zeros(len(F)), np.zeros(len(A)), []
    for w in rng.normal(size=20_000):
        y = (out @ x)[0] + w
        u.append(float((C @ k)[0] + D[0, 0] * y))
        k, x = A @ k + B[:, 0] * y, F @ x + G[:, 0] * u[-1]
    assert found.noise_gain() == pytest.approx(np.std(u), rel=0.03)


def test_the_command_prints_a_row_for_every_loop_and_says_what_has_none():
    run = CliRunner().invoke(main, ["margins", str(ROOT / "scenarios/pid"), "--case", "sine_100", "--json"])
    assert run.exit_code == 0, run.output
    (row,) = json.loads(run.output)["loops"]
    assert row["cases"] == ["sine_100"]
    assert row["margins"]["stable"]
    assert row["margins"]["gain_db"] > 6
    run = CliRunner().invoke(main, ["margins", str(ROOT / "scenarios/open_loop"), "--case", "sine_100"])
    assert run.exit_code == 1
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

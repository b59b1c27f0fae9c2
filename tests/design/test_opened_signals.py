"""Loops broken at a named signal, memories of a period, delay margins by simulation: against their own equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hystfmu as hy
from hystfmu import Graph, InputError, Node
from hystfmu.design import to_control
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
W = 2 * np.pi * 500


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

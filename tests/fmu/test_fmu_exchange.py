"""Model Exchange with simple solvers agrees with Co-Simulation, bit for bit without continuous states."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fmu_events import Events, Solver, adaptive, euler, runge_kutta
from fmu_master import BLOCKS, OK, H, loop, mixed, rows, single
from runners import exchange_by_fmpy

from hystfmu.core.library import block_types
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output

Make = Callable[..., Events]
CONTINUOUS = [name for name in BLOCKS if block_types()[name].of("cstate")]
STATELESS = [name for name in BLOCKS if name not in CONTINUOUS]


def exchange(make: Make, graph: Graph) -> Events:
    return make(graph, "me")


@pytest.mark.parametrize("name", STATELESS)
def test_without_continuous_states_it_is_co_simulation_bit_for_bit(make: Make, name: str) -> None:
    """Memories advance with accepted steps only, sampled blocks at their time events."""
    graph = single(name)
    u = rows(graph, 200)
    want = graph.executor().run(u, graph.n_outputs, H)
    assert exchange(make, graph).integrate(u, H, euler(1), reject=True).tobytes() == want.tobytes()


def delayed_loop(first: str, op: Node) -> Graph:
    """Two sampled blocks precede their sources in the order; one of them closes a loop."""
    nodes = {
        "wait": Node("wait", "delay", {"n": 2}),
        "add": Node("add", "sum", {"n": 2}, {"k": [1.0, -0.9]}),
        "op": op,
        "rate": Node("rate", "polynomial_narx", {"n_u": 2, "n_f": 0, "n_y": 1, "q": 1}),
    }
    order = [first, *(n for n in nodes if n != first)]
    wires = [("add.y", "op.u"), ("op.y", "wait.u"), ("wait.y", "add.u[2]"), ("add.y", "rate.u")]
    outputs = [Output(n, f"{n}.y") for n in nodes]
    return Graph([nodes[n] for n in order], wires, [Input("d", ("add.u[1]",))], outputs, step=H)


# an input that changes before the event adds a reversal to a memory, so its inputs change in the event
THROUGH = {
    "end": Node("op", "dead_zones", {"n": 1}, {"w0": 0.6, "w": 0.3, "r": 0.2}),
    "events": Node("op", "prandtl_ishlinskii", {"n": 2}, {"w0": 0.5, "r": [0.1, 0.3], "w": [0.2, 0.1]}),
}


@pytest.mark.parametrize("hold", list(THROUGH))
@pytest.mark.parametrize("first", ["wait", "rate"])
def test_a_sampled_block_reads_later_blocks_with_a_delay(make: Make, first: str, hold: str) -> None:
    """It reads the values after the last step, also in Model Exchange, where inputs change before the event."""
    graph = delayed_loop(first, THROUGH[hold])
    assert [n.name for n in graph.nodes].index("wait") < [n.name for n in graph.nodes].index("add")
    u = rows(graph, 100)
    want = graph.executor().run(u, graph.n_outputs, H)
    wait, add, op = want[:, 0], want[:, 1], want[:, 2]
    np.testing.assert_array_equal(wait[3:], op[:-3])  # the delay of two steps, and one step from the order
    np.testing.assert_allclose(add, u[:, 0] - 0.9 * wait, rtol=0, atol=1e-15)
    assert exchange(make, graph).integrate(u, H, euler(1), hold).tobytes() == want.tobytes()


# ---- continuous states: the standards differ in names only, so solvers run one of them ------------------------------
LINEAR = {
    "first order": Node("g", "transfer_function", {}, {"b": [2.0], "a": [5e-3, 1.0]}),
    "resonance": Node("g", "transfer_function", {"nb": 1, "na": 2}, {"b": [1e-3, 1.0], "a": [1e-5, 1e-3, 1.0]}),
    "feed-through": Node("g", "transfer_function", {"nb": 2, "na": 2}, {"b": [2e-5, 0.0, 1.0], "a": [1e-5, 2e-3, 1.0]}),
    "creep": Node("g", "creep", {}, {"w": [0.5, 0.2, 0.1], "T": [2e-3, 3e-2, 0.5]}),
}
only_fmi2 = pytest.mark.parametrize("fmi", [2], indirect=True)
DYNAMIC = {name: Graph.single(n).with_step(H) for name, n in LINEAR.items()} | {"mixed": mixed()}


def error(make: Make, graph: Graph, solver: Solver, hold: str = "end", n: int = 30) -> float:
    """Largest difference from Co-Simulation over n rows, relative to the range of the output."""
    u = rows(graph, n)
    want = graph.executor().run(u, graph.n_outputs, H)
    off = np.abs(exchange(make, graph).integrate(u, H, solver, hold) - want)
    return float((off.max(axis=0) / np.ptp(want, axis=0)).max())


@pytest.mark.parametrize("name", ["feed-through", "creep", "mixed", "loop", "oscillator"])
def test_both_standards_give_the_same_bits(folder: Path, name: str) -> None:
    graph = {**DYNAMIC, "loop": loop(), "oscillator": single("bouc_wen_oscillator")}[name]
    u = rows(graph, 60)
    units = [Events(graph, folder / graph.token, fmi, interface="me") for fmi in (2, 3)]
    first, second = (m.integrate(u, H, runge_kutta(2), "ramp") for m in units)
    assert first.tobytes() == second.tobytes()
    for m in units:
        m.free()


@only_fmi2
@pytest.mark.parametrize("name", list(DYNAMIC))
def test_adaptive_solver_agrees_with_the_exact_discretisation(make: Make, name: str) -> None:
    """Co-Simulation is exact for linear parts with held inputs, so the error is the tolerance of the solver."""
    assert error(make, DYNAMIC[name], adaptive, n=60) < 1e-9


@only_fmi2
@pytest.mark.parametrize("name", list(DYNAMIC))
@pytest.mark.parametrize(("method", "order", "steps"), [(euler, 1, (64, 128)), (runge_kutta, 4, (4, 8))])
def test_fixed_steps_converge_with_their_order(
    make: Make, name: str, method: Callable[[int], Solver], order: int, steps: tuple[int, int]
) -> None:
    coarse, fine = (error(make, DYNAMIC[name], method(n)) for n in steps)
    assert fine < coarse < 1e-2, (coarse, fine)
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.15)


@only_fmi2
def test_ramp_between_rows_is_the_first_order_hold(make: Make) -> None:
    graph = Graph.single(LINEAR["resonance"].with_values(hold="foh"))
    assert error(make, graph, adaptive, "ramp") < 1e-9


@only_fmi2
def test_bouc_wen_oscillator(make: Make) -> None:
    """Newmark's method has order 2 in Co-Simulation: half the step, a fourth of the distance from Model Exchange."""
    graph = single("bouc_wen_oscillator")
    t = np.arange(121) * 2.5e-4

    def distance(every: int) -> float:
        u = (20 * np.sin(900 * t) * np.sin(50 * t))[::every, None]
        h = 2.5e-4 * every
        want = graph.executor().run(u, graph.n_outputs, h)
        return float(np.abs(exchange(make, graph).integrate(u, h, adaptive, "ramp") - want)[:, 0].max())

    coarse, fine = distance(2), distance(1)
    assert fine < 0.3 * coarse
    assert coarse < 2e-6, "of 1e-4 m"


@only_fmi2
def test_closed_loop_of_all_classes(make: Make) -> None:
    """A sampled controller, hysteresis and continuous dynamics agree with Co-Simulation."""
    graph = loop()
    u = rows(graph, 150)
    want = graph.executor().run(u, graph.n_outputs, H)
    got = exchange(make, graph).integrate(u, H, adaptive, "events")
    assert np.abs(got - want).max() < 1e-9


# ---- fmpy -----------------------------------------------------------------------------------------------------------
SCALAR = [name for name in BLOCKS if all(p.size == 1 for p in single(name).ports if p.kind in ("input", "output"))]


@pytest.mark.parametrize("name", SCALAR)
def test_fmpy_runs_it(tmp_path: Path, fmi: int, name: str) -> None:
    """Without continuous states the bits equal Co-Simulation, except for sources, whose time fmpy accumulates."""
    graph = single(name)
    u = rows(graph, 40)
    got = exchange_by_fmpy(export_fmu(graph, tmp_path / "x.fmu", fmi), graph, u, "Euler", H)  # type: ignore[arg-type]
    want = graph.executor().run(u, graph.n_outputs, H)
    assert np.isfinite(got).all()
    if name in ("reference", "disturbance"):
        np.testing.assert_allclose(got, want, rtol=0, atol=1e-12)
    elif name in STATELESS:
        assert got.tobytes() == want.tobytes()


def test_fmpy_with_cvode(tmp_path: Path, fmi: int) -> None:
    """fmpy sets the inputs only between the steps of CVode, so the test uses a constant input."""
    graph = mixed()
    u = np.full((60, 1), 0.7)
    got = exchange_by_fmpy(export_fmu(graph, tmp_path / "x.fmu", fmi), graph, u, "CVode", H)  # type: ignore[arg-type]
    want = graph.executor().run(u, graph.n_outputs, H)
    np.testing.assert_allclose(got[:, 1], want[:, 1], rtol=0, atol=1e-6)


def test_an_input_that_jumps_for_the_solver_asks_for_an_event(make: Make) -> None:
    """It was set at an accepted step and not where derivatives were read; all other steps ask for none."""
    m = exchange(make, single("transfer_function"))
    m.begin(np.array([0.5]))
    m.derivatives()
    assert m.completed() == OK  # the input stays
    m.put(np.array([1.0]))
    m.derivatives()
    m.put(np.array([1.5]))
    assert m.completed() == OK  # the solver has seen it move
    m.derivatives()
    m.put(np.array([2.0]))
    assert m.completed(asks=True) == OK
    m.event(np.array([2.5]))
    assert m.completed() == OK  # it jumped in Event Mode
    still = exchange(make, single("prandtl_ishlinskii"))
    still.begin(np.array([0.5]))
    still.put(np.array([1.0]))
    assert still.completed() == OK  # no solver without states

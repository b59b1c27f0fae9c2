"""Model Exchange: solvers agree with Co-Simulation, bit for bit without continuous states; its events and states."""

import ctypes as C
import math
from pathlib import Path

import numpy as np
import pytest
from fmu_events import Events, Solver, adaptive, euler, runge_kutta
from fmu_master import BLOCKS, DISCARD, ERROR, OK, WARNING, H, Make, loop, mixed, only_fmi2, rows, single
from runners import exchange_by_fmpy

from hystfmu.core.library import block_types
from hystfmu.fmu import export_fmu
from hystfmu.graph import Graph, Input, Node, Output

CONTINUOUS = [name for name in BLOCKS if block_types()[name].of("cstate")]
STATELESS = [name for name in BLOCKS if name not in CONTINUOUS]


def exchange(make: Make, graph: Graph) -> Events:
    return make(graph, "me")


@pytest.mark.some(20)
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


@pytest.mark.some(16)
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


# ---- calls -----------------------------------------------------------------------------------------------------------
def continuous() -> Graph:
    """Return a first-order lag: q' = (u - q) / T, y = 2 q, T = 5 ms."""
    return Graph.single(Node("g", "creep", {}, {"w": [2.0], "T": [5e-3]}))


# ---- time events ----
@pytest.mark.parametrize("t0", [0.0, -0.3, 1e6])
def test_time_events_come_at_the_sample_period(make: Make, t0: float) -> None:
    """At t0 + k h, without a drift; an importer may be late by some rounding, not early by a period."""
    m = make(single("delay"), "me")
    m.begin(np.array([0.0]), t0)
    for k in range(1, 400):
        assert m.next == t0 + k * H
        assert m.set_time(m.next * (1 + 1e-16 * (k % 3 - 1))) == OK
        m.event(np.array([0.1 * k]))
    assert m.set_time(m.next - 0.1 * H) == OK
    before = m.next
    m.event(np.array([0.0]))
    assert m.next == before, "an event before the sample time is not a sample"


def test_blocks_without_samples_have_no_time_events(make: Make) -> None:
    for graph in (single("prandtl_ishlinskii"), continuous(), single("reference")):
        m = make(graph, "me")
        m.begin(rows(graph, 1)[0])
        assert m.next is None


def test_skipped_samples_are_taken_late(make: Make) -> None:
    """The result equals Co-Simulation, where the input of the event was held since the last one."""
    graph = single("pid")
    u = rows(graph, 9)
    want = graph.executor().run(np.vstack([u[:1], np.repeat(u[1:], 3, axis=0)]), 1, H)[::3]
    m = make(graph, "me")
    got = [m.begin(u[0])]
    for k in range(1, len(u)):
        assert m.set_time(3 * k * H) == OK
        got.append(m.event(u[k]))
        assert m.next == pytest.approx((3 * k + 1) * H)
    assert np.array(got).tobytes() == want.tobytes()
    assert m.set_time(1e300) == OK
    assert m.call("EnterEventMode") == OK
    before = m.memory()
    assert m.update() == ERROR
    assert m.messages[-1][2] == "The time passed over more than 1e6 samples of the model."
    assert m.memory() == before


@pytest.mark.parametrize("t", [math.nan, math.inf, -math.inf])
def test_bad_time(make: Make, t: float) -> None:
    m = make(mixed(), "me")
    m.begin(np.array([0.1]))
    before = m.memory()
    assert m.set_time(t) == ERROR
    assert m.messages[-1][2] == "The time must be finite."
    assert m.memory() == before


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_states_without_finite_value(make: Make, bad: float) -> None:
    """A diverging solver is told to try a shorter step."""
    m = make(continuous(), "me")
    m.begin(np.array([0.5]))
    assert m.set_x(np.array([0.25])) == OK
    before = m.memory()
    reference = C.c_uint(sum(p.size for p in m.graph.ports) + 1)
    setter, more = ("SetReal", ()) if m.fmi == 2 else ("SetFloat64", (C.c_size_t(1),))
    alone = C.byref(reference), C.c_size_t(1), C.byref(C.c_double(bad)), *more
    word = "NaN" if math.isnan(bad) else "infinite"
    for refused in (lambda: m.set_x(np.array([bad])), lambda: m.call(setter, *alone)):
        m.messages.clear()
        assert refused() == DISCARD
        assert m.messages == [(WARNING, "logStatusWarning", f"The continuous state 'q' is {word}: it is not set.")]
        assert m.memory() == before
    assert m.set_x(np.array([-1e308])) == OK
    assert m.vector("GetDerivatives" if m.fmi == 2 else "GetContinuousStateDerivatives")[0] == DISCARD
    assert m.messages[-1][2] == "The derivative of 'q' is not finite at t = 0 s."
    assert m.set_x(np.array([0.25])) == OK
    assert m.derivatives()[0] == pytest.approx((0.5 - 0.25) / 5e-3)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_input_without_finite_value(make: Make, bad: float) -> None:
    """Derivatives, accepted steps and events wait for a finite input; the invalid input leaves no effect."""
    u = rows(mixed(), 30)
    want, m = make(mixed(), "me"), make(mixed(), "me")
    expected = want.integrate(u, H, euler(2))
    m.begin(u[0])
    before = m.memory()
    assert m.set("u", bad) == DISCARD
    assert m.vector("GetDerivatives" if m.fmi == 2 else "GetContinuousStateDerivatives")[0] == DISCARD
    assert m.completed() == DISCARD
    assert m.call("EnterEventMode") == OK
    assert m.update() == DISCARD
    m.leave()
    assert [x[0] for x in m.messages] == [WARNING], "one warning"
    m.put(u[0])
    m.outputs()
    assert m.memory() == before
    assert m.call("Reset") == OK
    m.next = None
    assert m.integrate(u, H, euler(2)).tobytes() == expected.tobytes()


def test_tunable_parameters_are_set_in_event_mode(make: Make) -> None:
    m = make(Graph.single(Node("c", "creep", {}, {"w": [1.0, 1.0], "T": [0.1, 0.2]})), "me")
    m.begin(np.array([1.0]))
    before = m.memory()
    assert m.set("w", 2.0, 2.0) == ERROR
    assert m.messages[-1][2] == "'w' is a parameter: set it in Event Mode."
    assert m.memory() == before
    assert m.set_x(np.array([0.1, 0.2])) == OK
    assert m.get("y") == pytest.approx(0.3)
    assert m.call("EnterEventMode") == OK
    assert m.set("w", 2.0, 2.0) == OK
    assert m.set("T", 0.01, 0.2) == OK
    assert m.get("y") == pytest.approx(0.6)
    assert m.update() == OK
    m.leave()
    np.testing.assert_allclose(m.derivatives(), [90.0, 4.0])


# ---- states and derivatives as variables ----------------------------------------------------------------------------
def scalar(m: Events, what: str, reference: int, value: float = 0.0) -> tuple[int, float]:
    buffer, one = (C.c_double * 1)(value), (C.c_uint * 1)(reference)
    extra = () if m.fmi == 2 else (C.c_size_t(1),)
    status = m.call(f"{what}{'Real' if m.fmi == 2 else 'Float64'}", one, C.c_size_t(1), buffer, *extra)
    return status, buffer[0]


@pytest.mark.parametrize("interface", ["me", "cs"])
def test_states_and_derivatives_are_variables(make: Make, interface: str) -> None:
    graph = continuous()
    m = make(graph, interface)
    first = sum(p.size for p in graph.ports) + 1  # after the time
    if interface == "me":
        m.begin(np.array([0.5]))
        assert scalar(m, "Set", first, 0.125) == (OK, 0.125)
        assert m.x[0] == 0.125
        assert m.derivatives()[0] == pytest.approx((0.5 - 0.125) / 5e-3)
        assert scalar(m, "Set", first, math.nan)[0] == DISCARD
    else:
        m.initialize()
        m.set("u", 0.5)
        assert m.step(0.0, 5e-3) == OK
        assert scalar(m, "Get", first)[1] == pytest.approx(0.5 * (1 - math.exp(-1)))
        assert scalar(m, "Set", first, 0.1)[0] == ERROR
    x = scalar(m, "Get", first)[1]
    assert scalar(m, "Get", first + 1)[1] == pytest.approx((0.5 - x) / 5e-3)
    assert m.get("y") == 2 * x
    before = m.memory()
    assert scalar(m, "Set", first + 1, 0.1)[0] == ERROR
    assert m.messages[-1][2] == "The derivative of 'q' cannot be set."
    assert scalar(m, "Get", first + 2)[0] == ERROR
    assert m.memory() == before


def test_events_between_samples_take_no_sample(make: Make) -> None:
    graph = loop()
    m, plain = make(graph, "me"), make(graph, "me")
    for k in (m, plain):
        k.begin(np.array([0.0]))
    assert m.set_time(0.5 * H) == OK
    y = m.event(np.array([0.25]))
    assert m.next == H
    assert y[1] == plain.outputs()[1], "the controller holds"

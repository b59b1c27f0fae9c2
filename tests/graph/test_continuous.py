"""Continuous-time form of a graph: evaluations are pure, commits equal steps, derivatives give the exact solution."""

import math

import fmu_events
import numpy as np
import pytest
from excitation import configurations, node, rows
from series import series

from hystfmu import Graph, Input, InputError, Model, Node, Output
from hystfmu.core.executor import ContinuousExecutor, Executor
from hystfmu.core.library import block_types

H = 0.05
BLOCKS = block_types().items()
HYSTERETIC = sorted(n for n, b in BLOCKS if b.rate == "hysteretic")
SAMPLED = sorted(n for n, b in BLOCKS if b.rate == "sampled")


def executor(graph):
    return ContinuousExecutor(graph.to_bytes())


def outputs(graph, c):
    return [c.get(p.reference + k) for p in graph.ports if p.kind == "output" for k in range(p.size)]


def put(c, row):
    for k, v in enumerate(row):  # the inputs have the first references
        c.set(k, v)


def memory(graph, c):
    """Step, states: all of the state but outputs and inputs, which lie behind."""
    behind = sum(n.sizes[v.name] for n in graph.nodes for v in n.block.of("output")) + graph.n_inputs
    return c.state[:-behind].tobytes()


def bank_and_network(n=6):
    rng = np.random.default_rng(3)
    return series(
        Node("bank", "play_bank", {}, {"r": np.linspace(0.05, 0.8, n)}),
        Node("net", "mlp", {"n_in": n, "n_hidden": 5}, {"W1": rng.normal(size=5 * n), "W2": rng.normal(size=5)}),
    )


def configured(names):
    """A graph for every configuration of these blocks."""
    for name in names:
        block = block_types()[name]
        for k, values in enumerate(configurations(block)):
            if made := node(block, values):
                yield pytest.param(Graph.single(made), id=f"{name}-{k}")


def static_graphs():
    yield from configured(HYSTERETIC)
    yield pytest.param(bank_and_network(), id="bank and network")


def excitation(graph, n=160):
    block = block_types()[graph.nodes[0].type]
    return rows(block, dict(graph.nodes[0].dims), n)


@pytest.mark.parametrize("graph", list(static_graphs()))
def test_commits_over_a_record_are_the_steps_of_a_run_bit_for_bit(graph):
    u = excitation(graph)
    want = graph.run(u, H).reshape(len(u), -1)
    c = executor(graph)
    assert not c.is_sampled
    rng = np.random.default_rng(0)
    got = []
    for k, row in enumerate(u):
        if k == 0:
            put(c, row)
            c.start(0.0)
        before = memory(graph, c)
        for trial in rng.uniform(-2, 2, (2, u.shape[1])):  # as a solver does that rejects steps
            put(c, trial)
            c.evaluate(k * H)
            assert memory(graph, c) == before
        put(c, row)
        c.evaluate(k * H)
        got.append(outputs(graph, c))
        if k:
            c.commit(k * H)
            assert outputs(graph, c) == got[-1]
    assert np.array(got).tobytes() == want.tobytes()


def runge_kutta(c, u_of, t, h, n):
    """Classical Runge-Kutta method over [t, t + h] in n steps; the input is a function of the time."""

    def f(at, x):
        put(c, u_of(at))
        c.x = x
        c.evaluate(at)
        return c.derivatives()

    f(t + h, fmu_events.runge_kutta(n)(f, t, t + h, c.x))


LINEAR = {
    "creep": Node("b", "creep", {"n": 3}, {"w": [0.5, -0.2, 1.0], "T": [0.3, 0.9, 2.0], "start": "steady"}),
    "transfer_function": Node("b", "transfer_function", {}, {"b": [1.0, 3.0, 4.0], "a": [1.0, 2.0, 40.0]}),
    "ramps": Node("b", "transfer_function", {}, {"b": [2.0, 5.0], "a": [0.5, 1.0, 9.0, 4.0], "hold": "foh"}),
}


@pytest.mark.parametrize("name", LINEAR)
def test_derivatives_lead_with_order_4_to_the_exact_discretisation(name):
    graph = Graph.single(LINEAR[name])
    u = np.random.default_rng(1).normal(size=(40, 1))
    exact = graph.run(u, H)
    ramp = name == "ramps"

    def error(n):
        c = executor(graph)
        assert len(c.x) == len(graph.continuous_states) == (2 if name == "transfer_function" else 3)
        put(c, u[0])
        c.start(0.0)
        e = abs(outputs(graph, c)[0] - exact[0])
        for k in range(1, len(u)):
            t = (k - 1) * H

            def held(at, k=k, t=t):
                return u[k - 1] + (u[k] - u[k - 1]) * (at - t) / H if ramp else u[k]

            runge_kutta(c, held, t, H, n)
            e = max(e, abs(outputs(graph, c)[0] - exact[k]))
        return e

    coarse, fine = error(2), error(4)
    assert fine < 1e-5
    assert 12 < coarse / fine < 20


def test_newmark_leads_with_order_2_to_the_solution_of_the_derivatives():
    values = {"m_L": 1.0, "c_L": 0.3, "k_L": 4.0, "alpha": 4.0, "beta": 2.0, "nu": 1.0}
    graph = Graph.single(Node("b", "bouc_wen_oscillator", {}, values))
    c = executor(graph)
    assert [s.name for s in graph.continuous_states] == ["q", "v", "f"]
    assert [s.unit for s in graph.continuous_states] == ["m", "m/s", "N"]
    force = lambda t: np.array([1.5 * np.sin(2.1 * t)])  # noqa: E731
    put(c, force(0.0))
    c.start(0.0)
    n, h = 400, 0.025
    for k in range(n):
        runge_kutta(c, force, k * h, h, 8)
    want = outputs(graph, c)

    def error(m):
        t = np.arange(n * m + 1) * (h / m)
        return np.abs(graph.run(force(t).T, h / m)[-1] - want).max()

    errors = [error(m) for m in (2, 4, 8, 16)]
    assert errors[0] < 1e-3
    order = np.polyfit(np.log2([2, 4, 8, 16]), np.log2(errors), 1)[0]
    assert -2.2 < order < -1.8, errors  # |v| and |z| have kinks: the order varies between grids, its mean is 2


def sampled_graphs():
    yield from configured(SAMPLED)
    nodes = [Node("control", "pid", {}, {"Kp": 0.4, "Ki": 3.0}), Node("plant", "delay", {"n": 2})]
    wires = [("control.u", "plant.u"), ("plant.y", "control.y")]
    yield pytest.param(
        Graph(nodes, wires, [Input("r", ("control.y_d",))], [Output("y", "plant.y"), Output("u", "control.u")]),
        id="loop",
    )
    nodes = [Node("d", "differentiator"), Node("s", "sum", {"n": 2}), Node("n", "delay")]
    yield pytest.param(
        Graph(nodes, [("d.du", "s.u[1]"), ("s.y", "n.u")], [Input("u", ("d.u", "s.u[2]"))], [Output("y", "n.y")]),
        id="a function between",
    )


@pytest.mark.parametrize("graph", list(sampled_graphs()))
def test_samples_are_the_steps_of_a_run_bit_for_bit(graph):
    u = np.random.default_rng(5).uniform(-1, 1, (60, graph.n_inputs))
    want = graph.run(u, H).reshape(len(u), -1)
    c = executor(graph)
    assert c.is_sampled
    got = []
    for k, row in enumerate(u):
        put(c, row)
        if k == 0:
            c.start(0.0)
        else:
            held = [c.get(p.reference) for p in graph.ports if p.kind == "output"]
            c.evaluate((k - 1) * H + H)  # between samples: inputs change, outputs of sampled blocks do not
            assert [c.get(p.reference) for p in graph.ports if p.kind == "output"] == held
            c.sample((k - 1) * H + H, H)
        got.append(outputs(graph, c))
    assert np.array(got).tobytes() == want.tobytes()


def test_parameters_take_effect_at_the_next_sample_or_are_refused():
    graph = Graph.single(Node("b", "pid", {}, {"u_max": 2.0}))
    c = executor(graph)
    c.start(0.0)
    c.set(graph.port("u_min").reference, 3.0)
    with pytest.raises(InputError, match="u_min must not be greater than u_max"):
        c.sample(H, H)


def test_the_order_of_evaluation_follows_the_wires_not_the_file():
    a, b = Node("a", "scaling", {"n": 1}, {"gain": 2.0}), Node("b", "scaling", {"n": 1}, {"offset": 1.0})
    graph = Graph([b, a], [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("y", "b.y")], sort=False)
    c = executor(graph)
    c.start(0.0)
    c.set(0, 3.0)
    c.evaluate(0.0)
    assert outputs(graph, c) == [7.0]
    assert graph.run([3.0, 3.0]).tolist() == [1.0, 7.0]  # a run in the order of the file reads what is held


def test_inputs_of_derivatives_are_complete_where_the_source_comes_later():
    nodes = [Node("lag", "creep"), Node("add", "sum", {"n": 2}, {"k": [1.0, -1.0]})]
    wires = [("add.y", "lag.u"), ("lag.y", "add.u[2]")]
    graph = Graph(nodes, wires, [Input("u", ("add.u[1]",))], [Output("y", "lag.y")])
    c = executor(graph)
    c.start(0.0)
    c.set(0, 3.0)
    c.x = [0.5]
    c.evaluate(0.0)
    assert c.derivatives().tolist() == [2.0]  # (u - y - q) / T


def test_names_of_continuous_states_are_unique():
    nodes = [Node("a", "creep", {"n": 2}), Node("b", "creep")]
    graph = Graph(nodes, [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("a_q_1", "b.y")])
    assert [s.name for s in graph.continuous_states] == ["a_q_1_", "a_q_2", "b_q"]


def test_the_step_of_a_model_stands_in_its_block_file():
    graph = Graph.single(Node("a", "delay"))
    model = Model("m", graph, 2e-3)
    assert graph.step == 0
    assert model.graph.step == 2e-3
    assert model.graph.to_bytes()[60:68] == np.float64(2e-3).tobytes()
    for bad in (-1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="step"):
            Graph.single(Node("a", "delay")).with_step(bad)
    graph.step = -1.0  # a file that Graph does not write
    with pytest.raises(InputError, match="step"):
        Executor(graph.to_bytes())


def test_a_graph_ends_at_its_last_block():
    """Behind the blocks lie the connections: taken for one more block, they would lead into these 64 inputs."""
    nodes = [Node("many", "scaling", {"n": 64}, {}), Node("lag", "transfer_function", {}, {})]
    inputs = [Input("u", ("many.u",)), Input("v", ("lag.u",))]
    graph = Graph(nodes, [], inputs, [Output("y", "many.y"), Output("z", "lag.y")])
    alone = executor(Graph.single(Node("lag", "transfer_function", {}, {})))
    c = executor(graph)
    put(c, [-1.5] * 64 + [0.7])
    put(alone, [0.7])
    for e in (c, alone):
        e.evaluate(0.0)
        e.commit(0.0)
    assert c.derivatives().tolist() == alone.derivatives().tolist() != [0.0]
    assert outputs(graph, c)[:64] == [-1.5] * 64


# ---- The end of a step by a clock: without its rounding where it is a step of the model, as asked for otherwise
def model(step: float) -> Executor:
    return Executor(Graph.single(Node("s", "scaling")).with_step(step).to_bytes())


@pytest.mark.parametrize("step", [0.1, 1e-4, 1 / 3])
@pytest.mark.parametrize("start", [0.0, 1.0, -7.3, 4096.0])
def test_a_clock_that_adds_its_steps_is_put_right(step: float, start: float) -> None:
    """Any sum of k steps ends where a master that counts ends: at start + (k - 1) step + step."""
    e, t, wrong = model(step), start, 0
    for k in range(1, 3000):
        end = start + (k - 1) * step + step
        assert e.end_of_step(start, t, step) == end
        t += step
        wrong += t != end
    assert wrong > 100, "the sum itself is rounded"


@pytest.mark.parametrize("start", [0.0, 2.0**10])
def test_what_is_farther_off_than_rounding_stays(start: float) -> None:
    """k additions round by half a unit in the last place each: 1.2e-16 (k + 3) of both times together."""
    e, step = model(0.25), 0.25
    for k in (1, 8, 1000):
        end = start + k * step
        room = 1.2e-16 * (k + 3) * (end + start)
        unit = math.ulp(end)
        for off in (room - 2 * unit, -(room - 2 * unit)):
            assert e.end_of_step(start, end - step + off, step) == end
        for off in (room + 2 * unit, -(room + 2 * unit)):
            asked = end - step + off
            assert e.end_of_step(start, asked, step) == asked + step != end


def test_a_step_that_is_none_of_the_model_stays() -> None:
    e = model(0.25)
    for t, h in [(0.1, 0.25), (0.0, 0.2), (0.0, 0.26), (0.05, 0.2), (-0.25, 0.25), (-1.0, 0.5)]:
        assert e.end_of_step(0.0, t, h) == t + h
    assert model(0.0).end_of_step(0.0, 0.3, 0.25) == 0.55
    far = 2.0**60
    assert e.end_of_step(0.0, far, 0.25) == far + 0.25


def test_the_model_of_an_inverse_need_not_stand_right_behind_it() -> None:
    """A block between an implicit inverse and its model keeps its own tangent and does not end the search for it."""
    nodes = [
        Node("inv", "implicit_inverse", {}, {"lo": -5.0, "hi": 5.0}),
        Node("other", "scaling", {"n": 1}, {"gain": 7.0}),
        Node("model", "scaling", {"n": 1}, {"gain": 4.0}),
    ]
    wires = [("inv.u", "model.u"), ("model.y", "inv.h"), ("inv.u", "other.u")]
    inputs = [Input("y", ("inv.y",))]
    graph = Graph(nodes, wires, inputs, [Output("u", "inv.u"), Output("v", "other.y")], sort=False)
    assert graph.run(np.array([1.0, -2.0])).tolist() == [[0.25, 1.75], [-0.5, -3.5]]
    c = executor(graph)
    put(c, [1.0])
    c.start(0.0)
    assert c.tangent([1.0], [], 2)[0] == pytest.approx([0.25, 1.75])
    assert c.tangent([-2.0], [], 2)[0] == pytest.approx([-0.5, -3.5])


@pytest.mark.parametrize("falls_at", [0.5, 1.0])
def test_a_branch_that_falls_only_at_its_end_is_refused(falls_at: float) -> None:
    """g(d) = (1 - e^-d)(d + a d^3): with a slope of 0 at `falls_at` d_max it falls beyond; at d_max it just holds."""
    d_max = 2.0
    d = falls_at * d_max

    def slope(a2: float, d: float) -> float:
        return float(np.exp(-d) * (d + a2 * d**3) - np.expm1(-d) * (1 + 3 * a2 * d**2))

    lo, hi = -1.0, 0.0
    for _ in range(200):
        middle = (lo + hi) / 2
        lo, hi = (lo, middle) if slope(middle, d) > 0 else (middle, hi)
    for block in ("constraint_factor", "constraint_factor_inverse"):
        for a2, good in [(hi * (1 - 1e-9), falls_at == 1.0), (lo * (1 + 1e-9), False)]:
            node = Node("b", block, {"m": 2}, {"a": [1.0, a2], "d_max": d_max})
            if good:
                Graph.single(node).executor()
            else:
                with pytest.raises(ValueError, match="b"):
                    Graph.single(node).executor()


def test_only_parameters_and_inputs_are_set() -> None:
    graph = Graph.single(Node("s", "scaling"))
    e, places = Executor(graph.to_bytes()), {p.name: p.reference for p in graph.ports}
    e.set(places["u"], 2.0)
    e.set(places["gain"], 3.0)
    e.start(0.0)
    assert e.get(places["y"]) == 6.0
    for reference in (places["y"], len(places), -1, 10**6):
        with pytest.raises(ValueError, match="not a parameter or input"):
            e.set(reference, 1.0)

"""Tangents of a graph: closed forms at kinks, differences elsewhere."""

import numpy as np
import pytest
from test_continuous import bank_and_network, executor, outputs, put
from test_inverse import fitted

from hystfmu import Graph, Input, Node, Output, signals
from hystfmu.inverse import inverse

H = 1e-3


def after(graph, path):
    """Return an executor whose memories have followed the path, evaluated at its end."""
    c = executor(graph)
    for k, v in enumerate(path):
        put(c, np.atleast_1d(v))
        c.commit(float(k)) if k else c.start(0.0)
    return c


def tangents(graph, path, at):
    """dy/du upwards and downwards at the trial input `at`, without committing it."""
    c = after(graph, path)
    put(c, [at])
    c.evaluate(0.0)
    return [s * c.tangent([s], [], 1)[0][0] for s in (1.0, -1.0)]


@pytest.mark.parametrize(("path", "at", "up", "down"), [
    ([0.0], 0.0, 0.5, 0.5),  # the play stands in the middle: the linear term alone
    ([0.0], 0.25, 1.5, 0.5),  # where it begins to move
    ([0.0], 0.75, 1.5, 1.5),  # trial: 0.75 is on a smooth branch until it is committed
    ([0.0, 0.75], 0.75, 1.5, 0.5),  # committed: down is a reversal
    ([0.0, 0.75, 0.5], 0.5, 0.5, 0.5),
    ([0.0, 0.75, 0.5], 0.25, 0.5, 1.5),  # the play ends at 0.75 - 2 r
    ([0.0, 0.75, 0.5], 0.75, 1.5, 0.5),  # the loop closes at the old extremum
    ([0.0, 0.75, 0.0], 0.0, 0.5, 1.5),
    ([0.0, 0.75, -0.75], -0.75, 0.5, 1.5),  # wiped out: virgin again on the other side
])  # fmt: skip
@pytest.mark.parametrize("block", ["prandtl_ishlinskii", "backlash_sum"])
def test_one_play_has_the_slopes_of_its_definition(block, path, at, up, down):
    graph = Graph.single(Node("b", block, {}, {"w0": 0.5, "r": [0.25], "w": [1.0]}))
    assert tangents(graph, path, at) == pytest.approx([up, down], abs=1e-15)
    back = Graph.single(Node("b", "prandtl_ishlinskii_inverse", {}, {"w0": 0.5, "r": [0.25], "w": [1.0]}))
    y = graph.run([*path, at])  # binary fractions: the kinks of the inverse are hit exactly
    assert tangents(back, y[:-1], y[-1]) == pytest.approx([1 / up, 1 / down], abs=1e-15)


def differences(graph, c, du, dx, e=1e-6):
    """Central differences of outputs and derivatives of the executor at its present point."""
    u = np.array([c.get(k) for k in range(graph.n_inputs)])
    x = c.x

    def at(s):
        put(c, u + s * du)
        c.x = x + s * dx
        c.evaluate(0.0)
        return np.concatenate([outputs(graph, c), c.derivatives()])

    both = (at(e) - at(-e)) / (2 * e)
    at(0.0)
    return both


def loop():
    """Feed-through, continuous blocks before and after their sources, an input that feeds two blocks."""
    nodes = [
        Node("g0", "transfer_function", {}, {"b": [3.0, 1.0], "a": [1.0, 2.0, 5.0]}),
        Node("lag", "creep", {"n": 2}, {"T": [0.5, 2.0]}),
        Node("error", "sum", {"n": 3}, {"k": [2.0, -1.0, 0.3]}),
        Node("play", "prandtl_ishlinskii", {}, {"w0": 0.4, "r": [0.1, 0.2], "w": [0.3, 0.6]}),
    ]
    wires = [
        ("g0.y", "error.u[2]"), ("error.y", "play.u"), ("play.y", "g0.u"), ("play.y", "lag.u"), ("lag.y", "error.u[3]"),
    ]  # fmt: skip
    ins = [Input("r", ("error.u[1]",))]
    return Graph(nodes, wires, ins, [Output("y", "g0.y"), Output("v", "play.y"), Output("q", "lag.y")])


@pytest.mark.parametrize("make", [loop, bank_and_network], ids=["loop", "bank and network"])
def test_a_graph_chains_the_tangents_of_its_blocks(make):
    graph, rng = make(), np.random.default_rng(2)
    c = after(graph, rng.uniform(-1, 1, 8))
    for _ in range(20):
        put(c, rng.uniform(-1, 1, graph.n_inputs))
        c.x = rng.normal(size=len(c.x))
        c.evaluate(0.0)
        du, dx = rng.normal(size=graph.n_inputs), rng.normal(size=len(c.x))
        got = np.concatenate(c.tangent(du, dx, graph.n_outputs))
        np.testing.assert_allclose(got, differences(graph, c, du, dx), rtol=1e-7, atol=1e-8)
    assert np.abs(got).min() > 1e-4


def test_a_steep_duhem_operator_has_the_derivative_of_its_long_steps():
    """Where they are too long for the law, its own slope at their end may be several times that of the answer."""
    values = {"a_rise": [3.0, 1.0], "k": 0.0, "b_rise": [-90.0, 5.0, -9.0, 2.0], "c_rise": [-9.0, 4.0, 3.0, 1.0]}
    values |= {"a_fall": [2.0, 0.5], "b_fall": [80.0, 2.0, 6.0, 1.0], "c_fall": [8.0, 3.0, 2.0, 2.0]}
    graph = Graph.single(Node("b", "duhem", {"m": 1, "q": 2}, {**values, "du_max": 0.02, "w_max": 0.5}))
    rng, crossed = np.random.default_rng(3), 0
    for _ in range(20):
        c = after(graph, rng.uniform(-1, 1, 5))
        before = c.get(graph.n_inputs)
        for at in rng.uniform(-1, 1, 20):
            put(c, [at])
            c.evaluate(0.0)
            crossed += c.get(graph.n_inputs) * before < 0
            got = c.tangent([1.0], [], 1)[0][0]
            assert got == pytest.approx(differences(graph, c, np.ones(1), np.zeros(0))[0], rel=1e-6, abs=1e-7)
    assert crossed > 20


def test_duhem_turns_by_its_law_and_stays_at_its_bound():
    values = {"k": 2.0, "a_rise": 1.0, "b_rise": 5.0, "c_rise": 0.5, "a_fall": 0.7, "b_fall": -0.2, "c_fall": 0.3}
    graph = Graph.single(Node("b", "duhem", {}, {**values, "w_max": 3.0}))
    w = graph.run([0.0, 0.1, 0.2])[-1] - 2.0 * 0.2
    assert 0.1 < w < 1.0
    up, down = 2.0 + 1.0 + 5.0 * w + 0.5 * w, 2.0 + 0.7 - 0.2 * w + 0.3 * w
    assert tangents(graph, [0.0, 0.1, 0.2], 0.2) == pytest.approx([up, down], rel=1e-14)
    assert tangents(graph, [0.0, 100.0], 100.0) == pytest.approx([2.0, 2.0 + 0.7 - 0.2 * 3.0 + 0.3 * 3.0], rel=1e-14)
    for far in (50.0, 1e300):  # where a step leaves the range of numbers too
        assert tangents(graph, [0.0, 0.1], far) == [2.0, 2.0]


def test_sampled_blocks_hold():
    nodes = [Node("a", "pid"), Node("b", "scaling", {"n": 1}, {"gain": 3.0})]
    graph = Graph(
        nodes,
        [("a.u", "b.u")],
        [Input("u", ("a.u_ff",)), Input("y", ("a.y",))],
        [Output("v", "b.y"), Output("w", "a.u")],
    )
    assert after(graph, [[0.1, 0.2], [0.3, 0.4]]).tangent([1.0, 1.0], [], 2)[0].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("gain", [1.0, -2.0])
def test_through_an_implicit_inverse_it_is_the_reciprocal_slope_of_the_model(gain):
    values = {"w0": 0.5, "r": [0.25], "w": [1.0]}
    nodes = [
        Node("inv", "implicit_inverse", {}, {"lo": -1.0, "hi": 1.0}),
        Node("play", "backlash_sum", {}, values),
        Node("m", "scaling", {"n": 1}, {"gain": gain}),
    ]
    wires = [("inv.u", "play.u"), ("play.y", "m.u"), ("m.y", "inv.h")]
    graph = Graph(nodes, wires, [Input("y", ("inv.y",))], [Output("u", "inv.u"), Output("h", "m.y")])
    model = Graph.single(Node("b", "backlash_sum", {}, values))
    y = gain * model.run([0.0, 0.7])  # the model is taken to 0.7
    c = after(graph, y)
    outward = np.sign(gain)
    assert c.tangent([outward], [], 2)[0] == pytest.approx([1 / (1.5 * abs(gain)), outward], rel=1e-12)
    assert c.tangent([-outward], [], 2)[0] == pytest.approx([-1 / (0.5 * abs(gain)), -outward], rel=1e-12)
    put(c, [100.0 * outward])  # out of range: u stays at its limit
    c.evaluate(0.0)
    assert c.tangent([1.0], [], 2)[0].tolist() == [0.0, 0.0]


def test_the_implicit_inverse_of_a_network_against_differences():
    m = fitted("play_bank_mlp", iterations=10, starts=1)
    graph = inverse(m, "implicit").graph
    c = after(graph, m.predict(0.7 * signals.nested_reversals(5, 5)))
    rng = np.random.default_rng(1)
    for y in m.predict(np.r_[0.0, rng.uniform(-0.6, 0.6, 12)])[1:]:
        put(c, [y])
        c.evaluate(0.0)
        got = c.tangent([1.0], [], 1)[0][0]
        assert got == pytest.approx(differences(graph, c, np.ones(1), np.zeros(0))[0], rel=1e-6)

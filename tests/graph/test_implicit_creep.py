"""Implicit inverse of a model with creep: its lags before a step are known, so one root gives the input of the step."""

import numpy as np
import pytest

from hystfmu import Graph, InputError, Model, Node
from hystfmu.core.executor import ContinuousExecutor
from hystfmu.data import signals
from hystfmu.graph import Input, Output
from hystfmu.inverse import inverse

H = 1e-3
PLAYS = Node("plays", "prandtl_ishlinskii", {}, {"w0": 1.0, "r": [0.1, 0.3], "w": [0.5, 0.25]})


def model(start="steady", step=H, u0=0.0):
    """Build y = plays(u) + creep(u) + bend(lag of the plays): two creeps, one of them inside a curve."""
    nodes = [
        PLAYS,
        Node("creep", "creep", {}, {"w": [0.4, 0.2], "T": [H, 0.05], "start": start}),
        Node("lag", "creep", {}, {"w": [1.0], "T": [4 * H], "start": start}),
        Node("bend", "dead_zones", {}, {"w0": 0.5, "r": [0.2], "w": [0.3]}),
        Node("readout", "sum", {"n": 3}, {"offset": 0.7}),
    ]
    wires = [("plays.y", "lag.u"), ("lag.y", "bend.u")]
    wires += [(f"{n}.y", f"readout.u[{k}]") for k, n in enumerate(("plays", "creep", "bend"), 1)]
    graph = Graph(nodes, wires, [Input("u", ("plays.u", "creep.u"), start=u0)], [Output("y", "readout.y")])
    return Model("crept", graph, step, "", {}, {"span_u": [-1.0, 1.0]})


@pytest.mark.parametrize("u0", [0.0, 0.3])
def test_in_cascade_it_is_exact_to_rounding(u0):
    m = model(u0=u0)
    made = inverse(m, "implicit")
    assert made.fit["cascade_max_percent"] <= 1e-12 * 100
    u = np.concatenate([[u0], 0.9 * signals.nested_reversals(40, 3)])
    y = m.predict(u)
    found = made.predict(y)
    assert np.abs(m.predict(found) - y).max() <= 1e-14 * np.ptp(y)
    assert np.abs(found - u).max() <= 1e-13


def test_the_lags_stay_before_the_inverse_when_blocks_are_sorted_again():
    g = inverse(model(), "implicit").graph
    again = Graph(g.nodes, g.wires, g.inputs, g.outputs)
    assert [n.name for n in again.nodes] == [n.name for n in g.nodes]


def test_its_derivatives_by_the_wanted_output_and_by_the_lags_agree_with_differences():
    c = ContinuousExecutor(inverse(model(), "implicit").graph.to_bytes())
    wanted, x, d = 1.9, np.array([0.02, -0.01, 0.03]), 1e-7

    def out(y, states):
        c.set(0, y)
        c.x = states
        c.evaluate(0.0)
        return c.get(1)

    c.set(0, 0.7)
    c.start(0.0)
    for k, axis in enumerate(np.eye(4)):
        ahead, back = (out(wanted + s * d * axis[0], x + s * d * axis[1:]) for s in (1, -1))
        out(wanted, x)
        slope = c.tangent(axis[:1], axis[1:], 1)[0][0]
        assert slope == pytest.approx((ahead - back) / (2 * d), rel=1e-6), k
        assert slope != 0


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: model(start="rest"), "'start' parameter of creep must be 'steady' .* Got 'rest' instead"),
        (lambda: model(step=None), "model crept must state its step"),
    ],
)
def test_what_it_needs_is_said(make, words):
    with pytest.raises(InputError, match=words):
        inverse(make(), "implicit")

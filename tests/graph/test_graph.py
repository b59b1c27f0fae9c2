"""Graphs: order, wires, algebraic loops, dependencies, the block file."""

import numpy as np
import pytest

from hystfmu import Graph, InputError, Node, Unit
from hystfmu.graph import Input, Output

PLAYS = {"r": [0.1, 0.2, 0.3], "w": [1.0, 2.0, 0.5], "w0": 0.7}


def play_sum(u, r, w, w0):
    z, y = np.zeros(len(r)), []
    for x in u:
        z = np.maximum(x - r, np.minimum(x + r, z))
        y.append(w0 * x + w @ z)
    return np.array(y)


def chain(*order):
    nodes = {"a": Node("a", "backlash_sum", values=PLAYS), "b": Node("b", "prandtl_ishlinskii", values=PLAYS)}
    return Graph([nodes[k] for k in order], [("a.y", "b.u")], [Input("u", ("a.u",))], [Output("y", "b.y")])


def test_a_chain_is_evaluated_from_input_to_output_in_whatever_order_it_is_listed():
    u = np.random.default_rng(1).uniform(-1, 1, 500)
    r, w = np.array(PLAYS["r"]), np.array(PLAYS["w"])
    expected = play_sum(play_sum(u, r, w, 0.7), r, w, 0.7)
    for order in ("ab", "ba"):
        assert np.abs(chain(*order).run(u) - expected).max() < 1e-13


def test_a_loop_of_blocks_with_feedthrough_is_refused_with_the_names_along_it():
    a, b = Node("first", "backlash_sum"), Node("second", "backlash_sum")
    with pytest.raises(InputError, match=r"algebraic loop: (first <- second <- first|second <- first <- second)"):
        Graph([a, b], [("first.y", "second.u"), ("second.y", "first.u")])


def test_the_core_refuses_an_algebraic_loop_by_itself(monkeypatch):
    a, b = Node("first", "backlash_sum"), Node("second", "backlash_sum")
    monkeypatch.setattr("hystfmu.graph.graph.evaluation_order", lambda nodes, links: [0, 1])
    with pytest.raises(InputError, match=r"algebraic loop: .*first.* <- .*second"):
        Graph([a, b], [("first.y", "second.u"), ("second.y", "first.u")]).executor()


def test_a_loop_with_a_delay_reads_the_held_value():
    # y_k = u_k + 0.5 y_{k-1}: a geometric series
    g = Graph(
        [Node("add", "sum", {"n": 2}, {"k": [1.0, 0.5]}), Node("z", "delay", {"n": 1})],
        [("add.y", "z.u"), ("z.y", "add.u[2]")],
        [Input("u", ("add.u[1]",))],
        [Output("y", "add.y")],
    )
    # the delay goes first: after its update with the held y_{k-1} it gives y_{k-2}; so y_k = 1 + 0.5 y_{k-2}
    y = g.run(np.ones(9))
    expected = [1.0, 1.0]
    for k in range(2, 9):
        expected.append(1 + 0.5 * expected[k - 2])
    assert y.tolist() == expected


@pytest.mark.parametrize(
    ("wires", "message"),
    [
        ([("a.y", "c.u")], r"The block of a connection end must be one of \['a', 'b'\]. Got 'c.u' instead."),
        (
            [("a.q", "b.u")],
            r"The output of backlash_sum at a connection end must be one of \['y'\]. Got 'a.q' instead.",
        ),
        ([("a.y", "b.w")], r"The input of backlash_sum at a connection end must be one of \['u'\]. Got 'b.w' instead."),
        ([("a.y", "b.u"), ("a.y", "b.u")], "An input of 'b' must have one source. Got two connections."),
        ([("a.y[2]", "b.u")], r"must be in 1\.\.1. Got 2 instead."),
    ],
)
def test_bad_wires_are_refused(wires, message):
    with pytest.raises(InputError, match=message):
        Graph([Node("a", "backlash_sum"), Node("b", "backlash_sum")], wires)


@pytest.mark.parametrize(
    ("dims", "values", "message"),
    [
        ({}, {"q": 1.0}, "A parameter of backlash_sum must be one of .*. Got 'q' instead."),
        ({"m": 3}, {}, r"A size of backlash_sum must be one of \['n'\]. Got 'm' instead."),
        ({"n": 0}, {}, "The 'n' size of b must be an int in .*. Got 0 instead."),
        ({"n": 3}, {"w": [1.0, 2.0]}, "must have 3 values. Got 2"),
        ({}, {"r": [-0.1]}, r"The 'r' parameter of b must be a float in \[0, inf\). Got -0.1 instead."),
        ({}, {"w0": float("nan")}, r"The 'w0' parameter of b must be a float in \(-inf, inf\). Got nan instead."),
        ({}, {"w0": "x"}, "must be a number. Got 'x'"),
    ],
)
def test_bad_values_are_refused(dims, values, message):
    with pytest.raises(InputError, match=message):
        Node("b", "backlash_sum", dims, values)


def test_dependencies_follow_the_wires():
    g = Graph(
        [Node("a", "backlash_sum"), Node("b", "backlash_sum"), Node("z", "delay", {"n": 1})],
        [("a.y", "z.u")],
        [Input("u", ("a.u",)), Input("v", ("b.u",))],
        [Output("y", "a.y"), Output("q", "b.y"), Output("d", "z.y")],
    )
    assert g.dependencies() == {"y": ("u",), "q": ("v",), "d": ()}


def test_unit_refuses_what_an_fmu_refuses():
    unit = Unit(chain("a", "b"))
    with pytest.raises(InputError, match="before initialize"):
        unit.do_step(0.0, 1e-3)
    unit.initialize(0.0, u=0.3)
    for h in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(InputError, match="finite and greater than 0"):
            unit.do_step(0.0, h)
    with pytest.raises(InputError, match=r"The variable must be one of .*\. Got 'x' instead."):
        unit.get("x")
    with pytest.raises(InputError, match="is an output"):
        unit.set("y", 1.0)
    with pytest.raises(InputError, match="fixed"):
        unit.set("b_w0", 1.0)
    with pytest.raises(InputError, match=r"Got nan instead\."):
        unit.set("u", float("nan"))


def test_reset_is_a_new_instance():
    g = chain("a", "b")
    used, new = Unit(g), Unit(g)
    used.set("a_w0", 3.0)
    used.initialize(0.0, u=0.9)
    used.do_step(0.0, 1e-3)
    used.reset()
    for unit in (used, new):
        unit.initialize(0.0, u=0.1)
        unit.set("u", -0.4)
        unit.do_step(0.0, 1e-3)
    assert used.get("y") == new.get("y")
    assert used.state.tobytes() == new.state.tobytes()


def test_a_step_that_differs_by_rounding_is_the_same_step():
    # a master that steps from t_k to t_{k+1} and passes the difference
    g = Graph.single(Node("g0", "transfer_function", values={"b": [1.0], "a": [1e-7, 4e-4, 1.0]}))
    even, jitter = Unit(g), Unit(g)
    t = 1e4 + 1e-4 * np.arange(300)
    assert len(set(np.diff(t))) > 1
    for unit in (even, jitter):
        unit.initialize(t[0])
        unit.set("u", 1.0)
    for k in range(len(t) - 1):
        even.do_step(t[k], t[1] - t[0])
        jitter.do_step(t[k], t[k + 1] - t[k])
        assert even.get("y") == jitter.get("y")

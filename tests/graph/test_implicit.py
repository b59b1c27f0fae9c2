"""Implicit inverse: root finding in the core for any static model, anywhere in a graph."""

import numpy as np
import plants
import pytest
from scipy.optimize import brentq
from test_inverse import chain, dead_zones, fitted, plays_only, wanted

from hystfmu import Graph, Input, InputError, Model, Node, Output, Unit, signals
from hystfmu.core.executor import ContinuousExecutor
from hystfmu.inverse import inverse
from hystfmu.scenario import Cases, build, simulate, to_graph

LIMITS = {"lo": -2.0, "hi": 2.0}


def around(model_nodes, wires, ends, source, **limits):
    """A graph with an implicit inverse of the nodes: input y to `ends`, model output `source`."""
    nodes = [Node("inv", "implicit_inverse", {}, limits), *model_nodes]
    wires = [*wires, *(("inv.u", e) for e in ends), (source, "inv.h")]
    return Graph(nodes, wires, [Input("y", ("inv.y",))], [Output("u", "inv.u"), Output("h", source)])


@pytest.mark.parametrize("make", [
    fitted,
    lambda: dead_zones(1.0, [-0.5, -0.2, 0.3, 0.6], [0.5, -0.7, 2.0, -2.9]),
    chain,  # falls, has limits, and a Zhao-Tan branch begins with slope 0
], ids=["prandtl_ishlinskii", "dead zones", "zhao_tan"])  # fmt: skip
def test_it_is_the_exact_inverse_where_there_is_one(make):
    model = make()
    u = signals.nested_reversals(60, 3)
    if model.key == "chain":
        u = 0.6 * u + 0.2
    y = model.predict(u)
    implicit, exact = inverse(model, "implicit", **LIMITS), inverse(model)
    v = implicit.predict(y)
    assert np.abs(model.predict(v) - y).max() <= 1e-12 * np.ptp(y)
    if model.key != "chain":  # where the slope is 0, the error of u is the square root of that of y
        assert np.abs(v - exact.predict(y)).max() <= 1e-12 * np.ptp(u)
    assert np.abs(v - u).max() <= 1e-7


@pytest.mark.stress
def test_bank_and_network_linearise_the_true_plant_on_nested_loops():
    """S6: at most 0.5 % of span, the plant itself behind the inverse, on signals held out from the fit."""
    m = fitted("play_bank_mlp", starts=1, iterations=60, N=24)
    inv = inverse(m, "implicit")
    assert inv.fit["cascade_max_percent"] < 1e-10  # of its own model it is an exact inverse
    span = np.ptp(plants.prandtl_ishlinskii(signals.training(5, 1)))
    for name, r in wanted(m, 0.85):
        e = plants.prandtl_ishlinskii(inv.predict(r)) + 4 - r
        assert np.abs(e).max() <= 5e-3 * span, name


def test_it_survives_its_file(tmp_path):
    made = inverse(fitted(), "implicit")
    made.save(tmp_path / "i.model.toml")
    assert Model.load(tmp_path / "i.model.toml").graph.to_bytes() == made.graph.to_bytes()
    assert (made.key, made.graph.inputs[0].unit, made.graph.outputs[0].unit) == (
        "prandtl_ishlinskii_inverse",
        "um",
        "V",
    )


@pytest.mark.parametrize("gain", [2.0, -2.0])
def test_beyond_its_range_it_stays_at_the_limit_and_comes_back(gain):
    scale = Node("m", "scaling", {"n": 1}, {"gain": gain})
    g = around([scale], [], ["m.u"], "m.y", lo=-1.0, hi=3.0)
    sign = np.sign(gain)
    y = np.array([0.0, 5.0, 9.0, -1.0, -7.0, 4.0]) * sign
    assert np.array_equal(g.run(y)[:, 0], [0.0, 2.5, 3.0, -0.5, -1.0, 2.0])


TENT = {"w0": 1.0, "r": [0.5], "w": [-2.0]}  # rises to 0.5 at 0.5, then falls


def test_of_two_roots_it_takes_the_one_near_the_last():
    unit = Unit(around([Node("m", "dead_zones", {}, TENT)], [], ["m.u"], "m.y", lo=0.0, hi=1.0))
    unit.initialize(0.0, y=0.25)
    assert unit.get("u") == 0.25

    def step(**values):
        for name, v in values.items():
            unit.set(name, v)
        unit.do_step(0.0, 1.0)
        return unit.get("u")

    assert step(y=0.3) == pytest.approx(0.3, abs=1e-15)
    assert step(y=0.3, inv_lo=0.6) == pytest.approx(0.7, abs=1e-15)
    assert step(y=0.35, inv_lo=0.0) == pytest.approx(0.65, abs=1e-15)  # 0.35 is a root as well, further away
    found = {step(y=0.8) for _ in range(3)}  # out of reach: returns the extremum, and the same one again
    assert len(found) == 1
    assert abs(found.pop() - 0.5) < 0.002


def test_at_the_start_the_model_is_tried_as_it_starts():
    """Bouc-Wen comes to its first input from u0: z = 1 - (1 - z0) exp(u0 - u) rising, for n = 1 and beta = gamma."""
    values = {"A": 1.0, "alpha": 0.5, "k": 2.0, "z0": 0.3, "u0": 0.1}
    g = around([Node("m", "bouc_wen", {}, values)], [], ["m.u"], "m.y", **LIMITS)
    u, h = g.run(np.array([0.9, 0.9, 1.0])).T
    assert u[0] == pytest.approx(brentq(lambda v: v + 1 - 0.7 * np.exp(0.1 - v) - 0.9, 0.1, 1.0), abs=1e-12)
    assert u[1] == u[0]
    assert h == pytest.approx([0.9, 0.9, 1.0], abs=1e-15)


def network_inverse():
    """The inverse of a network model, and wanted outputs that it can reach."""
    m = fitted("play_bank_mlp", iterations=10, starts=1)
    return inverse(m, "implicit").graph, m.predict(0.8 * signals.nested_reversals(20, 5))


def test_trials_leave_no_trace_and_commits_are_steps():
    g, r = network_inverse()
    c, got = ContinuousExecutor(g.to_bytes()), []
    for k, v in enumerate(r):
        if k == 0:
            c.set(0, v)
            c.start(0.0)
        else:
            for trial in (v + 1, v - 1, v):
                c.set(0, trial)
                c.evaluate(float(k))
            c.commit(float(k))
        got.append(c.get(1))
    assert np.array(got).tobytes() == g.run(r).tobytes()


def test_asked_again_it_answers_the_same_and_sees_new_parameters():
    """An importer may repeat an event at one time and hold an input: no bit may change."""
    g, r = network_inverse()
    c, got = ContinuousExecutor(g.to_bytes()), []
    for k, v in enumerate(r):
        c.set(0, v)
        if k == 0:
            c.start(0.0)
        for _ in range(3):
            c.commit(float(k))
            got.append(c.get(1))
    assert np.array_equal(np.repeat(g.run(r), 3), got)
    held = np.repeat(r, 3)
    assert np.array_equal(g.run(held).ravel(), got)
    unit = Unit(around([Node("m", "scaling", {"n": 1})], [], ["m.u"], "m.y", **LIMITS))
    unit.initialize(0.0, y=0.6)
    unit.set("m_gain", 1.5)
    unit.do_step(0.0, 1.0)
    assert unit.get("u") == pytest.approx(0.4, abs=1e-15)
    for limit, value, want in (("hi", 0.3, 0.3), ("hi", 2.0, 0.4), ("lo", 0.5, 0.5), ("lo", -2.0, 0.4)):
        unit.set(f"inv_{limit}", value)
        unit.do_step(0.0, 1.0)
        assert unit.get("u") == pytest.approx(want, abs=1e-15)


# ---- refusals ------------------------------------------------------------------------------------------------------
A, B = Node("a", "backlash_sum"), Node("b", "backlash_sum")


def wrong_order():
    nodes = [A, Node("inv", "implicit_inverse")]
    wires = [("inv.u", "a.u"), ("a.y", "inv.h")]
    return Graph(nodes, wires, [Input("y", ("inv.y",))], [Output("u", "inv.u")], sort=False)


def model_from_behind():
    nodes = [Node("inv", "implicit_inverse"), A, B]
    wires = [("inv.u", "b.u"), ("b.y", "a.u"), ("a.y", "inv.h")]
    return Graph(nodes, wires, [Input("y", ("inv.y",))], [Output("u", "inv.u")], sort=False)


def one_model_for_two():
    c = Node("c", "sum", {"n": 2})
    nodes = [Node("i1", "implicit_inverse"), Node("i2", "implicit_inverse"), c]
    wires = [("c.y", "i1.h"), ("c.y", "i2.h")]
    return Graph(nodes, wires, [Input("y", ("i1.y", "i2.y"))], [Output("u", "i1.u")])


@pytest.mark.parametrize(("make", "words"), [
    (lambda: around([Node("g0", "transfer_function")], [], ["g0.u"], "g0.y"), "at g0: .* not have dynamics"),
    (lambda: around([Node("d", "differentiator")], [], ["d.u"], "d.du"), "at d: .* the sample time"),
    (
        lambda: around(
            [A, Node("r", "disturbance"), Node("s", "sum")], [("a.y", "s.u[1]"), ("r.d", "s.u[2]")], ["a.u"], "s.y"
        ),
        "at r: .* must not depend on the time",
    ),
    (lambda: around([A, Node("i", "implicit_inverse")], [("a.y", "i.y")], ["a.u"], "i.u"),
     "at i: an implicit inverse must not be between"),
    (wrong_order, "at a: the model .* must follow it in the order of the file"),
    (model_from_behind, "at b: the model .* must follow it in the order of the file"),
    (one_model_for_two, "at c: it belongs to the models of two implicit inverses"),
])  # fmt: skip
def test_what_cannot_be_tried_is_refused_with_its_name(make, words):
    with pytest.raises(InputError, match=f"^no implicit inverse {words}") as e:
        make().executor()
    assert "\n" not in str(e.value)


def test_a_model_reads_other_inputs_that_hold_during_the_search():
    """y = 2 u d + d, so u = (y - d) / (2 d) and du = (dy - dd) / (2 d) - (y - d) dd / (2 d^2)."""
    nodes = [
        Node("inv", "implicit_inverse"),
        Node("p", "product", {"n": 2, "m": 0}),
        Node("s", "sum", {}, {"k": [2.0, 1.0]}),
    ]
    wires = [("inv.u", "p.u[1]"), ("p.y", "s.u[1]"), ("s.y", "inv.h")]
    inputs = [Input("y", ("inv.y",)), Input("d", ("p.u[2]", "s.u[2]"), start=1.0)]
    graph = Graph(nodes, wires, inputs, [Output("u", "inv.u")])
    assert graph.dependencies() == {"u": ("y", "d")}
    y, d = np.random.default_rng(0).uniform([[-1], [1]], [[1], [3]], (2, 50))
    np.testing.assert_allclose(graph.run(np.column_stack([y, d])), (y - d) / (2 * d), rtol=1e-12)
    unit = Unit(graph)
    unit.initialize(0.0, y=0.3, d=2.0)
    (found,) = unit.tangent(0.0, np.array([0.7, -0.4]))
    assert found == pytest.approx((0.7 + 0.4) / 4 + (0.3 - 2) * 0.4 / 8, rel=1e-9)


def test_a_loop_through_the_wanted_value_is_algebraic():
    with pytest.raises(InputError, match="algebraic loop"):
        Graph([Node("inv", "implicit_inverse"), A], [("inv.u", "a.u"), ("a.y", "inv.y")])


def test_inverse_says_why_not():
    with pytest.raises(InputError, match=r"must change directly after a reversal\. .* without continuous inverse"):
        inverse(plays_only(), "implicit", **LIMITS)
    with pytest.raises(InputError, match="options lo and hi"):
        inverse(chain(), "implicit")
    with pytest.raises(InputError, match="lo must be less than hi"):
        inverse(chain(), "implicit", lo=1.0, hi=-1.0)
    with pytest.raises(InputError, match=r"The options of the .* inverse must be among: .*\. Got 'N' instead"):
        inverse(chain(), "implicit", N=3)


# ---- in a loop and in a scenario ------------------------------------------------------------------------------------
def test_inside_a_closed_loop_it_does_what_the_exact_inverse_does():
    values = {"w0": 0.5, "r": [0.1, 0.3, 0.5], "w": [0.4, 0.3, 0.2]}
    plant = [
        Node("plays", "backlash_sum", {}, values),
        Node("g0", "transfer_function", {}, {"b": [1.0], "a": [1e-4, 0.02, 1.0]}),
    ]
    pid = Node("pid", "pid", {}, {"Kp": 0.2, "Ki": 10.0})
    wires = [("plays.y", "g0.u"), ("g0.y", "pid.y")]
    ins, outs = [Input("r", ("pid.y_d", "pid.u_ff"))], [Output("y", "g0.y")]
    exact = Graph(
        [*plant, pid, Node("inv", "prandtl_ishlinskii_inverse", {}, values)],
        [*wires, ("pid.u", "inv.y"), ("inv.u", "plays.u")],
        ins,
        outs,
    )
    implicit = Graph(
        [*plant, pid, Node("inv", "implicit_inverse", {}, LIMITS), Node("m", "prandtl_ishlinskii", {}, values)],
        [*wires, ("pid.u", "inv.y"), ("inv.u", "plays.u"), ("inv.u", "m.u"), ("m.y", "inv.h")],
        ins,
        outs,
    )
    r = signals.nested_reversals(30, 2) * 0.8
    np.testing.assert_allclose(implicit.run(r, 1e-3), exact.run(r, 1e-3), rtol=0, atol=1e-12)
    assert np.ptp(implicit.run(r, 1e-3)) > 0.8


SCENARIO = """
name = "implicit"
step = 1e-3
stop = 0.4
order = ["reference", "inverse"]
record = ["reference.r", "inverse.y"]
[units.reference]
block = "reference"
values = { shape = "random_reversals", amplitude = 0.5, offset = 4.0, frequency = 20.0 }
[units.inverse]
model = "../inverse.model.toml"
as = "KIND"
[connections]
"inverse.u" = "reference.r"
[metrics.size]
kind = "rms_percent"
signal = "inverse.y"
against = "reference.r"
stroke = 1.0
"""


def test_in_a_scenario_all_engines_give_the_same_bits(tmp_path):
    inverse(fitted("play_bank_mlp", iterations=10, starts=1), "implicit").save(tmp_path / "inverse.model.toml")
    traces = []
    for kind in ("fmu2", "fmu3"):
        folder = tmp_path / kind
        folder.mkdir()
        (folder / "scenario.toml").write_text(SCENARIO.replace("KIND", kind))
        system = build(Cases(folder).cases[0])
        traces += [simulate(system).values.tobytes(), simulate(system, "native").values.tobytes()]
    fused = to_graph(system).run(np.zeros((system.n_steps + 1, 0)), system.h)
    assert set(traces) == {fused.tobytes()}
    assert np.ptp(fused[:, -1]) > 0.1


# ---- Implicit inverse of a model with creep: its lags before a step are known, so one root gives the input of the
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


@pytest.mark.parametrize(("make", "words"), [
    (lambda: model(start="rest"), "'start' parameter of creep must be 'steady' .* Got 'rest' instead"),
    (lambda: model(step=None), "model crept must state its step"),
])  # fmt: skip
def test_what_it_needs_is_said(make, words):
    with pytest.raises(InputError, match=words):
        inverse(make(), "implicit")

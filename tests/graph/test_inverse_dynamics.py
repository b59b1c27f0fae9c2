"""Inverses of a hysteresis with linear dynamics behind it: the cascade tracks late by whole steps, as stated."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from invoked import invoked
from series import series

import hystfmu as hy
from hystfmu import Graph, Input, InputError, Node, Output, signals
from hystfmu.identify.estimate.dynamics import Dynamics
from hystfmu.inverse import dynamic, inverse
from hystfmu.inverse.dynamic import split
from hystfmu.model import Model

F_N = 500.0
PLAYS = Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": 0.6, "r": [0.05, 0.2, 0.5], "w": [0.3, 0.2, 0.1]})


def plays(h: float, hold: str, zeta: float = 0.7, delay: float = 0.0) -> Model:
    """Return three plays, G0 with delay, and a readout."""
    graph = series(
        Node("input", "scaling", {"n": 1}, {"gain": 0.02, "offset": -1.0}), PLAYS,
        *Dynamics(F_N, zeta, delay).nodes(h, hold), Node("readout", "scaling", {"n": 1}, {"gain": -5.0, "offset": 3.0}),
        units=("V", "um"), start=50.0,
    )  # fmt: skip
    return Model("g0_prandtl_ishlinskii", graph, h, "", {}, {"span_u": [0.0, 100.0]})


def bouc_wen(h: float, hold: str) -> Model:
    """Return a linear term minus a Bouc-Wen state, G0, and a readout."""
    nodes = [
        Node("operator", "bouc_wen", {}, {"A": 1.0, "beta": 1.4, "gamma": -0.3, "n": 1.0, "alpha": 0.0, "k": 1.0}),
        Node("hysteresis", "sum", {"n": 2}, {"k": [2.4, -1.1]}),
        *Dynamics(F_N, 0.7, 2e-5).nodes(h, hold),
        Node("readout", "scaling", {"n": 1}, {"offset": 0.2}),
    ]
    wires = [("operator.z", "hysteresis.u[2]"), ("hysteresis.y", "g0.u"), ("g0.y", "readout.u")]
    inputs = [Input("u", ("operator.u", "hysteresis.u[1]"))]
    return Model("g0_bouc_wen", Graph(nodes, wires, inputs, [Output("y", "readout.y")]), h, "", {}, {"span_u": [-1, 1]})


def tracked(model: Model, made: Model, f: float, middle: float, amplitude: float) -> float:
    """Return the largest error (% of span) of a sine that starts smoothly, after the stated lag."""
    assert model.step is not None
    t = np.arange(round(6 / f / model.step)) * model.step
    wanted = middle + amplitude * (1 - np.exp(-((t * f) ** 3))) * np.sin(2 * np.pi * f * t)
    reached = model.predict(made.predict(wanted, model.step))
    late = made.fit["lag_steps"]
    return float(100 * np.abs(reached[late:] - wanted[: len(t) - late]).max() / np.ptp(wanted))


@pytest.mark.parametrize("hold", ["zoh", "foh"])
@pytest.mark.parametrize(("h", "zeta", "delay"), [(1e-4, 0.7, 0.0), (1e-4, 0.04, 3.4e-4), (4e-4, 0.7, 9e-4)])
def test_plays_and_dynamics_track_within_a_thousandth(hold: str, h: float, zeta: float, delay: float) -> None:
    model = plays(h, hold, zeta, delay)
    made = inverse(model)
    assert made.fit["cascade_max_percent"] <= 0.1
    assert made.fit["lag"] == made.fit["lag_steps"] * h >= delay // h * h
    assert made.fit["band"] == pytest.approx(F_N / 10)
    for f in (5.0, F_N / 10):
        assert tracked(model, made, f, 3.0, 3.0) <= 0.1
    assert made.predict(np.full(9, 3.0)).tolist() == [pytest.approx(50.0, abs=1e-10)] * 9  # at rest from the start


def test_bouc_wen_and_dynamics_track_by_one_root_a_step() -> None:
    model = bouc_wen(1e-4, "zoh")
    with pytest.raises(InputError, match="'implicit'"):
        inverse(model)
    made = inverse(model, "implicit")
    assert made.fit["cascade_max_percent"] <= 0.1
    assert tracked(model, made, F_N / 10, 0.2, 1.0) <= 0.1
    assert any(n.type == "implicit_inverse" for n in made.graph.nodes)


def test_bend_and_creep_before_the_dynamics_track_too() -> None:
    """The chain of the kind `actuator`."""
    h = 1e-4
    graph = series(
        PLAYS,
        Node("bend", "dead_zones", {}, {"w0": 1.0, "r": [-0.3, 0.4], "w": [0.2, -0.3]}),
        Node("creep", "creep", {}, {"w0": 1.0, "w": [0.05, 0.1], "T": [0.01, 0.1], "start": "steady"}),
        *Dynamics(F_N, 0.05, 3.4e-4).nodes(h, "zoh"),
        Node("readout", "scaling", {"n": 1}, {"offset": 0.3}),
    )
    model = Model("actuator", graph, h, "", {}, {"span_u": [-1.0, 1.0]})
    made = inverse(model)
    assert made.fit["cascade_max_percent"] <= 0.1
    assert tracked(model, made, F_N / 10, 0.3, 0.5) <= 0.1


def test_three_samples_are_the_feedforward_by_central_differences() -> None:
    """2 zeta / omega_n and 1 / omega_n^2 from the weights; the step is so short that the hold does not count."""
    h = 1e-6
    made = inverse(plays(h, "foh"))
    (node,) = (n for n in made.graph.nodes if n.type == "polynomial_narx")
    taps = -5.0 * node.value("theta")[:-1]
    w = 2 * np.pi * F_N
    assert len(taps) == 3
    first, second = (taps[0] - taps[2]) / 2, taps[0] + taps[2]
    assert taps.sum() == pytest.approx(1, abs=1e-9)
    assert 2 * h * first == pytest.approx(2 * 0.7 / w, rel=1e-3)
    assert h**2 * second / 2 == pytest.approx(1 / w**2, rel=1e-3)


@pytest.mark.parametrize(("h", "zeta", "ahead"), [(5.9e-5, 0.7, 1), (6.5e-5, 0.7, 2), (1.91e-3, 0.04, 8)])
def test_as_few_steps_ahead_as_an_error_of_a_ten_thousandth_at_50_hertz_allows(
    h: float, zeta: float, ahead: int
) -> None:
    parts = split(plays(h, "zoh", zeta))
    assert parts is not None
    found, taps = dynamic.feedforward(parts, h)
    z = np.exp(1j * min(2 * np.pi * 50 * h, np.pi / 10))  # at long steps, twenty samples a cycle
    ((b, a),) = parts.fractions(h)
    product = taps @ z ** -np.arange(2.0 * found + 1) * z**found * np.polyval(b, z) / np.polyval(a, z)
    assert (found, abs(product - 1) <= 1e-4) == (ahead, True)


@pytest.mark.parametrize(("h", "samples"), [(1e-4, 200), (4e-3, 20)])
def test_wanted_outputs_begin_at_rest_and_fill_a_share_of_the_range(h: float, samples: int) -> None:
    model = plays(h, "zoh")
    parts = split(model)
    assert parts is not None
    reached = 3.0 - 5.0 * Graph.single(PLAYS).run(0.5 * np.array([0.0, 1.0, -1.0, 1.0])).ravel()
    low, high = reached.min(), reached.max()
    tones = round(3.7 * samples)
    shapes = [(samples, signals.decaying_sine(8, 0.1, samples)), (samples, signals.decaying_sine(6, 0.3, samples))]
    shapes.append((tones, signals.two_tones(4, 3.7, 0.4, tones)))
    for r, (cycle, v) in zip(dynamic.wanted(model, parts, 0.5), shapes, strict=True):
        want = (low + high) / 2 - (high - low) / 2 * v
        assert r[0] == pytest.approx(3.0, abs=1e-12)
        assert r[cycle:] == pytest.approx(want[cycle:], abs=1e-12)
        half = cycle // 2
        if cycle % 2 == 0:
            assert r[half] == pytest.approx((3.0 + want[half]) / 2, abs=1e-12)


def test_a_scenario_with_that_preview_has_no_lag() -> None:
    model = plays(1e-4, "zoh", delay=3.4e-4)
    made = inverse(model)
    lead = made.fit["lag"]
    loop = hy.Scenario("preview", step=1e-4, stop=0.1)
    sine = hy.blocks.Reference(frequency=50.0, amplitude=3.0, offset=3.0, lead=lead)
    loop.add("reference", sine).add("inverse", made).add("plant", model)
    loop.connect("reference.r_lead", "inverse.u").connect("inverse.y", "plant.u")
    loop.metric("worst", "max_percent", "plant.y", against="reference.r", limit=0.1, after=0.04)
    assert hy.run(loop, engine="native").passed


def test_the_command_says_how_late(tmp_path: Path) -> None:
    plays(1e-4, "zoh", delay=3e-4).save(tmp_path / "m.model.toml")
    out = tmp_path / "i.model.toml"
    result = invoked(["inverse", str(tmp_path / "m.model.toml"), "-o", str(out)])
    late = Model.load(out).fit["lag_steps"]
    assert f"lags the wanted output by {late} steps ({late * 1e-4:.3g} s), for frequencies up to 50 Hz" in result.output


def test_what_is_not_linear_at_the_end_is_not_split() -> None:
    assert split(Model("p", Graph.single(PLAYS), 1e-4)) is None
    assert split(Model("t", Graph.single(Node("g0", "transfer_function")), 1e-4)) is None
    limited = plays(1e-4, "zoh")
    nodes = [n if n.name != "readout" else n.with_values(lo=-1.0) for n in limited.graph.nodes]
    assert split(Model("limited", replace_nodes(limited.graph, nodes), 1e-4)) is None


@pytest.mark.filterwarnings("error")
def test_dynamics_without_static_gain_are_refused() -> None:
    model = plays(1e-4, "zoh")
    high_pass = Node("g0", "transfer_function", {}, {"b": [1.0, 0.0], "a": [1.0, 100.0]})
    nodes = [n if n.name != "g0" else high_pass for n in model.graph.nodes]
    with pytest.raises(
        InputError, match=r"dynamics of .* must have an inverse .* at most 8 samples .* Got an error above"
    ):
        inverse(Model("high_pass", replace_nodes(model.graph, nodes), 1e-4))
    with pytest.raises(InputError, match=r"Got an error above 0\.0001 at 50 Hz with steps of 0.00193 s"):
        inverse(plays(1.93e-3, "zoh", 0.04))


# ---- Adaptive inverses of models: what a model gives them, and what has none
ADAPTED = {"w0": 0.5, "r": [0.1, 0.3], "w": [0.4, 0.2], "u0": 0.1}
OMEGA = 2 * np.pi * 200


def actuator(tail: bool, **plays: object) -> hy.Model:
    """Volts to micrometres: scaled plays, with an offset, and behind them dynamics, a delay and a sensor if asked."""
    nodes = [
        Node("volts", "scaling", {"n": 1}, {"gain": 0.02, "offset": -1.0}),
        Node("hysteresis", "prandtl_ishlinskii", {}, {**ADAPTED, **plays}),
        Node("readout", "scaling", {"n": 1}, {"gain": 30.0, "offset": 4.0}),
    ]
    if tail:
        a = [3.0, 3 * 2 * 0.3 * OMEGA, 3 * OMEGA**2]
        nodes.append(Node("g0", "transfer_function", {"na": 2, "nb": 0}, {"b": [3 * 2 * OMEGA**2], "a": a}))
        nodes.append(Node("wait", "delay", {"n": 2}))
        nodes.append(Node("sensor", "scaling", {"n": 1}, {"gain": 0.5, "offset": -1.0}))
    ends = [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]
    graph = Graph(nodes, ends, [Input("u", ("volts.u",), "V", 55.0)], [Output("y", f"{nodes[-1].name}.y", "um")])
    return hy.Model("stack", graph, 1e-3 if tail else None, "a stack", {"rms": 0.03})


@pytest.mark.parametrize("tail", [False, True])
def test_it_gives_the_volts_of_the_model(tail: bool) -> None:
    """With deviations of 0 it is the exact inverse; the dynamics are left to a feed-forward before it."""
    model = actuator(tail)
    made = model.inverse("adaptive", sd=[0.0] * 3, **({} if tail else {"f_n": 200.0, "zeta": 0.3}))
    v = 55 + 30 * np.sin(np.linspace(0, 20, 400)) * np.linspace(0, 1, 400)
    reached = actuator(False).predict(v)
    wanted = reached - 1 if tail else reached  # static gain 2 of the dynamics, gain 0.5 and offset of the sensor
    u = made.graph.run(np.column_stack([wanted, wanted, wanted]), 1e-3)
    np.testing.assert_allclose(u[:, 0], v, rtol=0, atol=1e-10)
    block = made.graph.node("adaptive")
    assert block.dims["delay"] == (2 if tail else 0)
    assert float(block.value("f_n")[0]) == pytest.approx(200)
    assert float(block.value("zeta")[0]) == pytest.approx(0.3)
    assert [i.unit for i in made.graph.inputs] == ["um"] * 3
    assert made.graph.outputs[0].unit == "V"


def test_the_fit_says_what_an_ordinary_error_is() -> None:
    block = actuator(False).inverse("adaptive", delay=3, T=50.0).graph.node("adaptive")
    assert float(block.value("sigma")[0]) == pytest.approx(0.03 / 30 / 2)
    assert float(block.value("change")[0]) == pytest.approx(1.5 * 0.03 / 30)
    assert block.dims["delay"] == 3
    assert float(block.value("T")[0]) == 50
    np.testing.assert_allclose(block.value("sd"), 0.22 * np.array([0.5, 0.4, 0.2]))
    exact = replace(actuator(False, w=[0.4, 0.05]), fit={}).inverse("adaptive").graph.node("adaptive")
    assert float(exact.value("sigma")[0]) == pytest.approx(1e-3 * 0.95 * 0.3 / 2)
    assert float(exact.value("w0_min")[0]) == 0.25
    np.testing.assert_allclose(exact.value("sd"), 0.22 * np.array([0.5, 0.4, 0.95 / 6]))
    late = Node("wait", "delay", {"n": 2})  # a delay without other dynamics has a static gain of 1
    nodes, wires = actuator(False).graph.nodes, actuator(False).graph.wires
    graph = Graph(
        [*nodes, late], [*wires, ("readout.y", "wait.u")], actuator(False).graph.inputs, [Output("y", "wait.y")]
    )
    made = replace(actuator(False), graph=graph, step=1e-3).inverse("adaptive").graph
    assert made.node("adaptive").dims["delay"] == 2
    assert made.node("ports").value("gain") == pytest.approx(1 / 30)


@pytest.mark.parametrize(("change", "options", "said"), [
    ({}, {"f_x": 1.0}, "Got 'f_x' instead"),
    ({}, {"delay": 0.5}, "The option 'delay' must be a whole number of steps. Got 0.5 instead."),
    ({"w": [0.4, -0.2]}, {}, "must not be negative"),
    ({"w0": 0.0}, {}, "w0 greater than 0"),
])  # fmt: skip
def test_a_model_without_such_an_inverse_is_refused_in_one_line(
    change: dict[str, object], options: dict[str, float], said: str
) -> None:
    with pytest.raises(InputError, match=said) as e:
        actuator(False, **change).inverse("adaptive", **options)
    assert "\n" not in str(e.value)


def replace_nodes(graph: Graph, nodes: list[Node]) -> Graph:
    return Graph(nodes, graph.wires, graph.inputs, graph.outputs)


def test_another_structure_is_refused_by_name() -> None:
    model = hy.Model("bw", Graph.single(Node("h", "bouc_wen")), None, "Bouc-Wen")
    with pytest.raises(InputError, match="Got bouc_wen in bw"):
        model.inverse("adaptive")
    nodes = [Node(name, "prandtl_ishlinskii", {}, ADAPTED) for name in "ab"] + [Node("both", "sum", {"n": 2})]
    wires = [("a.y", "both.u[1]"), ("b.y", "both.u[2]")]
    beside = Graph(nodes, wires, [Input("u", ("a.u", "b.u"))], [Output("y", "both.y")])
    with pytest.raises(InputError, match="Got sum in beside"):
        hy.Model("beside", beside).inverse("adaptive")
    limited = actuator(False)
    nodes = [*limited.graph.nodes[:2], replace(limited.graph.nodes[2], values={"gain": 1.0, "hi": 1.0})]
    with pytest.raises(InputError, match="must have no limits"):
        hy.Model("stack", replace_nodes(limited.graph, nodes), None, "limited").inverse("adaptive")
    nodes[-1] = replace(limited.graph.nodes[2], values={"gain": 0.0})
    with pytest.raises(InputError, match="gain behind hysteresis must not be 0"):
        hy.Model("stack", replace_nodes(limited.graph, nodes), None, "flat").inverse("adaptive")
    slow = actuator(True)
    for values, order in (({"b": [1.0], "a": [1.0, 2.0]}, 1), ({"b": [1.0], "a": [1.0, 2.0, 2.0, 1.0]}, 3)):
        nodes = [Node("g0", "transfer_function", {}, values) if n.name == "g0" else n for n in slow.graph.nodes]
        with pytest.raises(InputError, match=rf"Got 1 transfer function, the first of order {order}\.$"):
            replace(slow, graph=replace_nodes(slow.graph, nodes)).inverse("adaptive")
    first = Graph([Node("g", "transfer_function")], [], [Input("u", ("g.u",))], [Output("y", "g.y")])
    with pytest.raises(InputError):
        hy.Model("lag", first, 1e-3, "a lag").inverse("adaptive")


def test_the_command_writes_it(tmp_path: Path) -> None:
    actuator(True).save(tmp_path / "m.model.toml")
    out = tmp_path / "a.model.toml"
    words = ["inverse", str(tmp_path / "m.model.toml"), "--method", "adaptive", "--set", "delay=1", "-o", str(out)]
    done = invoked(words)
    said = ["inputs v, y_d, y; outputs u, theta, gate, changes"]
    assert done.output.splitlines() == [f"wrote {out}, adaptive inverse", *said]
    made = Model.load(out)
    assert made.graph.node("adaptive").dims["delay"] == 3
    assert [o.name for o in made.graph.outputs] == ["u", "theta", "gate", "changes"]

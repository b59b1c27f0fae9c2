"""Adaptive inverses of models: what a model gives them, and what has none."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import hystfmu as hy
from hystfmu.base.errors import InputError
from hystfmu.cli import main
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model

PLAYS = {"w0": 0.5, "r": [0.1, 0.3], "w": [0.4, 0.2], "u0": 0.1}
OMEGA = 2 * np.pi * 200


def actuator(tail: bool, **plays: object) -> hy.Model:
    """Volts to micrometres: scaled plays, with an offset, and behind them dynamics, a delay and a sensor if asked."""
    nodes = [
        Node("volts", "scaling", {"n": 1}, {"gain": 0.02, "offset": -1.0}),
        Node("hysteresis", "prandtl_ishlinskii", {}, {**PLAYS, **plays}),
        Node("readout", "scaling", {"n": 1}, {"gain": 30.0, "offset": 4.0}),
    ]
    if tail:
        a = [1.0, 2 * 0.3 * OMEGA, OMEGA**2]
        nodes.append(Node("g0", "transfer_function", {"na": 2, "nb": 0}, {"b": [2 * OMEGA**2], "a": a}))
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


@pytest.mark.parametrize(
    ("change", "options", "said"),
    [
        ({}, {"f_x": 1.0}, "Got 'f_x' instead"),
        ({}, {"delay": 0.5}, "The option 'delay' must be a whole number of steps. Got 0.5 instead."),
        ({"w": [0.4, -0.2]}, {}, "must not be negative"),
        ({"w0": 0.0}, {}, "w0 greater than 0"),
    ],
)
def test_a_model_without_such_an_inverse_is_refused_in_one_line(
    change: dict[str, object], options: dict[str, float], said: str
) -> None:
    with pytest.raises(InputError, match=said) as e:
        actuator(False, **change).inverse("adaptive", **options)
    assert "\n" not in str(e.value)


def test_another_structure_is_refused_by_name() -> None:
    model = hy.Model("bw", Graph.single(Node("h", "bouc_wen")), None, "Bouc-Wen")
    with pytest.raises(InputError, match="Got bouc_wen in bw"):
        model.inverse("adaptive")
    limited = actuator(False)
    nodes = [*limited.graph.nodes[:2], replace(limited.graph.nodes[2], values={"gain": 1.0, "hi": 1.0})]
    graph = Graph(nodes, limited.graph.wires, limited.graph.inputs, limited.graph.outputs)
    with pytest.raises(InputError, match="must have no limits"):
        hy.Model("stack", graph, None, "limited").inverse("adaptive")
    first = Graph([Node("g", "transfer_function")], [], [Input("u", ("g.u",))], [Output("y", "g.y")])
    with pytest.raises(InputError):
        hy.Model("lag", first, 1e-3, "a lag").inverse("adaptive")


def test_the_command_writes_it(tmp_path: Path) -> None:
    actuator(True).save(tmp_path / "m.model.toml")
    out = tmp_path / "a.model.toml"
    words = ["inverse", str(tmp_path / "m.model.toml"), "--method", "adaptive", "--set", "delay=1", "-o", str(out)]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    said = ["inputs v, y_d, y; outputs u, theta, gate, changes"]
    assert done.output.splitlines() == [f"wrote {out}, adaptive inverse", *said]
    made = Model.load(out)
    assert made.graph.node("adaptive").dims["delay"] == 3
    assert [o.name for o in made.graph.outputs] == ["u", "theta", "gate", "changes"]

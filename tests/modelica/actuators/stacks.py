"""Models of the built-in piezo stack of every kind that an actuator of the Modelica library takes."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import exported
import library
import numpy as np
import simulate

import hystfmu as hy
from hystfmu.graph import Graph, Input, Node, Output

TRAINED: dict[str, Any] = {"starts": 1, "iterations": 100, "hidden": 4}
OPTIONS: dict[str, dict[str, Any]] = {
    "actuator": {"N": 10, "dynamics": "no"},
    "actuator, relays": {"operator": "relays", "dynamics": "no"},
    "prandtl_ishlinskii": {"N": 10},
    "g0_prandtl_ishlinskii": {"N": 10},
    "preisach": {"n": 8, "widths": 6, "means": 3, "rate": "yes"},
    "preisach, static": {"n": 8, "widths": 6, "means": 3, "rate": "no"},
    "krasnoselskii_pokrovskii": {"levels": 6},
    "duhem": {"q": 1},  # of higher degrees the output falls after a reversal
    "play_bank_mlp": exported.OPTIONS["play_bank_mlp"],
    "zhao_tan_mlp": TRAINED,
    "constraint_factor_mlp": TRAINED,
    "fitted_operator_mlp": {**TRAINED, "N": 8},
    "g0_bouc_wen": {},
    "knee": {},
}
SHEET = {"stroke": 40e-6, "blocking_force": 800.0, "capacitance": 4e-6, "resonance": 2000.0}


def knee(weight: float = -5.0, beta: float = 2.0, gamma: float = 1.0, n: float = 2.0) -> hy.Model:
    """A Bouc-Wen operator whose loop rises on every branch, unless its weight is large."""
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": [0.02], "offset": [-1.0]}),
        Node("operator", "bouc_wen", {}, {"A": 1.0, "beta": beta, "gamma": gamma, "n": n}),
        Node("readout", "sum", {"n": 2}, {"k": [20.0, weight], "offset": 20.0}),
    ]
    wires = [("input.y", "operator.u"), ("input.y", "readout.u[1]"), ("operator.z", "readout.u[2]")]
    ports = [Input("u", ("input.u",), unit="V")], [Output("y", "readout.y", unit="um")]
    return hy.Model("bouc_wen", Graph(nodes, wires, *ports), 1e-3, provenance={"span_u": [0.0, 100.0]})


def slopes(rest: float = -1.0) -> hy.Model:
    """A Duhem operator whose output rises on every branch, unless the falling one goes to a state above the rising."""
    falling = {"a_fall": [-rest], "b_fall": [1.5], "c_fall": [-0.5]}
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": [0.02], "offset": [-1.0]}),
        Node("operator", "duhem", {"m": 0, "q": 1}, {"k": 0.5, **falling}),
        Node("readout", "scaling", {"n": 1}, {"gain": [20.0], "offset": [20.0]}),
    ]
    ports = [Input("u", ("input.u",), unit="V")], [Output("y", "readout.y", unit="um")]
    graph = Graph(nodes, [("input.y", "operator.u"), ("operator.y", "readout.u")], *ports)
    return hy.Model("duhem", graph, 1e-3, provenance={"span_u": [0.0, 100.0]})


@cache
def demo(key: str) -> hy.Model:
    """A model of the built-in piezo stack, from 0..100 V to micrometres; the knee is one made by hand."""
    if key == "knee":
        return knee()
    return hy.fit(hy.synthetic.piezo(60, 1000.0), key.partition(",")[0], **OPTIONS[key])


def as_it_comes(package: Path) -> dict[str, np.ndarray]:
    """The example of an actuator at its own settings."""
    file = package / "ActuatorExample.mo"
    return simulate.as_stated(file, "Piezo.ActuatorExample", (library.ROOT, package)).values


# ---- Models of current-driven devices of every kind that the slot of an actuator takes
ROD_KINDS = ("jiles_atherton", "jiles_atherton, strain", *OPTIONS)
ROD_SHEET = {"stroke": 40e-6, "blocking_force": 1200.0, "resistance": 3.0, "resonance": 1500.0}


def magnet(strain: float = 0.0, weight: float = 25.0) -> hy.Model:
    """A Jiles-Atherton operator about a bias of 0.8 A, and a share of the square."""
    beside = [Node("square", "product", {"n": 2, "m": 0})] if strain else []
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": 0.3, "offset": 0.24}),
        Node("operator", "jiles_atherton", {}, {"Ms": 1.0, "a": 0.38, "k": 0.25, "c": 0.2, "alpha": 0.13}),
        *beside,
        Node("hysteresis", "sum", {"n": 3 if strain else 2}, {"k": [1.0, weight, strain][: 3 if strain else 2]}),
    ]
    wires = [("input.y", "operator.u"), ("input.y", "hysteresis.u[1]"), ("operator.y", "hysteresis.u[2]")]
    if strain:
        wires += [("operator.y", "square.u[1]"), ("operator.y", "square.u[2]"), ("square.y", "hysteresis.u[3]")]
    ports = [Input("u", ("input.u",), unit="A")], [Output("y", "hysteresis.y", unit="um")]
    return hy.Model("g0_jiles_atherton", Graph(nodes, wires, *ports), 1e-3, provenance={"span_u": [-3.0, 3.0]})


def rod(key: str) -> hy.Model:
    """The model of a stack, its volts read as amperes, or one of a magnet."""
    if key.startswith("jiles_atherton"):
        return magnet(4.0 if "strain" in key else 0.0)
    model = demo(key)
    first, *others = model.graph.inputs
    graph = model.graph
    return replace(model, graph=Graph(graph.nodes, graph.wires, [replace(first, unit="A"), *others], graph.outputs))

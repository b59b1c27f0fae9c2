"""Models of current-driven devices of every kind that the slot of an actuator takes."""

from dataclasses import replace

import stacks

import hystfmu as hy
from hystfmu.graph import Graph, Input, Node, Output

KINDS = ("jiles_atherton", "jiles_atherton, strain", *stacks.OPTIONS)
SHEET = {"stroke": 40e-6, "blocking_force": 1200.0, "resistance": 3.0, "resonance": 1500.0}


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
    model = stacks.demo(key)
    first, *others = model.graph.inputs
    graph = model.graph
    return replace(model, graph=Graph(graph.nodes, graph.wires, [replace(first, unit="A"), *others], graph.outputs))

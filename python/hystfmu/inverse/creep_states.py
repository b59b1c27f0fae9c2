"""Creep in a model that is inverted by root finding: its states before a step are known, so only the step is searched.

A step of length h moves the lag q of the input v to q + s (v - q), s = 1 - e^(-h/T).  So the output of the block,
w0 v + sum w q, is a function of v and of the states before the step:

  (w0 + sum w s) v + sum w (1 - s) q.

The first term is static and stays in the model. The second term comes from the same lags in a block before the inverse.
This block has no direct feed-through: it reads the input of the last step, is at q when the search starts, and holds
this value.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node, Output
from hystfmu.model import Model
from hystfmu.model.inputs import with_starts

CREEP = "creep"


def known_states(model: Model) -> tuple[list[Node], Model]:
    """Separate the lags of creep from a model.

    Parameters
    ----------
    model : Model
        Model with one output.

    Returns
    -------
    states : list of Node
        Blocks of the lags, which must precede an implicit inverse; they are part of the graph of the second result.
    model : Model
        The model with one step of each creep instead of the creep: it has the same outputs if `states` step first.

    Raises
    ------
    InputError
        The model states no step, or the lags of a creep do not start in equilibrium.
    """
    states: list[Node] = []
    g = model.graph
    for node in [n for n in g.nodes if n.type == CREEP]:
        if model.step is None:
            raise InputError(f"The model {model.key} must state its step for an implicit inverse of creep. Got none.")
        if node.value("start")[0] == 0:
            raise InputError(
                f"The 'start' parameter of {node.name} must be 'steady' for an implicit inverse. Got 'rest' instead."
            )
        g, lags = _separated(g, node, model.step)
        states.append(lags)
    return states, replace(model, graph=g)


def _separated(g: Graph, node: Node, h: float) -> tuple[Graph, Node]:
    """Replace a creep by one step; return the graph and the block of its lags, shifted to start at 0."""
    taken = {n.name for n in g.nodes}

    def free(name: str) -> str:
        while name in taken:
            name += "_"
        taken.add(name)
        return name

    lags, shift = free(f"{node.name}_lags"), free(f"{node.name}_shift")
    w, T, w0 = node.value("w"), node.value("T"), float(node.value("w0")[0])
    share = -np.expm1(-h / T)
    first = _first(g, node)
    known = Node(lags, CREEP, {"n": len(w)}, {"w": w * (1 - share), "T": T, "w0": 0.0, "start": "rest"})
    gain, offset = w0 + float(w @ share), float(w @ (1 - share)) * first
    step = Node(node.name, "sum", {"n": 2}, {"k": [gain, 1.0], "offset": offset})
    shifted = Node(shift, "scaling", {"n": 1}, {"offset": -first})
    old, ends = f"{node.name}.u", (f"{node.name}.u[1]", f"{shift}.u")
    wires = [(a, end) for a, b in g.wires for end in (ends if b == old else (b,))]
    wires += [(f"{lags}.y", f"{node.name}.u[2]"), (f"{shift}.y", f"{lags}.u")]
    inputs = [replace(i, to=tuple(end for b in i.to for end in (ends if b == old else (b,)))) for i in g.inputs]
    nodes = [step if n.name == node.name else n for n in g.nodes]
    return Graph([known, *nodes, shifted], wires, inputs, g.outputs, sort=False, step=g.step), known


def _first(g: Graph, node: Node) -> float:
    """Return the input of a block at the start values of the graph."""
    source = g.inputs[0]
    if f"{node.name}.u" in source.to:
        return float(source.start)
    (end,) = (a for a, b in g.wires if b == f"{node.name}.u")
    inside = Graph(g.nodes, g.wires, g.inputs, [Output("v", end)], sort=False)
    return float(inside.run(with_starts(g, [source.start]))[0])

"""Implicit inverse: a block contains the model, and finds the input by root finding in every step.

The states of creep before a step are known, so only the step is searched. A step of length h changes the lag q of the
input v to q + s (v - q) with s = 1 - e^(-h/T). So the output of the creep block, w0 v + sum w q, is a function of v and
of the states before the step:

  (w0 + sum w s) v + sum w (1 - s) q.

The first term is static and stays in the model. A block before the inverse computes the second term with the same lags.
This block has no direct feed-through. It reads the input of the last step, so its state is q when the search starts,
and it holds this value during the search.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Node, Output
from hystfmu.inverse.ports import assembled, input_range
from hystfmu.model import M, Model, with_starts

FLAT = 1e-4  # step back after a reversal, relative to the input range, on which the output must move
CREEP = "creep"


def implicit_inverse(model: M, lo: float | None = None, hi: float | None = None) -> M:
    """Invert a static model, or a model with creep, by root finding.

    The model has one input and one output. Optional covariates of the model are also inputs of the inverse. With creep,
    the inverse is exact for steps of ``model.step``. The limits of the input, in its unit of measure, are by default
    the range of the data (provenance ``span_u``).

    An InputError is raised for dynamics other than creep, for an output that is constant after a reversal, and if the
    input range is not known.
    """
    if lo is None or hi is None:
        lo, hi = input_range(
            model, "An implicit inverse must have the options lo and hi, or the input range of the model"
        )
    states, stepped = known_states(model)
    first = {n.name for n in states}
    g = stepped.graph
    name = g.unused("inverse")
    block = Node(name, "implicit_inverse", {}, {"lo": lo, "hi": hi})
    nodes = [*states, block, *(n for n in g.nodes if n.name not in first)]
    wires = [*g.wires, *((f"{name}.u", end) for end in g.inputs[0].to), (g.outputs[0].source, f"{name}.h")]
    made = assembled(model, "implicit", nodes, wires, (f"{name}.y",), f"{name}.u", g.inputs[1:])
    _refuse_flat(model, lo, hi)
    return made


def _refuse_flat(model: Model, lo: float, hi: float) -> None:
    """Raise InputError if the output is constant after a reversal, so that the model has no inverse.

    An example is a sum of plays without linear term. Trap: an infinitesimal step is no test, because a Zhao-Tan branch
    begins with slope 0 and has an inverse.
    """
    middle = (lo + hi) / 2
    back = middle - FLAT * (hi - lo)
    start, end, turned = model.predict(with_starts(model.graph, [model.graph.inputs[0].start, middle, back]))
    if abs(turned - end) <= 1e-12 * abs(end - start):
        raise InputError(
            f"The output of {model.key} must move after a reversal. Got one that stands still and has no continuous "
            "inverse. Fit it with a linear term (w0_min > 0), or without a dead band (dead_band = 0)."
        )


def known_states(model: Model) -> tuple[list[Node], Model]:
    """Separate the lags of creep from a model with one output.

    The result is the blocks of the lags, which must precede an implicit inverse, and a changed model. The changed model
    contains these blocks, and one static step instead of each creep block. It has the same outputs as the model if the
    blocks of the lags step first. A model without a step, or lags that do not start in equilibrium, raise an
    InputError.
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
    lags, shift = g.unused(f"{node.name}_lags"), g.unused(f"{node.name}_shift")
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

"""Implicit inverse: the block `implicit_inverse` contains the model and finds the input by root finding in every step.

Creep is a sum of first-order lags, whose states q before the step are known. A step of length h with the input v
changes a state to q + s (v - q), where s = 1 - e^(-h/T). Therefore the output of the creep block, w0 v + sum w q, is a
function of v and of the states before the step:

  (w0 + sum w s) v + sum w (1 - s) q.

The first term is a static function of v and stays in the searched model. A separate block with the same lags computes
the second term before the search. This block has no direct feed-through: its input is the input v of the previous step,
so its output is constant during the search.
"""

from dataclasses import replace

import numpy as np

from hystfmu.base import InputError
from hystfmu.graph import Graph, Node, Output
from hystfmu.inverse.ports import assembled, input_range
from hystfmu.model import M, Model, with_starts

FLAT = 1e-4  # input step after a reversal, relative to the input range, in which the output must change
CREEP = "creep"


def implicit_inverse(model: M, lo: float | None = None, hi: float | None = None) -> M:
    """Return the implicit inverse of a static model or of a model with creep.

    The model has one input and one output. It may also have covariates, which are then inputs of the inverse, too. With
    creep, the inverse is exact for steps of ``model.step``. The root is searched between the inputs `lo` and `hi`. The
    defaults are the ends of the range of the input in the data (provenance ``span_u``).

    An InputError is raised if the model contains dynamics other than creep, if its output is constant after a reversal,
    or if the input range is not known.
    """
    if lo is None or hi is None:
        span = input_range(
            model, "An implicit inverse must have the options lo and hi, or the input range of the model"
        )
        lo, hi = (end if given is None else given for given, end in zip((lo, hi), span, strict=True))
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
    """Raise an InputError if the output stays constant after a reversal of the input, so that there is no inverse.

    An example is a sum of plays without linear term. Trap: the slope directly after the reversal is not a suitable
    test, because a Zhao-Tan branch begins with slope 0 but has an inverse.
    """
    middle = (lo + hi) / 2
    back = middle - FLAT * (hi - lo)
    start, end, turned = model.predict(with_starts(model.graph, [model.graph.inputs[0].start, middle, back]))
    if abs(turned - end) <= 1e-12 * abs(end - start):
        raise InputError(
            f"The output of {model.key} must change directly after a reversal. Got a constant output, without "
            "continuous inverse. Fit plays with a linear term (w0_min > 0) and no dead band, or another kind of model."
        )


def known_states(model: Model) -> tuple[list[Node], Model]:
    """Separate the lags of creep from a model with one output.

    The function returns the blocks of the lags and a changed model. The changed model contains these blocks, and it
    contains a static sum in place of each creep block. Its output equals the output of the model if the blocks of the
    lags are evaluated first. Therefore they must precede the block of the implicit inverse. A model without a step, or
    lags that do not start in equilibrium, raise an InputError.
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
    """Replace a creep block by a static sum, and return the new graph and the block of the lags.

    The input of the lags is shifted, so that they start with the value 0.
    """
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
    """Return the input of a block when all inputs of the graph have their start values."""
    source = g.inputs[0]
    if f"{node.name}.u" in source.to:
        return float(source.start)
    (end,) = (a for a, b in g.wires if b == f"{node.name}.u")
    inside = Graph(g.nodes, g.wires, g.inputs, [Output("v", end)], sort=False)
    return float(inside.run(with_starts(g, [source.start]))[0])

"""The implicit inverse: the model itself, with a block around it that finds the input by root finding in every step."""

from __future__ import annotations

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.input_range import input_range
from hystfmu.model import Model

FLAT = 1e-4  # of the range of the input, after a reversal: a step back on which an output must move


def implicit_inverse(model: Model, lo: float | None = None, hi: float | None = None) -> Model:
    """The inverse of a static model within the limits `lo`, `hi` of its input (unit of u; default its range).

    Raises
    ------
    InputError
        A model that is not static, or whose output stands still after a reversal; an unknown range.
    """
    if lo is None or hi is None:
        lo, hi = input_range(model, "an implicit inverse needs the options lo and hi, or the input range of the model")
    g, source, sink = model.graph, model.graph.inputs[0], model.graph.outputs[0]
    name = "inverse"
    while name in {n.name for n in g.nodes}:
        name += "_"
    graph = Graph(
        [Node(name, "implicit_inverse", {}, {"lo": lo, "hi": hi}), *g.nodes],
        [*g.wires, *((f"{name}.u", end) for end in source.to), (sink.source, f"{name}.h")],
        [Input("u", (f"{name}.y",), sink.unit, float(model.predict(np.full(2, source.start))[0]), "wanted output")],
        [Output("y", f"{name}.u", source.unit, "input that gives it")],
    )
    graph.executor()  # refuses dynamics, with the name of the block
    _refuse_flat(model, lo, hi)
    provenance = {"inverse": "implicit", "of": model.provenance}
    return Model(f"{model.key}_inverse", graph, model.step, f"implicit inverse: {model.text}", {}, provenance)


def _refuse_flat(model: Model, lo: float, hi: float) -> None:
    """An output that stands still after a reversal has no continuous inverse: a sum of plays without linear term.

    An infinitesimal step is no test: a Zhao-Tan branch begins with slope 0 and has an inverse all the same.
    """
    middle = (lo + hi) / 2
    back = middle - FLAT * (hi - lo)
    start, end, turned = model.predict([model.graph.inputs[0].start, middle, back])
    if abs(turned - end) <= 1e-12 * abs(end - start):
        raise InputError(
            f"the output of {model.key} stands still after a reversal: no continuous inverse exists; fit it with a "
            "linear term (w0_min > 0), or without a dead band (dead_band = 0)"
        )

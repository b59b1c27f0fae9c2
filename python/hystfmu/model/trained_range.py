"""Range of the input in the fitted rows, and a model output that shows whether the input is inside this range."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Output
from hystfmu.model.model import Model

KEY, COVARIATES = "trained_u", "trained_covariates"  # of the provenance
PORT = "in_range"


def trained_range(data: Dataset) -> dict[str, Any]:
    """Return the ranges of the input and of each covariate in the fitted rows, for the provenance."""

    def ends(v: Array) -> list[float]:
        return [float(v[data.counted].min()), float(v[data.counted].max())]

    beside = {name: ends(values) for name, _, values in data.covariates}
    return {KEY: ends(data.u), **({COVARIATES: beside} if beside else {})}


def with_in_range(model: Model) -> Model:
    """Add the output `in_range` to a model: 1 if the input lies within the range of the training rows, else 0.

    For an inverse, the range applies to its output, which is the input of the inverted model. Here the ends of the
    range are also outside, because an implicit inverse stops at an end for every wanted output that it cannot reach.

    Parameters
    ----------
    model : Model
        Model whose provenance states ``trained_u``, or the inverse of one.

    Raises
    ------
    InputError
        The model does not state the range, or has the output already.
    """
    g = model.graph
    if any(o.name == PORT for o in g.outputs):
        raise InputError(f"The model must have no output {PORT!r} yet. Got one in {model.key}.")
    of_inverse = "inverse" in model.provenance
    told = model.provenance.get("of", {}) if of_inverse else model.provenance
    spans = [told.get(KEY), *(told.get(COVARIATES, {}).get(i.name) for i in g.inputs[1:])]
    for port, span in zip(g.inputs, spans, strict=True):
        if not (isinstance(span, list) and len(span) == 2):
            raise InputError(
                f"The provenance of {model.key} must state {KEY} = [least, largest] input of its training rows, and "
                f"the same for covariates. Got {span!r} for {port.name}: fit the model again, or add it to its file."
            )
    lo, hi = np.array(spans, dtype=np.float64).T
    if of_inverse:
        lo[0], hi[0] = np.nextafter(lo[0], hi[0]), np.nextafter(hi[0], lo[0])
    name = PORT
    while name in {n.name for n in g.nodes}:
        name += "_"
    ends = [f"{name}.u[{k}]" if len(lo) > 1 else f"{name}.u" for k in range(1, len(lo) + 1)]
    node = Node(name, "in_range", {"n": len(lo)}, {"lo": lo, "hi": hi})
    wires, inputs = list(g.wires), list(g.inputs)
    for k in range(1 if of_inverse else 0, len(inputs)):
        inputs[k] = replace(inputs[k], to=(*inputs[k].to, ends[k]))
    if of_inverse:
        wires.append((g.outputs[0].source, ends[0]))
    text = f"1 if the {'output' if of_inverse else 'input'} lies within the inputs of the training rows, else 0"
    graph = Graph([*g.nodes, node], wires, inputs, [*g.outputs, Output(PORT, f"{name}.y", "1", text)], step=g.step)
    return replace(model, graph=graph)

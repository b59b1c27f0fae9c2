"""Range of the input that a fit has seen, and an output of a model that says whether the input lies inside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Output
from hystfmu.model.model import Model

KEY = "trained_u"  # of the provenance
PORT = "in_range"


def trained_range(data: Dataset) -> list[float]:
    """Return the least and the largest input of the training rows, in the unit of measure of u."""
    u = data.u[data.train]
    return [float(u.min()), float(u.max())]


def with_in_range(model: Model) -> Model:
    """Add the output `in_range` to a model: 1 if the input lies within that of the training rows, else 0.

    For an inverse the input of the inverted model counts, which is its output.  It is outside at the ends of the range
    too, because an implicit inverse stops there for every wanted output that is out of reach.

    Parameters
    ----------
    model : Model
        Model whose provenance states ``trained_u``, or the inverse of one.

    Raises
    ------
    InputError
        The model does not state the range, has several inputs, or has the output already.
    """
    g = model.graph
    if any(o.name == PORT for o in g.outputs):
        raise InputError(f"The model must have no output {PORT!r} yet. Got one in {model.key}.")
    of_inverse = "inverse" in model.provenance
    span = (model.provenance.get("of", {}) if of_inverse else model.provenance).get(KEY)
    if not (isinstance(span, list) and len(span) == 2):
        raise InputError(
            f"The provenance of {model.key} must state {KEY} = [least, largest] input of its training rows. "
            f"Got {span!r}: fit the model again, or add the line to its file."
        )
    if len(g.inputs) != 1 or g.n_inputs != 1:
        raise InputError(f"The model must have one input. Got {g.n_inputs} of {model.key}.")
    name = PORT
    while name in {n.name for n in g.nodes}:
        name += "_"
    lo, hi = map(float, span)
    if of_inverse:
        lo, hi = float(np.nextafter(lo, hi)), float(np.nextafter(hi, lo))
    node = Node(name, "in_range", {"n": 1}, {"lo": lo, "hi": hi})
    text = f"1 if the {'output' if of_inverse else 'input'} lies within the inputs of the training rows, else 0"
    if of_inverse:
        wires, inputs = [*g.wires, (g.outputs[0].source, f"{name}.u")], g.inputs
    else:
        wires, inputs = list(g.wires), (replace(g.inputs[0], to=(*g.inputs[0].to, f"{name}.u")),)
    graph = Graph([*g.nodes, node], wires, inputs, [*g.outputs, Output(PORT, f"{name}.y", "1", text)], step=g.step)
    return replace(model, graph=graph)

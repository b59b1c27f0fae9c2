"""Assembly of an inverse model. Its ports, start values, input range and provenance come from the inverted model."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import M, Model, with_starts


def at_start(model: Model) -> float:
    """Return the output of a model when all inputs have their start values."""
    return float(model.predict(with_starts(model.graph, [model.graph.inputs[0].start]))[0])


def over_range(model: Model, v: Array) -> Array:
    """Scale the signal v (n,) from [-1, 1] to the input range of the model.

    A ramp from the start value of the input to the first value of the signal precedes the scaled signal.
    """
    from hystfmu.data.signals import ramps

    lo, hi = input_range(model, "A learned inverse must have the input range of the model")
    middle, half, start = (lo + hi) / 2, (hi - lo) / 2, model.graph.inputs[0].start
    way_in = ramps([(start - middle) / half, float(v[0])])[:-1] if half > 0 else np.zeros(0)
    return np.asarray(middle + half * np.concatenate([way_in, v]))


def input_range(model: Model, needed: str) -> tuple[float, float]:
    """Return the smallest and the largest input in the data of the model, in the unit of measure of u.

    If the provenance does not contain ``span_u``, an InputError is raised. `needed` is the first part of its message.
    """
    span = model.provenance.get("span_u")
    if not (isinstance(span, list) and len(span) == 2):
        raise InputError(f"{needed}, provenance.span_u = [min, max]. Got {span!r} instead.")
    return float(span[0]), float(span[1])


def assembled(
    model: M,
    how: str,
    nodes: Sequence[Node],
    wires: Sequence[tuple[str, str]],
    to: Sequence[str],
    source: str,
    beside: Sequence[Input] | None = None,
    start: float | None = None,
) -> M:
    """Assemble the inverse of a model from its nodes and wires; `how` is the name of the method.

    The wanted output is connected to the endpoints `to`. The input to apply is the output `source`. The further inputs
    are `beside`, by default the covariates of the model. The start value of the wanted output is `start`, by default
    the output of the model at rest. Parameter values without an inverse raise an InputError.
    """
    first, last = model.graph.inputs[0], model.graph.outputs[0]
    at = at_start(model) if start is None else start
    graph = Graph(
        nodes,
        wires,
        [
            Input("u", tuple(to), last.unit, at, _with("wanted output", last.text)),
            *(model.graph.inputs[1:] if beside is None else beside),
        ],
        [Output("y", source, first.unit, _with("input for the wanted output", first.text))],
    )
    graph.executor()
    told: dict[str, Any] = {"inverse": how, "of": model.provenance}
    text = f"{how} inverse: {model.text}"
    return replace(model, key=f"{model.key}_inverse", graph=graph, text=text, fit={}, provenance=told)


def chain(g: Graph, beside: Collection[str] = ()) -> list[Node] | None:
    """Return the blocks from input to output if all blocks except `beside` form one chain, otherwise None."""
    path = {a.split(".")[0]: b.split(".")[0] for a, b in g.wires if a.split(".")[0] not in beside}
    wires = sum(a.split(".")[0] not in beside for a, _ in g.wires)
    found = [g.node(g.inputs[0].to[0].split(".")[0])]
    while found[-1].name in path and len(found) <= len(g.nodes):
        found.append(g.node(path[found[-1].name]))
    straight = len(g.inputs[0].to) == 1 and wires == len(found) - 1 == len(g.nodes) - len(beside) - 1
    return found if straight and g.outputs[0].source.split(".")[0] == found[-1].name else None


def line(nodes: Sequence[Node]) -> tuple[float, float]:
    """Return the total gain and offset of the blocks `scaling` among nodes in series."""
    gain, offset = 1.0, 0.0
    for n in nodes:
        if n.type == "scaling":
            k = float(n.value("gain")[0])
            gain, offset = gain * k, offset * k + float(n.value("offset")[0])
    return gain, offset


def _with(text: str, own: str) -> str:
    what = own.rpartition(": ")[2]  # the inverse of an inverse has a text with such a prefix
    return f"{text}: {what}" if what else text

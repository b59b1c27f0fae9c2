"""Implicit inverse: the model itself inside a block that finds the input by root finding in every step."""

from __future__ import annotations

from hystfmu.base.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.inverse.creep_states import known_states
from hystfmu.inverse.input_range import at_start, input_range
from hystfmu.inverse.port_texts import given_text, wanted_text
from hystfmu.model import Model
from hystfmu.model.inputs import with_starts

FLAT = 1e-4  # step back after a reversal, relative to the input range, on which the output must move


def implicit_inverse(model: Model, lo: float | None = None, hi: float | None = None) -> Model:
    """Invert a model by root finding: a static one, or one with creep, whose lags before a step are known.

    Parameters
    ----------
    model : Model
        Model with one input and one output, and optional covariates, which are also inputs of the inverse; with creep,
        the inverse is exact for steps of ``model.step``.
    lo, hi : float, optional
        Limits of the input, in its unit of measure; default the range of the data (provenance ``span_u``).

    Raises
    ------
    InputError
        The model has other dynamics than creep, its output is constant after a reversal, or its input range is not
        known.
    """
    if lo is None or hi is None:
        lo, hi = input_range(
            model, "An implicit inverse must have the options lo and hi, or the input range of the model"
        )
    states, stepped = known_states(model)
    first = {n.name for n in states}
    g, source, sink = stepped.graph, stepped.graph.inputs[0], stepped.graph.outputs[0]
    name = "inverse"
    while name in {n.name for n in g.nodes}:
        name += "_"
    graph = Graph(
        [
            *states,
            Node(name, "implicit_inverse", {}, {"lo": lo, "hi": hi}),
            *(n for n in g.nodes if n.name not in first),
        ],
        [*g.wires, *((f"{name}.u", end) for end in source.to), (sink.source, f"{name}.h")],
        [Input("u", (f"{name}.y",), sink.unit, at_start(model), wanted_text(sink)), *g.inputs[1:]],
        [Output("y", f"{name}.u", source.unit, given_text(source))],
    )
    graph.executor()  # the core refuses dynamics and names the block
    _refuse_flat(model, lo, hi)
    provenance = {"inverse": "implicit", "of": model.provenance}
    return Model(f"{model.key}_inverse", graph, model.step, f"implicit inverse: {model.text}", {}, provenance)


def _refuse_flat(model: Model, lo: float, hi: float) -> None:
    """Raise if the output is constant after a reversal, as for a sum of plays without linear term: it has no inverse.

    Trap: an infinitesimal step is no test, because a Zhao-Tan branch begins with slope 0 and has an inverse.
    """
    middle = (lo + hi) / 2
    back = middle - FLAT * (hi - lo)
    start, end, turned = model.predict(with_starts(model.graph, [model.graph.inputs[0].start, middle, back]))
    if abs(turned - end) <= 1e-12 * abs(end - start):
        raise InputError(
            f"The output of {model.key} must move after a reversal. Got one that stands still and has no continuous "
            "inverse. Fit it with a linear term (w0_min > 0), or without a dead band (dead_band = 0)."
        )

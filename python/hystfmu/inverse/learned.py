"""The learned inverse: a bank of plays and a network, trained on the response of the model, its ends exchanged."""

from __future__ import annotations

from typing import Any

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Output
from hystfmu.inverse.input_range import over_range
from hystfmu.model import Model


def learned_inverse(model: Model, seed: int, options: dict[str, Any]) -> Model:
    """The inverse of a model that knows the range of its input; `options` of ``play_bank_mlp``.

    Raises
    ------
    InputError
        An unknown range, or what `hystfmu.identify.fit` refuses.
    """
    from hystfmu.data.signals import training
    from hystfmu.identify import fit

    u = over_range(model, training(200, seed + 1))
    y = model.predict(u)
    h = model.step if model.step is not None else 1.0
    # the response is free of noise, so that little decay is needed; the plays of the bank rest where the run begins
    chosen = {"decay": 1e-8, "N": 24, **options}
    learned = fit(Dataset.from_signal(y, u, h, f"response of {model.key}"), "play_bank_mlp", seed, **chosen)
    source, sink = model.graph.inputs[0], model.graph.outputs[0]
    g = learned.graph
    graph = Graph(
        g.nodes,
        g.wires,
        [Input("u", g.inputs[0].to, sink.unit, g.inputs[0].start, "wanted output")],
        [Output("y", g.outputs[0].source, source.unit, "input that gives it")],
    )
    provenance = {"inverse": "learned", **learned.provenance, "of": model.provenance}
    return Model(f"{model.key}_inverse", graph, model.step, f"learned inverse: {model.text}", learned.fit, provenance)

"""Learned inverse: a bank of plays and a network, trained on the model's response with input and output exchanged."""

from __future__ import annotations

from typing import Any

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Output
from hystfmu.inverse.input_range import over_range
from hystfmu.model import Model


def learned_inverse(model: Model, seed: int, options: dict[str, Any]) -> Model:
    """Train an inverse of a model that states its input range; `options` are those of ``play_bank_mlp``.

    Raises
    ------
    InputError
        The input range is unknown, or `hystfmu.identify.fit` refuses the options.
    """
    from hystfmu.data.signals import training
    from hystfmu.identify import fit

    u = over_range(model, training(200, seed + 1))
    y = model.predict(u)
    h = model.step if model.step is not None else 1.0
    # the response has no noise, so little weight decay is needed; the plays of the bank start at rest
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

"""Inverses of a model: the input that makes the model's output follow a wanted one, again a Model with ports u and y.

exact    block by block from the output to the input; every block of the chain needs an inverse
         (Prandtl-Ishlinskii with a linear term, Zhao-Tan, scaling).
learned  a bank of plays and a network, trained on the model's own response with input and output exchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from hystfmu.data import Dataset
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model

METHODS = ("exact", "learned")
NO_LIMIT = 1e300

# block -> (block of the inverse, its input, its output)
_TYPES = {
    "prandtl_ishlinskii": ("prandtl_ishlinskii_inverse", "y", "u"),
    "prandtl_ishlinskii_inverse": ("prandtl_ishlinskii", "u", "y"),
    "zhao_tan": ("zhao_tan_inverse", "h", "x"),
    "zhao_tan_inverse": ("zhao_tan", "x", "h"),
    "scaling": ("scaling", "u", "y"),
}


def inverse(model: Model, method: str = "exact", seed: int = 0, **options: Any) -> Model:
    """The inverse of a model as a second model: input `u` is the wanted output, output `y` the input to apply.

    Parameters
    ----------
    model : Model
        One input, one output.
    method : {"exact", "learned"}
        See the module's text.
    seed : int
        Of the learned inverse: starts of the network and the reversals it is trained on.
    **options
        Of the learned inverse: those of ``play_bank_mlp``.

    Returns
    -------
    Model

    Raises
    ------
    InputError
        No exact inverse exists; the sentence says why and what to do.
    """
    if method not in METHODS:
        raise InputError(f"no inverse method {method!r}; there are: {', '.join(METHODS)}")
    if len(model.graph.inputs) != 1 or len(model.graph.outputs) != 1:
        raise InputError("an inverse needs a model with one input and one output")
    if method == "learned":
        return _learned(model, seed, options)
    if options:
        raise InputError(f"the exact inverse has no option {sorted(options)[0]!r}")
    return _exact(model)


# ---- exact -----------------------------------------------------------------------------------------------------------
def _exact(model: Model) -> Model:
    chain = _chain(model.graph)
    nodes = [_INVERT[n.type](n) for n in reversed(chain)]
    ends = [_TYPES[n.type] for n in reversed(chain)]
    wires = [(f"{nodes[i].name}.{ends[i][2]}", f"{nodes[i + 1].name}.{ends[i + 1][1]}") for i in range(len(nodes) - 1)]
    source, sink = model.graph.inputs[0], model.graph.outputs[0]
    start = float(model.predict(np.full(2, source.start))[0])
    graph = Graph(
        nodes,
        wires,
        [Input("u", (f"{nodes[0].name}.{ends[0][1]}",), sink.unit, start, "wanted output")],
        [Output("y", f"{nodes[-1].name}.{ends[-1][2]}", source.unit, "input that gives it")],
    )
    key = model.key.removesuffix("_inverse") if model.key.endswith("_inverse") else f"{model.key}_inverse"
    return Model(
        key, graph, model.step, f"exact inverse: {model.text}", {}, {"inverse": "exact", "of": model.provenance}
    )


def _chain(graph: Graph) -> list[Node]:
    """The nodes from the input to the output, each with one invertible input and output."""
    follows = {a.split(".")[0]: b for a, b in graph.wires}
    for n in graph.nodes:
        if n.type not in _TYPES:
            hint = "; use method='learned'" if n.type not in ("delay", "transfer_function") else ""
            raise InputError(f"the block {n.name!r} ({n.type}) has no exact inverse{hint}")
    at = graph.inputs[0].to[0].split(".")[0]
    chain = [graph.node(at)]
    while at in follows:
        at = follows[at].split(".")[0]
        chain.append(graph.node(at))
    straight = len(graph.inputs[0].to) == 1 and len(graph.wires) == len(chain) - 1 == len(graph.nodes) - 1
    if not straight or graph.outputs[0].source.split(".")[0] != at:
        raise InputError("an exact inverse needs blocks in one chain from input to output; use method='learned'")
    return chain


def _invert_prandtl_ishlinskii(n: Node) -> Node:
    w0, w = float(n.value("w0")[0]), n.value("w")
    if not w0 > 0:
        raise InputError(
            f"the block {n.name!r} has w0 = {w0:g}: a sum of plays without linear term has zero slope after each "
            "reversal and no continuous inverse; fit with w0_min > 0"
        )
    slope = np.cumsum(np.concatenate([[w0], w]))
    if not slope.min() > 0:
        raise InputError(f"the block {n.name!r} is not increasing: w0 + w_1 + ... + w_i falls to {slope.min():g}")
    return _same_values(n)


def _invert_zhao_tan(n: Node) -> Node:
    if n.type == "zhao_tan" and n.value("memory")[0] != 0:
        raise InputError(f"the block {n.name!r} has memory = 'last', which has no inverse; use memory = 'dominant'")
    values = {"x0": n.value("x0")}
    return Node(n.name, _TYPES[n.type][0], {"depth": n.dims["depth"]}, values)


def _same_values(n: Node) -> Node:
    return Node(n.name, _TYPES[n.type][0], n.dims, {v.name: n.value(v.name) for v in n.block.parameters})


def _invert_scaling(n: Node) -> Node:
    gain, offset, lo, hi = (n.value(name) for name in ("gain", "offset", "lo", "hi"))
    if len(gain) != 1:
        raise InputError(f"the block {n.name!r} scales {len(gain)} signals; an exact inverse needs one")
    if gain[0] == 0:
        raise InputError(f"the block {n.name!r} has gain 0 and no inverse")
    ends = []
    for limit in (lo[0], hi[0]):  # where the forward block limits, so does the inverse, at the image of the limit
        ends.append(limit * gain[0] + offset[0] if abs(limit) < NO_LIMIT else np.copysign(NO_LIMIT, limit * gain[0]))
    values = {"gain": 1 / gain, "offset": -offset / gain, "lo": min(ends), "hi": max(ends)}
    return Node(n.name, "scaling", {"n": 1}, values)


_INVERT: dict[str, Callable[[Node], Node]] = {
    "prandtl_ishlinskii": _invert_prandtl_ishlinskii,
    "prandtl_ishlinskii_inverse": _same_values,
    "zhao_tan": _invert_zhao_tan,
    "zhao_tan_inverse": _invert_zhao_tan,
    "scaling": _invert_scaling,
}


# ---- learned ---------------------------------------------------------------------------------------------------------
def _learned(model: Model, seed: int, options: dict[str, Any]) -> Model:
    from hystfmu.identify import fit
    from hystfmu.signals import ramps, training

    span = model.provenance.get("span_u")
    if not (isinstance(span, list) and len(span) == 2):
        raise InputError("a learned inverse needs the input range of the model: provenance.span_u = [min, max]")
    lo, hi = float(span[0]), float(span[1])
    middle, half, start = (lo + hi) / 2, (hi - lo) / 2, model.graph.inputs[0].start
    way_in = ramps([(start - middle) / half, 0.0])[:-1] if half > 0 else np.zeros(0)
    u = middle + half * np.concatenate([way_in, training(200, seed + 1)])
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

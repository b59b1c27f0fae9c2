"""Inverses of a model: the input that makes the model's output follow a wanted one, again a Model with ports u and y.

exact    block by block from the output to the input; every block of the chain needs an inverse
         (Prandtl-Ishlinskii with a linear term, Zhao-Tan, constraint factor, dead zones, scaling).
implicit the model itself with the block `implicit_inverse` around it, which finds the input by bounded root finding in
         the core; the model must be static: operators with memory and functions of one input.
learned  a bank of plays and a network, trained on the model's own response with input and output exchanged.

Every inverse states what it is worth: `fit` holds the errors of inverse -> model, in percent of the span of the wanted
output, the worst of the held-out signals within 90 % of the range of the input.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.core import NO_LIMIT, Array
from hystfmu.data import Dataset
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.model import Model

__all__ = ["inverse"]

METHODS = ("exact", "implicit", "learned")
SHARE = 0.9  # of the range of the input, for the wanted outputs that an inverse is judged on

# block -> (block of the inverse, its input, its output)
_TYPES = {
    "prandtl_ishlinskii": ("prandtl_ishlinskii_inverse", "y", "u"),
    "prandtl_ishlinskii_inverse": ("prandtl_ishlinskii", "u", "y"),
    "zhao_tan": ("zhao_tan_inverse", "h", "x"),
    "zhao_tan_inverse": ("zhao_tan", "x", "h"),
    "constraint_factor": ("constraint_factor_inverse", "h", "x"),
    "constraint_factor_inverse": ("constraint_factor", "x", "h"),
    "dead_zones": ("dead_zones", "u", "y"),
    "scaling": ("scaling", "u", "y"),
}


def inverse(model: Model, method: str = "exact", seed: int = 0, **options: Any) -> Model:
    """The inverse of a model as a second model: input `u` is the wanted output, output `y` the input to apply.

    Parameters
    ----------
    model : Model
        One input, one output.
    method : {"exact", "implicit", "learned"}
        See the module's text.
    seed : int
        Of the learned inverse: starts of the network and the reversals it is trained on.
    **options
        Of the implicit inverse: ``lo`` and ``hi``, the limits of the input; by default the range of the data
        (provenance ``span_u``).  Of the learned inverse: those of ``play_bank_mlp``.

    Returns
    -------
    Model
        `fit` holds ``cascade_rms_percent`` and ``cascade_max_percent``, see the module's text (not for a model that
        does not know the range of its input, provenance ``span_u``).

    Raises
    ------
    InputError
        No such inverse exists; the sentence says why and what to do.
    """
    if method not in METHODS:
        raise InputError(f"no inverse method {method!r}; there are: {', '.join(METHODS)}")
    if len(model.graph.inputs) != 1 or len(model.graph.outputs) != 1:
        raise InputError("an inverse needs a model with one input and one output")
    if not any(model.graph.dependencies().values()):
        raise InputError(
            f"the output of {model.key} depends on past inputs only (dynamics or a delay): no causal inverse exists; "
            "invert its hysteresis alone, with the inverse of the dynamics (feedforward) in front"
        )
    unknown = set(options) - {"exact": set(), "implicit": {"lo", "hi"}}.get(method, set(options))
    if unknown:
        raise InputError(f"the {method} inverse has no option {sorted(unknown)[0]!r}")
    if method == "learned":
        made = _learned(model, seed, options)
    elif method == "implicit":
        made = _implicit(model, **options)
    else:
        made = _exact(model)
    return replace(made, fit={**made.fit, **_cascade(model, made)})


# ---- what an inverse is worth ----------------------------------------------------------------------------------------
def _cascade(model: Model, made: Model) -> dict[str, float]:
    """Errors of inverse -> model on outputs that the model gives for every held-out signal: the worst of each."""
    from hystfmu.identify import errors
    from hystfmu.signals import held_out

    if "span_u" not in model.provenance:
        return {}
    wanted = [model.predict(_path(model, SHARE * v)) for v in held_out().values()]
    found = [errors(model.predict(made.predict(r, model.step)), r, float(np.ptp(r))) for r in wanted]
    return {f"cascade_{k}": max(e[k] for e in found) for k in ("rms_percent", "max_percent")}


def _path(model: Model, v: Array) -> Array:
    """The signal v, in [-1, 1], over the range of the model's input, after a ramp from where the model starts."""
    from hystfmu.signals import ramps

    lo, hi = _span(model, "a learned inverse needs the input range of the model")
    middle, half, start = (lo + hi) / 2, (hi - lo) / 2, model.graph.inputs[0].start
    way_in = ramps([(start - middle) / half, float(v[0])])[:-1] if half > 0 else np.zeros(0)
    return np.asarray(middle + half * np.concatenate([way_in, v]))


def _span(model: Model, needed: str) -> tuple[float, float]:
    """The range of the input that the model was identified on."""
    span = model.provenance.get("span_u")
    if not (isinstance(span, list) and len(span) == 2):
        raise InputError(f"{needed}: provenance.span_u = [min, max]")
    return float(span[0]), float(span[1])


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
    graph.executor()  # a block whose values have no inverse says so
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


def _same_values(n: Node) -> Node:
    """The block of the inverse has the parameters of the forward block, but no choice of the memory."""
    if "memory" in n.values and n.value("memory")[0] != 0:
        raise InputError(f"the block {n.name!r} has memory = 'last', which has no inverse; use memory = 'dominant'")
    values = {v.name: n.value(v.name) for v in n.block.parameters if v.name != "memory"}
    return Node(n.name, _TYPES[n.type][0], n.dims, values)


def _invert_dead_zones(n: Node) -> Node:
    """An increasing piecewise linear curve through 0 has one as its inverse: the same block with other values."""
    r, w = n.value("r"), n.value("w")
    centre = float(n.value("w0")[0] + w[r == 0].sum())  # the slope at 0: a dead zone at 0 is the input itself
    values: dict[str, Any] = {"w0": 1 / centre if centre else np.inf, "r": [], "w": []}
    for side in (-1.0, 1.0):
        slope, at, height = centre, 0.0, 0.0
        for knot in np.unique(side * r[side * r > 0]):
            height, at, before = height + slope * (knot - at), knot, slope
            slope = slope + w[r == side * knot].sum()
            if not (before > 0 and slope > 0):
                raise InputError(f"the block {n.name!r} is not increasing: its slope falls to {min(before, slope):g}")
            values["r"].append(side * height)
            values["w"].append(1 / slope - 1 / before)
    if not centre > 0:
        raise InputError(f"the block {n.name!r} is not increasing: its slope at 0 is {centre:g}")
    if not values["r"]:  # a straight line
        values |= {"r": [1.0], "w": [0.0]}
    return Node(n.name, "dead_zones", {"n": len(values["r"])}, values)


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
    "zhao_tan": _same_values,
    "zhao_tan_inverse": _same_values,
    "constraint_factor": _same_values,
    "constraint_factor_inverse": _same_values,
    "dead_zones": _invert_dead_zones,
    "scaling": _invert_scaling,
}


# ---- implicit --------------------------------------------------------------------------------------------------------
FLAT = 1e-4  # of the range of the input, after a reversal: a step back on which an output must move


def _implicit(model: Model, lo: float | None = None, hi: float | None = None) -> Model:
    if lo is None or hi is None:
        lo, hi = _span(model, "an implicit inverse needs the options lo and hi, or the input range of the model")
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


# ---- learned ---------------------------------------------------------------------------------------------------------
def _learned(model: Model, seed: int, options: dict[str, Any]) -> Model:
    from hystfmu.identify import fit
    from hystfmu.signals import training

    u = _path(model, training(200, seed + 1))
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

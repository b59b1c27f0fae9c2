"""Learned inverse: a network is trained on the response of the model with input and output exchanged.

Recipe, after Zhao & Tan 2008, section III:

1. Data. The training data are the responses of the model, without noise, to a full loop and to nested reversals of all
   amplitudes.
2. Inverse operator. The wanted output is the input of the network, so the network needs the memory of the inverse. Its
   inputs are the outputs of three operators `zhao_tan_inverse` and of a few plays, which are driven by the wanted
   output. Each operator has its own scaling, because the shape of its branches depends on the scale. The original
   recipe of the paper is ``fit(exchanged, "zhao_tan_mlp", operator="zhao_tan_inverse")``.
3. Target. A network that computes the input directly must represent fast changes of the input at reversals, where the
   output hardly changes. Therefore the network computes a corrected wanted output. The exact inverse of a fitted
   Prandtl-Ishlinskii model then computes the input. An error of the network then has the same size as the error of the
   output that it causes.
4. Choice. The error of the cascade of inverse and model is computed for validation signals. If it exceeds `ENOUGH`, a
   second inverse is trained, which computes the input directly by a bank of plays and a network. The inverse with the
   smaller error is used.

Trap: the training uses small matrices, for which two threads take ten times as long as one thread.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from hystfmu.base import Array, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Output
from hystfmu.inverse.exact import exact_inverse
from hystfmu.inverse.ports import assembled, over_range
from hystfmu.model import M, Model

REVERSALS = 200  # number of reversals of the training signal
SCALES = (0.5, 1.0, 2.0)  # spans of the scaled wanted outputs that drive the inverse operators
PLAYS, LEAST_SLOPE = 40, 0.01  # number of fitted plays; least linear weight, relative to the mean slope of the response
CORRECTED = {"N": 4, "hidden": 12, "iterations": 100}
DIRECT = {"N": 24}
NO_NOISE = {"decay": 1e-8}  # the response has no noise, so little weight decay is needed
SHARE = 0.9  # fraction of the input range that the validation signals use
FIRST = 0.5  # share of the time for the network that corrects the wanted output
ENOUGH = 0.02  # largest accepted error of the cascade, relative to the span of the wanted output
FALLING = 0.05  # a warning is given if output and input move in opposite directions on a larger share of the rows


def learned_inverse(model: M, seed: int, options: dict[str, Any], progress: Progress = silent) -> M:
    """Train an inverse of a model whose input range is known; `options` are options of the kind ``play_bank_mlp``.

    If the first of the two networks is accurate enough, the reported progress does not reach 1. An unknown input range,
    or options that `hystfmu.identify.fit` does not accept, raise an InputError.
    """
    from hystfmu.data.signals import training

    u = over_range(model, training(REVERSALS, seed + 1))
    y = model.predict(u)
    split = _validation(model, seed)
    learned = _corrected(model, u, y, seed, options, lambda part: progress(FIRST * part))
    worst = _largest(model, learned, split)
    if not worst <= ENOUGH:
        direct = _direct(model, u, y, seed, options, lambda part: progress(FIRST + (1 - FIRST) * part))
        if not worst <= _largest(model, direct, split):
            learned = direct
    g = learned.graph
    made = assembled(model, "learned", g.nodes, g.wires, g.inputs[0].to, g.outputs[0].source, (), g.inputs[0].start)
    provenance = {"inverse": "learned", **learned.provenance, "of": model.provenance}
    warned = [*learned.fit.get("warnings", ()), *_falls(u, y)]
    found = {**learned.fit, **({"warnings": warned} if warned else {})}
    return replace(made, fit=found, provenance=provenance)


def _corrected(model: Model, u: Array, y: Array, seed: int, given: Mapping[str, Any], progress: Progress) -> Model:
    """Return an inverse in two parts: a network that corrects the wanted output, and the inverse of a sum of plays.

    The function fits the plays to u (n,) and y (n,), inverts them, and then trains the network.
    """
    from hystfmu.identify import errors, fit, options
    from hystfmu.identify.catalogue import resolve
    from hystfmu.identify.features.plays import thresholds
    from hystfmu.identify.network.readout import Features, fit_readout

    chosen = resolve("the learned inverse", options("play_bank_mlp"), {**CORRECTED, **NO_NOISE, **given})
    least = LEAST_SLOPE * float(np.ptp(y) / np.ptp(u)) if np.ptp(y) > 0 else 0.0
    forward = fit(_record(model, u, y), "prandtl_ishlinskii", N=PLAYS, w0_min=least)
    back = exact_inverse(forward).graph
    nodes, wires, to, x = _renamed(back, "first")
    nodes.append(Node("input", "scaling", {"n": 1}))
    ends, into = ["input.y", x], ["input.u", *to]
    for i, scale in enumerate(SCALES, 1):
        gain = scale / float(np.ptp(y))  # the offset makes the operator start at its rest value h = 0
        nodes.append(Node(f"scale{i}", "scaling", {"n": 1}, {"gain": gain, "offset": -gain * float(y[0])}))
        nodes.append(Node(f"operator{i}", "zhao_tan_inverse"))
        wires.append((f"scale{i}.y", f"operator{i}.h"))
        into.append(f"scale{i}.u")
        ends.append(f"operator{i}.x")
    r = thresholds(y, chosen["N"])
    nodes.append(Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": float(y[0])}))
    wires.append(("input.y", "bank.u"))
    data = _record(model, y, forward.predict(u))
    front = Features(nodes, wires, into, [*ends, "bank.z"], data)
    with threadpool_limits(1):  # see hystfmu.identify.fit
        g, parameters, _ = fit_readout(front, data, chosen, seed, progress, linear=True)
    last, inside, starts, out = _renamed(back, "last")
    graph = Graph(
        [*g.nodes, *last],
        [*g.wires, *inside, *((g.outputs[0].source, end) for end in starts)],
        g.inputs,
        [Output("y", out)],
    )
    made = Model("learned", graph, model.step)
    worth = errors(made.predict(y, model.step), u, float(np.ptp(u)))
    provenance = {
        "data": data.name,
        "sha256": data.sha256,
        "rows": len(u),
        "span_u": [float(y.min()), float(y.max())],
        "seed": seed,
        "options": {k: v for k, v in chosen.items() if v is not None},
    }
    return replace(made, fit={**worth, "parameters": parameters + PLAYS + 1}, provenance=provenance)


def _direct(model: Model, u: Array, y: Array, seed: int, given: Mapping[str, Any], progress: Progress) -> Model:
    """Return an inverse that computes the input directly by a bank of plays of the wanted output and a network."""
    from hystfmu.identify import fit

    return fit(_record(model, y, u), "play_bank_mlp", seed, progress, **{**DIRECT, **NO_NOISE, **given})


def _renamed(graph: Graph, prefix: str) -> tuple[list[Node], list[tuple[str, str]], list[str], str]:
    """Return nodes, wires, input endpoints and output endpoint of a graph; each block name begins with `prefix`."""
    nodes = [replace(n, name=f"{prefix}_{n.name}") for n in graph.nodes]
    wires = [(f"{prefix}_{a}", f"{prefix}_{b}") for a, b in graph.wires]
    return nodes, wires, [f"{prefix}_{end}" for end in graph.inputs[0].to], f"{prefix}_{graph.outputs[0].source}"


def _record(model: Model, u: Array, y: Array) -> Dataset:
    return Dataset.from_signal(u, y, model.step if model.step is not None else 1.0, f"response of {model.key}")


def _validation(model: Model, seed: int) -> list[Array]:
    """Return wanted outputs for the choice of the inverse; no signal is the same as in `signals.held_out`."""
    from hystfmu.data import signals

    inputs = (
        signals.decaying_sine(10, 0.12),
        signals.two_tones(10, 2.9, 0.3),
        signals.nested_reversals(60, seed + 4711),
        signals.minor_loops(5, 0.3),
    )
    return [model.predict(over_range(model, SHARE * v)) for v in inputs]


def _largest(model: Model, made: Model, wanted: list[Array]) -> float:
    """Return the largest error of the cascade of inverse and model, relative to the span of the wanted output."""
    worst = [np.abs(model.predict(made.predict(r, model.step)) - r).max() / np.ptp(r) for r in wanted]
    return float(max(worst)) if np.isfinite(worst).all() else np.inf


def _falls(u: Array, y: Array) -> list[str]:
    """Return a warning if output and input move in opposite directions on more than a share `FALLING` of the rows."""
    share = float(np.mean(np.diff(u) * np.diff(y) * (y[np.argmax(u)] - y[np.argmin(u)]) < 0))
    if share <= FALLING:
        return []
    return [
        f"the output of the model moves against its input on {100 * share:.2g} % of the rows: it has no continuous "
        "inverse there"
    ]

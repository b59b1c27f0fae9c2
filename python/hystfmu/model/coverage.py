"""Trained range of a model, and coverage of the input space of a network by the training rows.

Far from its training rows, a network has errors of 20 to 400 %. Therefore the inputs of the network (features) are
limited to their trained ranges by a block ``scaling`` with `lo` and `hi`. The rows at which a limit acts are reported,
because a limited output could look like a property of the device.

The coverage shows whether other signals stay near the training rows. It is computed with a reference signal of random
nested reversals, which has the range and the speed of the training input. The coverage is the share of the rows of the
reference signal that have a training row at a distance of less than 10 %. The distance is the RMS of the feature
differences, each relative to the range of its feature. For example, a decaying sine covers the whole space of two
features, but only a small part of the states of a bank of plays.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from hystfmu.base import Array, InputError, Mask
from hystfmu.core.library import NO_LIMIT
from hystfmu.data import Dataset
from hystfmu.data.signals import ramps, training
from hystfmu.graph import Graph, Node, Output
from hystfmu.model import M, Model, rows_of

KEY, COVARIATES = "trained_u", "trained_covariates"  # keys of the provenance
PORT = "in_range"
NEAR = 0.1  # largest distance: RMS of the feature differences, each relative to the range of its feature
MOST_ROWS = 2000  # maximum number of reference rows and of training rows; a longer set is thinned evenly
REVERSALS, SEED = 200, 4242  # number of reversals and random seed of the reference signal
STEPS = (0.002, 0.1)  # smallest and largest step of the reference signal, in half ranges per row
WARN = 1.0  # percentage of limited rows above which a warning is given


def clamped(graph: Graph, u: Array, h: float) -> Array:
    """Return a mask of the rows at which a limit of a `scaling` block acts.

    Parameters
    ----------
    graph : Graph
        Graph of a model.
    u : array, shape (n,) or (n, n_inputs)
        Input. The graph starts from its initial state.
    h : float
        Time between rows (s).

    Returns
    -------
    array of bool, shape (n,)
    """
    rows = np.zeros(len(u), dtype=bool)
    for node in _limiters(graph):
        v = _inputs(graph, node, u, h)
        rows |= ((v < node.value("lo")) | (v > node.value("hi"))).any(axis=1)
    return rows


def coverage(graph: Graph, data: Dataset) -> float | None:
    """Compute the coverage of the input space of a network by the training rows.

    Parameters
    ----------
    graph : Graph
        Graph of a model.
    data : Dataset
        Data to which the model is fitted.

    Returns
    -------
    float or None
        Percentage of the rows of the reference signal that have a near training row. None for a graph without network.
    """
    beside = {end for port in graph.inputs[1:] for end in port.to}
    limiters = [n for n in _limiters(graph) if f"{n.name}.u[1]" not in beside]  # not the limits of covariates
    if not limiters:
        return None
    node, h, rows = limiters[-1], data.h, data.train

    def features(inputs: Array) -> Array:
        return _inputs(graph, node, inputs, h)

    seen = data.along(features, inputs=rows_of(graph, data))[rows]
    width = node.value("hi") - node.value("lo")
    return covered(features, seen, width, float(data.u[0]), data.u[rows], data.covariates.values[rows])


def covered(
    features: Callable[[Array], Array], seen: Array, width: Array, first: float, u: Array, beside: Array
) -> float:
    """Compute the coverage (%) of a space of m features by their values `seen` (rows, m) in the training rows.

    The function `features` returns the features (n, m) for an array of inputs. `width` (m,) contains the ranges of the
    features. The record begins with the input `first`, and its training rows have the inputs u (rows,) and the
    covariates `beside` (rows, k).
    """
    lo, hi = float(u.min()), float(u.max())
    middle, half = (lo + hi) / 2, (hi - lo) / 2
    speed = float(np.clip(np.sqrt(np.mean(np.diff(u) ** 2)) / half, *STEPS))
    way_in = ramps([(first - middle) / half, 0.0], speed)[:-1]
    reference = middle + half * np.concatenate([way_in, training(REVERSALS, SEED, speed)])
    if beside.shape[1]:  # covariates are uniformly distributed over their ranges in the training rows
        ends = beside.min(axis=0), beside.max(axis=0), (len(reference), beside.shape[1])
        reference = np.column_stack([reference, np.random.default_rng(SEED).uniform(*ends)])
    width = np.where(width == 0, 1.0, width) * np.sqrt(len(width))
    asked = features(reference)[len(way_in) :]
    return 100 * float(np.mean(near(seen / width, asked / width, NEAR, MOST_ROWS)))


def near(seen: Array, asked: Array, distance: float, most: int) -> Mask:
    """Return a mask (n,) of the points of `asked` (n, m) that lie within `distance` of a point of `seen`.

    A set of more than `most` points is first thinned evenly.
    """
    from scipy.spatial import cKDTree

    seen, asked = (v[:: -(-len(v) // most)] for v in (seen, asked))
    return np.isfinite(cKDTree(seen).query(asked, distance_upper_bound=distance)[0])


def _limiters(graph: Graph) -> list[Node]:
    """Return the `scaling` blocks with finite limits, in evaluation order."""
    nodes = [n for n in graph.nodes if n.type == "scaling"]
    return [n for n in nodes if (np.abs(np.concatenate([n.value("lo"), n.value("hi")])) < NO_LIMIT).all()]


def _inputs(graph: Graph, node: Node, u: Array, h: float) -> Array:
    """Return the input signals of the block `node`, (n, n_elements), in a simulation of the graph with the input u."""
    n, rows = node.sizes["u"], np.asarray(u, dtype=np.float64).reshape(len(u), -1)
    source: dict[str, str] = {end: a for a, end in graph.wires}
    outside = {end: k for k, port in enumerate(graph.inputs) for end in port.to}
    whole = f"{node.name}.u"
    ends = [whole] if whole in source or whole in outside else [f"{whole}[{k + 1}]" for k in range(n)]
    inner = [end for end in ends if end in source]
    if not inner:  # all signals are inputs of the graph
        return np.column_stack([rows[:, outside[end]] for end in ends])
    outputs = [Output(f"limited_{k}", source[end]) for k, end in enumerate(inner)]
    found = Graph(graph.nodes, graph.wires, graph.inputs, outputs).run(u, h).reshape(len(u), -1)
    if len(inner) == len(ends):
        return found
    parts = iter(found.T)
    return np.column_stack([next(parts) if end in source else rows[:, outside[end]] for end in ends])


def trained_range(data: Dataset) -> dict[str, Any]:
    """Return the ranges of the input and of each covariate in the training rows, as entries of the provenance."""

    def ends(v: Array) -> list[float]:
        return [float(v[data.counted].min()), float(v[data.counted].max())]

    beside = {name: ends(values) for name, _, values in data.covariates}
    return {KEY: ends(data.u), **({COVARIATES: beside} if beside else {})}


def with_in_range(model: M) -> M:
    """Add the output `in_range` to a model or to an inverse; see `hystfmu.Model.with_in_range`.

    An InputError is also raised if the model already has this output.
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
    name = g.unused(PORT)
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


def span_of(model: Model) -> tuple[float, float] | None:
    """Return the range of the first input in the data of a model; None if the provenance does not contain it."""
    span = model.provenance.get(KEY, model.provenance.get("span_u"))
    if isinstance(span, list) and len(span) == 2 and span[0] < span[1]:
        return float(span[0]), float(span[1])
    return None

"""States of the memory that a record does not contain: their share, and an input that reaches these states.

The half cycles of this input have the shapes, durations and speeds of the half cycles of the record. The loops have
another order and other sizes, so the states of the memory differ.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import reversals
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.identify.features.plays import plays
from hystfmu.model.coverage import coverage

MOST_ROWS, LEAST_REVERSALS = 8000, 12
SEED = 77
PLAYS = 2  # that stand for the memory of a kind with local parameters


def other_memory(u: Array, start: float) -> Array:
    """Return a full loop, then random nested loops in the range of an input u (n,), from `start`; shape (m,).

    Half of the reversals lie inside the previous loop, as in `hystfmu.data.signals`.
    """
    rng, lo, hi = np.random.default_rng(SEED), float(u.min()), float(u.max())
    turns = reversals(u)
    shapes = [(u[a + 1 : b + 1] - u[a]) / (u[b] - u[a]) for a, b in pairwise(turns)]
    if not shapes:  # one sweep: in quarters
        shapes = [np.linspace(0.0, 1.0, max(len(u) // 4, 2) + 1)[1:]]
    order = rng.permutation(len(shapes))
    parts, rows, last = [np.array([start])], 1, start
    for k in range(MOST_ROWS):
        if rows >= MOST_ROWS and k >= LEAST_REVERSALS:
            break
        up = k % 2 == 0
        level = hi if up else lo  # full loops first, which leave the same memory in every model
        if k >= 4:
            level = float(rng.uniform(last, hi) if up else rng.uniform(lo, last))
        shape = shapes[order[k % len(order)]]
        parts.append(last + (level - last) * shape)
        rows, last = rows + len(shape), level
    return np.concatenate(parts)


def unseen(data: Dataset) -> float:
    """Return the share of the states (input and `PLAYS` plays) of other signals that have no near training row."""
    if data.covariates:  # no kind of local parameters takes them
        return 0.0
    u, rows = data.u, data.train
    r = np.arange(1, PLAYS + 1) * float(np.ptp(u[rows])) / 2 / (PLAYS + 1)
    seen = np.column_stack([u, data.along(lambda v: plays(v, r, float(v[0])))])[rows]
    limits: dict[str, Value] = {"lo": seen.min(axis=0), "hi": seen.max(axis=0)}
    nodes = [
        Node("input", "scaling", {"n": 1}),
        Node("bank", "play_bank", {"n": PLAYS}, {"r": r, "z0": float(u[0])}),
        Node("states", "scaling", {"n": PLAYS + 1}, limits),
    ]
    wires = [("input.y", "bank.u"), ("input.y", "states.u[1]")]
    wires += [(f"bank.z[{k}]", f"states.u[{k + 1}]") for k in range(1, PLAYS + 1)]
    graph = Graph(nodes, wires, [Input("u", ("input.u",))], [Output("y", "states.y[1]")])
    covered = coverage(graph, data)
    return 0.0 if covered is None else 1 - covered / 100

"""Share of the memory that a record does not cover: states of input and plays that other signals reach."""

from __future__ import annotations

import numpy as np

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output, Value
from hystfmu.identify.features.plays import plays
from hystfmu.model.coverage import coverage

PLAYS = 2  # that stand for the memory of a kind with local parameters


def unseen(data: Dataset) -> float:
    """Return the share of the states of other signals, the input and `PLAYS` plays, without a near training row."""
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

"""Prandtl-Ishlinskii model: y = c + w0 u + sum_i w_i p_{r_i}[u] with weights w >= 0 and a free offset c.

The model consists of a linear term, N plays and an offset (Krejci & Kuhnen 2001, eq. 5-9). Non-negative least squares
gives the weights. Shen & Ma 2017 fit the same model in 20 hours with a general optimiser.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hystfmu.base.arrays import Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import plays, thresholds, u0_of, u0_option
from hystfmu.identify.graphs import device, wired
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "weighted plays, non-negative least squares; exact inverse"
MEMORY = Memory(800.0, "N")
RECORDS = True
CANDIDATES = (
    Candidate(CLOSES, 0.02, 0.01),
    Candidate(CLOSES, 0.05, 0.06, {"N": 200}),
)
OPTIONS = (
    Option("N", 40, 1, 100000, text="number of plays"),
    Option("w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; above 0 a continuous inverse exists"),
    u0_option("every play rests"),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit the graph ``prandtl_ishlinskii -> scaling``; return graph and number of parameters."""
    u0 = u0_of(data, options)
    rows = data.counted
    r = thresholds(data.u[data.train], options["N"])
    columns = np.column_stack([data.u, data.along(lambda u: plays(u, r, u0))])[rows]
    progress(0.1)
    least = options["w0_min"]
    w, (offset,) = nonnegative(columns, data.y[rows] - least * columns[:, 0], np.ones((len(columns), 1)))
    return graph(least + w[0], r, w[1:], u0, offset, data), len(r) + 2


def graph(w0: float, r: Any, w: Any, u0: float, offset: float, data: Dataset) -> Graph:
    """Return the graph of a Prandtl-Ishlinskii model with an offset.

    w0 is the linear weight. r and w are the thresholds and weights of the plays, which rest at the input u0.
    """
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w0, "r": r, "w": w, "u0": u0}),
        Node("readout", "scaling", {"n": 1}, {"offset": offset}),
    ]
    return device(data, nodes, wired(nodes), ["hysteresis.u"], start=u0)

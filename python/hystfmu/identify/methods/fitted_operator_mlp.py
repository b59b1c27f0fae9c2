"""Expanded input space (x, z), z the output of a Prandtl-Ishlinskii model fitted to the data, and a network on it.

Zhao & Tan 2008 and Shen & Ma 2017 pair the input with an operator of a given shape. Any sum of plays is such an
operator with another branch; the sum that is closest to the data is fitted by non-negative least squares. The network
adds the static nonlinearity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.candidate import CLOSES, Candidate, Memory
from hystfmu.identify.features import output_bend
from hystfmu.identify.features.plays import plays, thresholds, u0_of, u0_option
from hystfmu.identify.network import readout
from hystfmu.identify.network.readout import Features, fit_readout
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "fitted weighted plays and a network on (x, their sum)"
MEMORY = Memory(1800.0, "N")
COVARIATES = True
CANDIDATES = (Candidate(CLOSES, 1.0, 0.05, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("N", 40, 1, 100000, text="number of plays"),
    output_bend.OPTION,
    u0_option("every play rests"),
    *readout.options(hidden=12, starts=3, iterations=150),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build ``(u, prandtl_ishlinskii) -> scaling -> mlp -> scaling``; return it with the number of its parameters."""
    u, rows = data.u, data.counted
    u0 = u0_of(data, options)
    r = thresholds(u[data.train], options["N"])
    columns = np.column_stack([u, plays(u, r, u0)])[rows]
    v, free = output_bend.straightened(u[rows], data.y[rows], options["bend"], data.covariates.values[rows])
    w, _ = nonnegative(columns, v, free)
    progress(0.2)
    nodes = [
        Node("input", "scaling", {"n": 1}),
        Node("operator", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": u0}),
    ]
    front = Features(nodes, [("input.y", "operator.u")], ["input.u"], ["input.y", "operator.y"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, lambda f: progress(0.2 + 0.8 * f))
    return graph, parameters + len(w)

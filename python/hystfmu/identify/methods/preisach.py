"""Preisach model with a smooth density, weights >= 0, and parallel rate-dependent terms if the data show them.

  y = c + integral over alpha >= beta of mu(alpha, beta) relay_{alpha, beta}[u]
        [ + sum_l k_l q_l + sum_j x_j S(q_b - m, s_j) ],   T_l q_l' = u - q_l,  T_b q_b' = u - q_b

mu is a smooth function of few parameters (`smooth_density`). Minor loops differ with their position, unlike those of a
sum of plays, but wiping-out and congruence hold. Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1. The terms
in brackets are creep (Krejci & Kuhnen 2001) and dead zones S of a lagged input, which widen the loop with the rate.

The model is linear in all weights.  A ridge and two penalties make the density smooth; their strengths, and whether the
model has the rate-dependent terms, follow from tenfold cross-validation over consecutive training rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import ANY, Candidate, Memory
from hystfmu.identify.features.dead_zones_and_lags import dead_zones, knots, lag
from hystfmu.identify.features.smooth_density import smooth_density
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.penalised import Penalised, best_strengths

TEXT = "smooth density of relays, weights >= 0, and rate dependence; gives the Everett function"
MEMORY = Memory(9800.0, "n", 2)
RECORDS = True
LEVELS = ((1e-4, 1e-3, 1e-2), (3e-3, 3e-2, 0.3), (3e-3, 3e-2, 0.3))  # of ridge, penalty over the mean, over the width
LAGS, DEAD_ZONES = 6, 6
BETTER = 0.6  # ratio of errors below which rate dependence is kept: on one slow record it mimics a memory
CANDIDATES = (Candidate(ANY, 0.5, 0.42, quick={"n": 20, "widths": 12, "means": 4}),)
OPTIONS = (
    Option("n", 40, 1, 100, text="steps of the grid of the Everett function"),
    Option("widths", 32, 2, 100, text="hat functions of the half-difference of the thresholds"),
    Option("means", 8, 1, 50, text="B-splines of their mean"),
    Option("rate", None, choices=("yes", "no"), text="creep and rate dependence; default: by cross-validation"),
    Option("start", "demagnetised", choices=("demagnetised", "low", "high"), text="memory before the first row"),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build the graph of the equation above; return it with the number of its weights."""
    rows = data.counted
    u, y = data.u[rows], data.y[rows]
    density = smooth_density(data.u[data.train], options["n"], options["widths"], options["means"], options["start"])
    bounded = data.along(density.columns, data.train.stop)[rows]
    sign = -1.0 if np.sum((u - u.mean()) * (y - y.mean())) < 0 else 1.0  # -1 if the output falls as u rises
    progress(0.2)
    rate = _Rate(data)
    tried: list[tuple[float, Array, Array, float]] = []
    for free in [np.zeros((len(u), 0))] * (options["rate"] != "yes") + [rate.columns] * (options["rate"] != "no"):
        problem = Penalised(bounded, free, sign * y, (density.along_mean, density.along_width))
        strengths, error = best_strengths(problem, LEVELS, partial(_report, progress, 0.2 + 0.4 * len(tried)))
        if not tried or error < BETTER * tried[-1][0]:
            tried.append((error, *problem.solve(strengths)))
    _, x, v, offset = tried[-1]
    hysteresis = density.node("hysteresis", sign * (density.E @ x), sign * offset)
    graph = rate.behind(hysteresis, sign * v, data) if len(v) else _alone(hysteresis, data)
    return graph, len(x) + len(v) + 1


def _report(progress: Callable[[float], None], done: float, fraction: float) -> None:
    progress(done + 0.4 * fraction)


def _alone(hysteresis: Node, data: Dataset) -> Graph:
    inputs = [Input("u", ("hysteresis.u",), data.unit_u, float(data.u[0]))]
    return Graph([hysteresis], (), inputs, [Output("y", "hysteresis.y", data.unit_y)])


class _Rate:
    """Columns of the rate-dependent terms, and their blocks."""

    def __init__(self, data: Dataset) -> None:
        rows, h = data.counted, data.h
        longest = max(data.train.stop * h / 3, 10 * h)
        self.T = np.geomspace(h, longest, LAGS)
        self.T_bend = 4 * h
        self.middle = float(data.u[data.train].mean())
        self.s = knots(data.u[data.train] - self.middle, DEAD_ZONES)
        lagged = [data.along(partial(lag, h=h, T=T))[rows] for T in self.T]
        bent = data.along(partial(lag, h=h, T=self.T_bend))[rows]
        self.columns = np.column_stack([*lagged, dead_zones(bent - self.middle, self.s)])

    def behind(self, hysteresis: Node, v: Array, data: Dataset) -> Graph:
        """Return the graph of the hysteresis and the terms with weights v, in the order of the columns."""
        nodes = [
            hysteresis,
            Node("creep", "creep", {}, {"w": v[:LAGS], "T": self.T, "start": "steady"}),
            Node("lag", "creep", {}, {"w": 1.0, "T": self.T_bend, "start": "steady"}),
            Node("middle", "scaling", {"n": 1}, {"offset": -self.middle}),
            Node("bend_of_lag", "dead_zones", {}, {"w0": 0.0, "r": self.s, "w": v[LAGS:]}),
            Node("readout", "sum", {"n": 3}),
        ]
        wires = [("lag.y", "middle.u"), ("middle.y", "bend_of_lag.u")]
        wires += [(f"{name}.y", f"readout.u[{i}]") for i, name in enumerate(("hysteresis", "creep", "bend_of_lag"), 1)]
        inputs = [Input("u", ("hysteresis.u", "creep.u", "lag.u"), data.unit_u, float(data.u[0]))]
        return Graph(nodes, wires, inputs, [Output("y", "readout.y", data.unit_y)])

"""Rate-dependent asymmetric Prandtl-Ishlinskii model: dead zones of the input and of a lagged input.

  y = c + w0 u + sum w_i p_{r_i}[u] + sum v_j S(u - m, s_j) + sum x_j S(q_b - m, s_j) + sum k_l q_l,
  T_l q_l' = u - q_l,  T_b q_b' = u - q_b,

with S the one-sided dead zone (Kuhnen 2003) and m the mean of the input.  The model is linear in all weights, w >= 0,
the rest free.  The difference between a dead zone of u and one of the lagged u is du/dt times a slope that depends on
u.  It widens the loop with the rate, which no sum of plays does.

Free lags compensate each other, and a short record hardly shows their effect on slow drift.  So the ridge is the
largest whose error in tenfold cross-validation, over consecutive training rows, is within one standard error of the
least (Breiman et al. 1984; Hastie, Tibshirani & Friedman 2009, section 7.10).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import LAGS, Candidate
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.methods.prandtl_ishlinskii_asym import dead_zones, knots, lag
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "plays, creep, dead zones of the input and of a lagged input; ridge by cross-validation"
RECORDS = True
FOLDS = 10
RIDGES = (1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2)

CANDIDATES = (Candidate(LAGS, 0.05, 0.05),)
OPTIONS = (
    Option("N", 20, 1, 10000, text="number of plays"),
    Option("dead_zones", 6, 1, 1000, text="dead zones of the input, and as many of the lagged input"),
    Option("lags", 6, 1, 1000, text="number of first-order lags"),
    Option("T_min", None, 1e-12, 1e12, text="shortest time constant (s); default one sample"),
    Option("T_max", 8.0, 1e-12, 1e12, text="longest time constant (s)"),
    Option(
        "T_bend", None, 1e-12, 1e12, text="time constant of the lag before the dead zones (s); default four samples"
    ),
    Option("ridge", None, 0.0, 1e6, text="ridge on the weights, each scaled by its column; default: cross-validation"),
    u0_option("every play rests"),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build the graph of the equation above; return it with the number of its weights."""
    rows, u = data.counted, data.u
    u0 = u0_of(data, options)
    r = thresholds(u[data.train], options["N"])
    middle = float(u[data.train].mean())
    s = knots(u[data.train] - middle, options["dead_zones"])
    shortest = data.h if options["T_min"] is None else options["T_min"]
    T = np.geomspace(shortest, max(shortest, options["T_max"]), options["lags"])
    T_bend = 4 * data.h if options["T_bend"] is None else options["T_bend"]
    lagged = [data.along(partial(lag, h=data.h, T=t))[rows] for t in T]
    bent = data.along(partial(lag, h=data.h, T=T_bend))[rows]
    progress(0.2)
    bounded = np.column_stack([u, data.along(lambda u: plays(u, r, u0))])[rows]
    free = np.column_stack([dead_zones(u[rows] - middle, s), dead_zones(bent - middle, s), *lagged])
    y = data.y[rows]
    ridge = cross_validated(bounded, free, y) if options["ridge"] is None else options["ridge"]
    progress(0.9)
    w, (*weights, offset) = _Sums(bounded, free, y).solve(ridge)
    v, x, k = np.split(np.asarray(weights), [len(s), 2 * len(s)])
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": u0}),
        Node("creep", "creep", {}, {"w": k, "T": T, "start": "steady"}),
        Node("lag", "creep", {}, {"w": 1.0, "T": T_bend, "start": "steady"}),
        Node("middle", "scaling", {"n": 2}, {"offset": -middle}),
        Node("bend", "dead_zones", {}, {"w0": 0.0, "r": s, "w": v}),
        Node("bend_of_lag", "dead_zones", {}, {"w0": 0.0, "r": s, "w": x}),
        Node("readout", "sum", {"n": 4}, {"offset": offset}),
    ]
    wires = [("lag.y", "middle.u[2]"), ("middle.y[1]", "bend.u"), ("middle.y[2]", "bend_of_lag.u")]
    ends = ("hysteresis", "creep", "bend", "bend_of_lag")
    wires += [(f"{name}.y", f"readout.u[{i + 1}]") for i, name in enumerate(ends)]
    inputs = [Input("u", ("hysteresis.u", "creep.u", "lag.u", "middle.u[1]"), data.unit_u, u0)]
    return Graph(nodes, wires, inputs, [Output("y", "readout.y", data.unit_y)]), len(w) + len(weights) + 1


class _Sums:
    """A regression reduced to the triangle of its QR factors, so that a new ridge does not cost all rows."""

    def __init__(self, bounded: Array, free: Array, y: Array) -> None:
        self.n = bounded.shape[1]
        columns = np.column_stack([bounded, free])
        self.middle, self.mean = columns.mean(axis=0), float(y.mean())
        centred = columns - self.middle
        self.size = np.linalg.norm(centred, axis=0)
        self.size[self.size == 0] = 1.0
        self.triangle = np.linalg.qr(np.column_stack([centred / self.size, y - self.mean]))[1]

    def solve(self, ridge: float) -> tuple[Array, Array]:
        """Return the weights of the bounded columns, and of the free ones with the constant last."""
        m = len(self.size)
        stacked = np.vstack([self.triangle[:, :m], ridge * np.eye(m)])
        right = np.concatenate([self.triangle[:, m], np.zeros(m)])
        x, v = nonnegative(stacked[:, : self.n], right, stacked[:, self.n :])
        x, v = x / self.size[: self.n], v / self.size[self.n :]
        return x, np.append(v, self.mean - self.middle[: self.n] @ x - self.middle[self.n :] @ v)


def cross_validated(bounded: Array, free: Array, y: Array) -> float:
    """Return the largest ridge within one standard error of the best, over `FOLDS` chunks of consecutive rows.

    Parameters
    ----------
    bounded, free : array, shape (n, p) and (n, q)
        Columns with non-negative weights, and with free weights; a constant is added.
    y : array, shape (n,)
        Target.
    """
    folds = min(FOLDS, len(y) // 2)
    errors = np.empty((len(RIDGES), folds))
    for f, held in enumerate(np.array_split(np.arange(len(y)), folds)):
        kept = np.delete(np.arange(len(y)), held)
        sums = _Sums(bounded[kept], free[kept], y[kept])
        for i, ridge in enumerate(RIDGES):
            x, v = sums.solve(ridge)
            e = bounded[held] @ x + free[held] @ v[:-1] + v[-1] - y[held]
            errors[i, f] = np.mean(e**2)
    mean = errors.mean(axis=1)
    best = int(np.argmin(mean))
    limit = mean[best] + errors[best].std(ddof=1) / np.sqrt(folds)
    return max(ridge for ridge, e in zip(RIDGES, mean, strict=True) if e <= limit)

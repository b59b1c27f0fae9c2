"""Asymmetric Prandtl-Ishlinskii model with creep: plays, one-sided dead zones and first-order lags of the input.

y = c + w0 u + sum w_i p_{r_i}[u] + sum v_j S(u, s_j) + sum k_l q_l,  T_l q_l' = u - q_l.  The model is linear in all
weights: one bounded least-squares problem with w, k >= 0 (plays follow and lags trail the input), v and c free.  It is
the modified Prandtl-Ishlinskii operator with creep of Kuhnen 2003, except that the dead zones act on the input, which
keeps it linear.

Lags close to each other and to the linear term are nearly equal.  A ridge on the scaled weights distributes the weight
among them; without it, large weights of opposite sign fit the noise.  Trap: the training error does not determine the
ridge, and splits of one decaying sine disagree about it (0 to 0.03).  Validate it on other signals of your actuator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import ANY, Candidate
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "plays, dead zones and creep of the input, least squares"
RECORDS = True
CANDIDATES = (Candidate(ANY, 0.02, 0.01),)
OPTIONS = (
    Option("N", 20, 1, 10000, text="number of plays"),
    Option("dead_zones", 6, 1, 1000, text="number of dead zones, evenly over the training range"),
    Option("lags", 6, 1, 1000, text="number of first-order lags"),
    Option("T_min", None, 1e-12, 1e12, text="shortest time constant (s); default one sample"),
    Option("T_max", 8.0, 1e-12, 1e12, text="longest time constant (s)"),
    Option("ridge", 0.01, 0.0, 1e6, text="ridge on the weights, each scaled by its column"),
    u0_option("every play rests"),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """Build the graph ``(prandtl_ishlinskii, dead_zones, creep) -> sum``; return it with the number of its weights."""
    rows, u = data.counted, data.u
    u0 = u0_of(data, options)
    r = thresholds(u[data.train], options["N"])
    s = knots(u[data.train], options["dead_zones"])
    shortest = data.h if options["T_min"] is None else options["T_min"]
    T = np.geomspace(shortest, max(shortest, options["T_max"]), options["lags"])
    lagged = np.column_stack([data.along(partial(lag, h=data.h, T=t)) for t in T])
    progress(0.3)
    bounded = np.column_stack([u, data.along(lambda u: plays(u, r, u0)), lagged])[rows]
    x, (*v, offset) = ridge_fit(bounded, dead_zones(u[rows], s), data.y[rows], options["ridge"])
    w, k = x[1 : 1 + len(r)], x[1 + len(r) :]
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": x[0], "r": r, "w": w, "u0": u0}),
        Node("bend", "dead_zones", {}, {"w0": 0.0, "r": s, "w": v}),
        Node("creep", "creep", {}, {"w": k, "T": T, "start": "steady"}),
        Node("readout", "sum", {"n": 3}, {"offset": offset}),
    ]
    wires = [(f"{node.name}.y", f"readout.u[{i + 1}]") for i, node in enumerate(nodes[:3])]
    inputs = [Input("u", ("hysteresis.u", "bend.u", "creep.u"), data.unit_u, u0)]
    return Graph(nodes, wires, inputs, [Output("y", "readout.y", data.unit_y)]), len(x) + len(v) + 1


def ridge_fit(bounded: Array, free: Array, y: Array, ridge: float) -> tuple[Array, Array]:
    """Minimise |y - c - bounded x - free v|^2 + (ridge |scaled weights|)^2 over x >= 0, v, c.

    Parameters
    ----------
    bounded, free : array, shape (n, p) and (n, q)
        Columns with non-negative weights, and columns with free weights.
    y : array, shape (n,)
        Target.
    ridge : float
        Ridge on the weights, each scaled by its column.

    Returns
    -------
    x : array, shape (p,)
        Non-negative weights.
    v : array, shape (q + 1,)
        Free weights, the constant c last.
    """
    columns = np.column_stack([bounded, free])
    middle = columns.mean(axis=0)
    size = np.linalg.norm(columns - middle, axis=0)
    size[size == 0] = 1.0
    m = columns.shape[1]
    stacked = np.vstack([(columns - middle) / size, ridge * np.eye(m)])
    n = bounded.shape[1]
    x, v = nonnegative(stacked[:, :n], np.concatenate([y - y.mean(), np.zeros(m)]), stacked[:, n:])
    x, v = x / size[:n], v / size[n:]
    return x, np.append(v, y.mean() - middle[:n] @ x - middle[n:] @ v)


def knots(u: Array, n: int) -> Array:
    """Return thresholds (n,) of dead zones, evenly inside the range of u; at 0 a dead zone would be the input."""
    s = u.min() + np.ptp(u) * np.arange(1, n + 1) / (n + 1)
    least = 1e-6 * np.ptp(u)
    return np.where(np.abs(s) < least, least, s)


def dead_zones(u: Array, s: Array) -> Array:
    """Return one-sided dead zones of u (n,), shape (n, m); the sign of a threshold in s (m,) is its side."""
    d = u[:, None] - s
    return np.where(s > 0, np.maximum(d, 0), np.minimum(d, 0))


def lag(u: Array, h: float, T: float) -> Array:
    """Run a first-order lag of u (n,) from its steady state in the C core; step h (s), time constant T (s)."""
    return Graph.single(Node("lag", "creep", {}, {"w": 1.0, "T": T, "start": "steady"})).run(u, h)

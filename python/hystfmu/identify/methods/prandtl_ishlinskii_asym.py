"""Asymmetric Prandtl-Ishlinskii model with creep: plays, one-sided dead zones and first-order lags of the input.

y = c + w0 u + sum w_i p_{r_i}[u] + sum v_j S(u, s_j) + sum k_l q_l,  T_l q_l' = u - q_l;  linear in all weights, so one
bounded least-squares problem: w, k >= 0 (plays follow and lags trail the input), v and c free.  Modified
Prandtl-Ishlinskii operator with creep: Kuhnen 2003; here the dead zones act on the input, which keeps it linear.

Lags near each other and near the linear term are almost copies; a ridge on the scaled weights shares between them
instead of letting large weights of opposite sign fit the noise.  Its size cannot be read from the training error, and
splits of one decaying sine disagree about it (0 to 0.03): check it on other signals of your own actuator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.features.initial_memory import u0_of, u0_option
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.options import Option
from hystfmu.identify.solvers.nonnegative import nonnegative

OPTIONS = (
    Option("N", 20, 1, 10000, text="number of plays"),
    Option("dead_zones", 6, 1, 1000, text="number of dead zones, evenly over the training range"),
    Option("lags", 6, 1, 1000, text="number of first-order lags"),
    Option("T_min", None, 1e-12, 1e12, text="shortest time constant in s; default one sample"),
    Option("T_max", 8.0, 1e-12, 1e12, text="longest time constant in s"),
    Option("ridge", 0.01, 0.0, 1e6, text="ridge on the weights, each scaled by its column"),
    u0_option("every play rests"),
)


def build(data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]) -> tuple[Graph, int]:
    """The graph ``(prandtl_ishlinskii, dead_zones, creep) -> sum`` and the number of its weights."""
    rows, u = data.train, data.u
    u0 = u0_of(data, options)
    r = thresholds(u[rows], options["N"])
    s = knots(u[rows], options["dead_zones"])
    shortest = data.h if options["T_min"] is None else options["T_min"]
    T = np.geomspace(shortest, max(shortest, options["T_max"]), options["lags"])
    lagged = np.column_stack([lag(u, data.h, t) for t in T])
    progress(0.3)
    bounded = np.column_stack([u, plays(u, r, u0), lagged])[rows]
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
    """min |y - c - bounded x - free v|^2 + (ridge |scaled weights|)^2 over x >= 0, v, c.

    Parameters
    ----------
    bounded, free : array, shape (n, p) and (n, q)
        Columns whose weights are at least 0, and columns of any weight.
    y : array, shape (n,)
    ridge : float

    Returns
    -------
    x : array, shape (p,)
    v : array, shape (q + 1,)
        The constant c at its end.
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
    """Thresholds (n,) of dead zones, evenly inside the range of u; none at 0, where a dead zone is the input itself."""
    s = u.min() + np.ptp(u) * np.arange(1, n + 1) / (n + 1)
    least = 1e-6 * np.ptp(u)
    return np.where(np.abs(s) < least, least, s)


def dead_zones(u: Array, s: Array) -> Array:
    """One-sided dead zones of u (n,) with thresholds s (m,): shape (n, m); the sign of a threshold is its side."""
    d = u[:, None] - s
    return np.where(s > 0, np.maximum(d, 0), np.minimum(d, 0))


def lag(u: Array, h: float, T: float) -> Array:
    """First-order lag of u (n,) that starts in its steady state, run by the C core; h and T in s."""
    return Graph.single(Node("lag", "creep", {}, {"w": 1.0, "T": T, "start": "steady"})).run(u, h)

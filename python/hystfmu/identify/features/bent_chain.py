"""Graph of a chain that `bent_sum` fitted: operator, bend, parts that depend on covariates, creep, dynamics, offset.

The bend is a sum of dead zones that interpolates the polynomial, because that has an exact inverse and continues as a
straight line outside the range of the training rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from numpy.polynomial import legendre

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.features.bent_sum import BentSum
from hystfmu.identify.features.covariate_inputs import covariate_inputs
from hystfmu.identify.features.dynamics import Dynamics
from hystfmu.identify.features.relay_sum import RelaySum

SMOOTH = 1e-5  # largest distance of the dead zones from the polynomial, relative to its range
MOST_KNOTS = 400
PAIR = {"n": 2, "m": 0}
MARGIN = 0.05  # covariates are limited to the training range and this fraction of it


class Parts(Protocol):
    """Structure of a chain: see `hystfmu.identify.methods.actuator.Parts`."""

    @property
    def operator(self) -> str:
        """plays, stops or relays."""
        ...

    @property
    def T(self) -> tuple[float, ...]:
        """Time constants of creep (s)."""
        ...

    @property
    def g(self) -> Dynamics | None:
        """Dynamics behind it."""
        ...

    @property
    def levels(self) -> tuple[str, ...]:
        """The part of the model that depends on each covariate."""
        ...


class Fitting(Protocol):
    """Scaling, operators and covariates of a fit; `hystfmu.identify.methods.actuator` explains them."""

    data: Dataset
    options: Mapping[str, Any]
    middle: float
    half: float
    x0: float
    r: Array
    low: Array
    high: Array
    relays: RelaySum


def chain(f: Fitting, parts: Parts, s: BentSum) -> Graph:
    """Return the graph of a structure with its fit."""
    data = f.data
    slope, r, weights, at_0 = dead_zones(s.q)
    front = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / f.half, "offset": -f.middle / f.half}),
        _hysteresis(f, parts.operator, s.w),
        Node("bend", "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}),
    ]
    nodes, wires, inputs = [*front], wired(front), [Input("u", ("input.u",), data.unit_u, data.u[0])]
    used = [j for j, level in enumerate(parts.levels) if level != "none"]
    if used:
        more, joined, ends = _beside(f, parts, s, used, at_0)
        nodes, wires = nodes + more, wires + joined
        inputs += [covariate_inputs(data, ends)[j] for j in used]
    tail = [nodes[-1]]
    if parts.T:
        tail.append(Node("creep", "creep", {}, {"w0": 1.0, "w": s.k, "T": np.array(parts.T), "start": "steady"}))
    if parts.g:
        source = Output("y", f"{tail[-1].name}.y")
        at_rest = Graph(nodes + tail[1:], wires + wired(tail), inputs, [source])
        beside = data.covariates.values[:1, used]
        first = float(at_rest.run(np.column_stack([data.u[:1], beside]), data.h)[0])
        dynamics = parts.g.nodes(data.h, f.options["hold"])
        tail += [dynamics[0], *(n.with_values(y0=first) for n in dynamics[1:])]
    tail.append(Node("readout", "scaling", {"n": 1}, {"offset": at_0 * (1 + s.k.sum())}))
    return Graph(nodes + tail[1:], wires + wired(tail), inputs, [Output("y", "readout.y", data.unit_y)])


def _hysteresis(f: Fitting, operator: str, w: Array) -> Node:
    if operator == "relays":
        return f.relays.node("hysteresis", w)
    signed = np.concatenate([[w.sum()], -w[1:]]) if operator == "stops" else w
    return Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": signed[0], "r": f.r, "w": signed[1:], "u0": f.x0})


def _beside(
    f: Fitting, parts: Parts, s: BentSum, used: list[int], at_0: float
) -> tuple[list[Node], list[tuple[str, str]], list[tuple[str, ...]]]:
    """Return blocks and wires of a bend that depends on covariates, and their ends.

    Parameters
    ----------
    f, parts, s
        As in `chain`.
    used : list of int
        Numbers of the covariates that act.
    at_0 : float
        Value of the bend at 0, which its block omits.
    """
    names, n = f.data.covariates.names, len(used)
    half = (f.high - f.low)[used] / 2
    middle = (f.high + f.low)[used] / 2
    limits = {"lo": f.low[used] - 2 * MARGIN * half, "hi": f.high[used] + 2 * MARGIN * half}
    nodes = [Node("covariates", "scaling", {"n": n}, {"gain": 1 / half, "offset": -middle / half, **limits})]
    wires: list[tuple[str, str]] = []
    source, theta = "bend.y", [f"covariates.y[{i + 1}]" for i in range(n)]
    offsets = s.g[used] * at_0 + s.c[used, 0]
    bent: list[str] = []
    if s.g.any():
        nodes += [Node("gain", "sum", {"n": n}, {"k": s.g[used], "offset": 1.0}), Node("scheduled", "product", PAIR)]
        wires += [("covariates.y", "gain.u"), (source, "scheduled.u[1]"), ("gain.y", "scheduled.u[2]")]
        source = "scheduled.y"
    for i, j in enumerate(used):
        if parts.levels[j] != "bend":
            continue
        slope, r, weights, offsets[i] = dead_zones(s.c[j])
        bend, times = f"bend_{names[j]}", f"times_{names[j]}"
        nodes.append(Node(bend, "dead_zones", {"n": len(r)}, {"w0": slope, "r": r, "w": weights}))
        nodes.append(Node(times, "product", PAIR))
        wires += [("hysteresis.y", f"{bend}.u"), (f"{bend}.y", f"{times}.u[1]"), (theta[i], f"{times}.u[2]")]
        bent.append(f"{times}.y")
    k = np.concatenate([[1.0], offsets, np.ones(len(bent))])
    nodes.append(Node("following", "sum", {"n": len(k)}, {"k": k}))
    wires += [(end, f"following.u[{i + 1}]") for i, end in enumerate([source, *theta, *bent])]
    ends: list[tuple[str, ...]] = [
        (f"covariates.u[{used.index(j) + 1}]",) if j in used else () for j in range(len(names))
    ]
    return nodes, wires, ends


def wired(nodes: list[Node]) -> list[tuple[str, str]]:
    """Return the wires of a chain of nodes with ports u and y."""
    return [(f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(nodes)]


def dead_zones(q: Array) -> tuple[float, Array, Array, float]:
    """Return linear weight, thresholds, weights and value at 0 of dead zones that follow a Legendre series on [-1, 1].

    No threshold is 0, which is the input itself; beyond the thresholds the curve is straight.

    Parameters
    ----------
    q : array, shape (degree + 1,)
        Legendre coefficients.

    Returns
    -------
    w0 : float
        Weight of the linear term.
    r, w : array, shape (n,)
        Thresholds and weights of the dead zones.
    at_0 : float
        Value of the curve at 0, where the dead zones give 0.
    """
    if len(q) <= 2:
        return float(q[1]) if len(q) > 1 else 0.0, np.array([1.0]), np.zeros(1), float(q[0])
    fine = np.linspace(-1.0, 1.0, 4001)
    wanted = legendre.legval(fine, q)
    m = 4
    while True:
        at = (np.arange(2 * m) - m + 0.5) / (m - 0.5)  # from -1 to 1, symmetrical, without 0
        height = legendre.legval(at, q)
        if 2 * m >= MOST_KNOTS or np.abs(np.interp(fine, at, height) - wanted).max() <= SMOOTH * np.ptp(wanted):
            break
        m *= 2
    slope = np.diff(height) / np.diff(at)
    centre = float(slope[m - 1])
    change = np.diff(slope)  # at at[1:-1]
    r = at[1:-1]
    weights = np.where(r > 0, change, -change)
    return centre, np.asarray(r), np.asarray(weights, float), float(height[m - 1] - centre * at[m - 1])

"""Bouc-Wen operator as a grey box, y = c + a u + b z(u; beta, gamma, n), for loops that no sum of plays represents.

The parameters are redundant in scale: (A, beta, gamma) against the weight of z.  A = 1 removes the redundancy, so that
z starts with the slope of u.  The nonlinear parameters are the bound z_max = (beta + gamma)^(-1/n), the ratio
gamma / (beta + gamma) and the exponent n.  Offset, linear term and weight of z follow from linear least squares for
every trial (variable projection, Golub & Pereyra 1973).  Wen 1976; Ikhouane & Rodellar 2007.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import OPENS, Candidate
from hystfmu.identify.features import dead_band
from hystfmu.identify.options import Option

TEXT = "Bouc-Wen operator as a grey box, nonlinear least squares"
EVALUATIONS = (30, 200)  # limit on evaluations of residuals and Jacobian: per start, for the best start
ENOUGH = 1e-4  # misfit, relative to the span, below which no other start is tried

CANDIDATES = (Candidate(OPENS, 0.2, 0.4, quick={"starts": 1}),)
OPTIONS = (
    Option("starts", 6, 1, 1000, text="starts of the search"),
    Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"),
    Option("z0", None, -1.0, 1.0, text="z at the first row, as a fraction of its bound; default: fitted"),
    dead_band.OPTION,
)


def operator(u: Array, p: Array) -> tuple[dict[str, float], Array]:
    """Return the parameters of the block and z (rows,) for p = (ln z_max, gamma share, n, z0 / z_max)."""
    z_max, share, n = float(np.exp(p[0])), float(p[1]), float(p[2])
    total = z_max**-n
    values = {
        "A": 1.0,
        "beta": (1 - share) * total,
        "gamma": share * total,
        "n": n,
        "z0": 0.999999 * float(p[3]) * z_max,
        "u0": float(u[0]),
    }
    graph = Graph.single(Node("z", "bouc_wen", {}, {**values, "alpha": 0.0, "k": 1.0}))
    return values, graph.run(u)[:, 1]


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the graph ``(scaling, bouc_wen) -> sum``; return it with its number of parameters and their bounds."""
    rows = data.counted
    seen = data.u[: data.train.stop]  # later rows do not affect the training rows
    middle, half = (seen.max() + seen.min()) / 2, np.ptp(seen) / 2
    u = (seen - middle) / half  # the operator acts on an input of about [-1, 1]
    y = data.y[rows]
    size = data.span / np.sqrt(len(y))

    def project(p: Array) -> tuple[Array, Array]:
        z = operator(u, p)[1][rows]
        columns = np.column_stack([np.ones(len(y)), u[rows], z])
        c = np.linalg.lstsq(columns, y, rcond=None)[0]
        return (columns @ c - y) / size, c

    def error(p: Array) -> Array:
        return project(p)[0]

    def search(first: Array, evaluations: int, tolerance: float) -> Any:
        scale = np.full(4, 0.3)
        return least_squares(
            error, first, bounds=(lo, hi), x_scale=scale, ftol=tolerance, xtol=tolerance, max_nfev=evaluations
        )

    lo = np.array([np.log(1e-3), -1.0, 1.0, -1.0])
    hi = np.array([np.log(1e2), 1.0, options["n_max"], 1.0])
    if options["z0"] is not None:
        lo[3], hi[3] = options["z0"] - 1e-9, options["z0"] + 1e-9
    rng = np.random.default_rng(seed)
    best = None
    for i in range(options["starts"]):
        progress(i / options["starts"])
        first = np.array([np.log(0.5), 0.5, 1.5, 0.0]) if i == 0 else _draw(rng, lo, hi)
        first = np.clip(first, lo + 1e-10, hi - 1e-10)
        r = search(first, EVALUATIONS[0], 1e-8)
        if best is None or r.cost < best.cost:
            best = r
        if np.sqrt(2 * best.cost) < ENOUGH:
            break
    assert best is not None
    best = search(np.clip(best.x, lo + 1e-10, hi - 1e-10), EVALUATIONS[1], 1e-13)
    values, _ = operator(u, best.x)
    offset, linear, weight = project(best.x)[1]
    graph = _graph(values, float(offset), float(linear), float(weight), float(middle), float(half), data)
    return graph, 7, {"bounded": searched(best.x, lo, hi)}


def searched(p: Array, lo: Array, hi: Array) -> dict[str, tuple[float, float, float]]:
    """Return ln z_max, the gamma share and n with the bounds of their search; the usual n = 1 counts as inside."""
    limits = zip(("ln z_max", "gamma / (beta + gamma)", "n"), p, (lo[0], lo[1], 0.0), hi, strict=False)
    return {name: (float(value), float(least), float(most)) for name, value, least, most in limits}


def _draw(rng: np.random.Generator, lo: Array, hi: Array) -> Array:
    return np.array([rng.uniform(np.log(0.05), np.log(3)), rng.uniform(0, 1), rng.uniform(lo[2], min(hi[2], 3.0)), 0.0])


def _graph(
    values: dict[str, float], offset: float, linear: float, weight: float, middle: float, half: float, data: Dataset
) -> Graph:
    nodes = [
        Node("input", "scaling", {"n": 1}, {"gain": 1 / half, "offset": -middle / half}),
        Node("operator", "bouc_wen", {}, {**values, "alpha": 0.0, "k": 1.0}),
        Node("readout", "sum", {"n": 2}, {"k": [linear, weight], "offset": offset}),
    ]
    wires = [("input.y", "operator.u"), ("input.y", "readout.u[1]"), ("operator.z", "readout.u[2]")]
    inputs = [Input("u", ("input.u",), data.unit_u, float(data.u[0]))]
    return Graph(nodes, wires, inputs, [Output("y", "readout.y", data.unit_y)])

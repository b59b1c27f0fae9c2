"""Bouc-Wen hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n)).

The operator and its scale are those of `bouc_wen` (A = 1), the dynamics those of `g0_prandtl_ishlinskii`.  Offset and
the two gains enter linearly and are eliminated (variable projection, Golub & Pereyra 1973).  Seven parameters are
searched: f_n, zeta, tau and the four of z.

The search starts with the dynamics alone: a bank of Bouc-Wen responses of fixed shapes, filtered by G0 and delayed, is
combined by least squares.  The bank represents a loop of any shape to about a percent, so that the dynamics do not
compensate for the loop, as they do with a sum of plays (f_n 3176 Hz instead of 500 Hz).  Then z is searched with these
dynamics, then all parameters together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.features.dynamics import DYNAMICS_OPTIONS, Dynamics, bounds, search, unknown
from hystfmu.identify.features.identifiable import standard_errors
from hystfmu.identify.methods.bouc_wen import operator
from hystfmu.identify.options import Option

TEXT = "Bouc-Wen hysteresis, then G0(s) with delay, variable projection"
MOST_ROWS = 5000  # more rows are thinned evenly, after filtering at the full rate
BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))
STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))  # z_max, gamma share, n
ENOUGH = 3e-3  # misfit, relative to the span, below which no other start is tried
EVALUATIONS = (15, 60)  # limit on evaluations of residuals and Jacobian: per start, for all parameters together

OPTIONS = (Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"), *DYNAMICS_OPTIONS)


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the graph ``scaling -> bouc_wen -> sum -> transfer_function [-> delay] -> scaling``.

    It returns the graph, the number of its parameters, and f_n (Hz), zeta, delay (s), with a warning for each of these
    that the data do not determine.
    """
    rows, h, hold = data.train, data.h, options["hold"]
    seen = data.u[: rows.stop]
    middle, half = float(seen.max() + seen.min()) / 2, float(np.ptp(seen)) / 2
    x = (data.u - middle) / half
    stride = -(-(rows.stop - rows.start) // MOST_ROWS)
    y = data.y[rows][::stride]
    size = data.span * np.sqrt(len(y))

    def project(columns: Array, g: Dynamics) -> tuple[Array, Array]:
        """Return residuals, and the coefficients of 1 and of the columns after the dynamics."""
        filtered = np.column_stack([np.ones(len(y)), g.filter(columns, h, hold)[rows][::stride]])
        scale = np.linalg.norm(filtered, axis=0)
        c = np.linalg.lstsq(filtered / scale, y, rcond=1e-10)[0] / scale
        return filtered @ c - y, c

    def responses(shape: Array) -> Array:
        return np.column_stack([x, operator(x, shape)[1]])

    bank = [operator(x, np.array([np.log(z_max), share, n, 0.0]))[1] for z_max, share, n in BANK]
    columns = np.column_stack([x, *bank])
    g = search(lambda g: project(columns, g)[0], data, options, lambda f: progress(0.5 * f))
    dynamics = np.array([np.log(g.f_n), np.log(g.zeta), g.delay / h])

    def error(p: Array) -> Array:
        return np.asarray(project(responses(p[3:]), Dynamics.at(p, h))[0] / size)

    def error_of_shape(shape: Array) -> Array:
        return error(np.concatenate([dynamics, shape]))

    least, most = bounds(data, options)
    lo = np.concatenate([least, [np.log(1e-3), -1.0, 1.0, -1.0]])
    hi = np.concatenate([most, [np.log(1e2), 1.0, options["n_max"], 1.0]])

    def inside(p: Array) -> Array:
        return np.clip(p, lo + 1e-9 * (hi - lo), hi - 1e-9 * (hi - lo))

    best = None
    for i, (z_max, share, n) in enumerate(STARTS):
        first = inside(np.concatenate([dynamics, [np.log(z_max), share, n, 0.0]]))
        found = least_squares(
            error_of_shape,
            first[3:],
            bounds=(lo[3:], hi[3:]),
            x_scale=np.full(4, 0.3),
            ftol=1e-8,
            xtol=1e-8,
            max_nfev=EVALUATIONS[0],
        )
        progress(0.5 + 0.3 * (i + 1) / len(STARTS))
        if best is None or found.cost < best.cost:
            best = found
        if np.sqrt(2 * best.cost) < ENOUGH:
            break
    assert best is not None
    scale = np.array([0.1, 0.1, 0.3, 0.3, 0.3, 0.3, 0.3])
    first = inside(np.concatenate([dynamics, best.x]))
    found = least_squares(error, first, "3-point", (lo, hi), x_scale=scale, ftol=1e-12, max_nfev=EVALUATIONS[1])
    g = Dynamics.at(found.x, h)
    coefficients = project(responses(found.x[3:]), g)[1]
    free = (found.x > lo + 1e-6 * (hi - lo)) & (found.x < hi - 1e-6 * (hi - lo))
    spread = standard_errors(found.fun, np.asarray(found.jac), free)
    warned = unknown(g, spread[:3], data, options)
    values = operator(x[:2], found.x[3:])[0]
    told = {**vars(g), **({"warnings": warned} if warned else {})}
    return _graph(g, values, coefficients, (middle, half), hold, data), 10, told


def _graph(
    g: Dynamics, values: dict[str, float], coefficients: Array, scale: tuple[float, float], hold: str, data: Dataset
) -> Graph:
    offset, linear, weight = (float(c) for c in coefficients)
    middle, half = scale
    dynamics = g.nodes(data.h, hold)
    hysteresis = Graph(
        [
            Node("input", "scaling", {"n": 1}, {"gain": 1 / half, "offset": -middle / half}),
            Node("operator", "bouc_wen", {}, {**values, "alpha": 0.0, "k": 1.0}),
            Node("hysteresis", "sum", {"n": 2}, {"k": [linear, weight]}),
        ],
        [("input.y", "operator.u"), ("input.y", "hysteresis.u[1]"), ("operator.z", "hysteresis.u[2]")],
        [Input("u", ("input.u",), data.unit_u, float(data.u[0]))],
        [Output("y", "hysteresis.y")],
    )
    if len(dynamics) > 1:
        dynamics[1] = dynamics[1].with_values(y0=float(hysteresis.run(data.u[:1])[0]))
    chain = [hysteresis.node("hysteresis"), *dynamics, Node("readout", "scaling", {"n": 1}, {"offset": offset})]
    wires = [*hysteresis.wires, *((f"{a.name}.y", f"{b.name}.u") for a, b in pairwise(chain))]
    return Graph([*hysteresis.nodes, *chain[1:]], wires, hysteresis.inputs, [Output("y", "readout.y", data.unit_y)])

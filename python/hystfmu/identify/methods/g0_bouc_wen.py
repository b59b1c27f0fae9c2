"""Bouc-Wen hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) (a u + b z(u; beta, gamma, n)).

The operator and its scale are those of `bouc_wen` (A = 1), the dynamics those of `g0_prandtl_ishlinskii`.  Offset and
the two gains enter linearly and are eliminated (variable projection, Golub & Pereyra 1973).  Seven parameters are
searched: f_n, zeta, tau and the four of z.

The search starts with the dynamics alone: a bank of Bouc-Wen responses of fixed shapes, filtered by G0 and delayed, is
combined by least squares.  The bank represents a loop of any shape to about a percent, so that the dynamics do not
compensate for the loop, as they do with a sum of plays (f_n 3176 Hz instead of 500 Hz).  Then z is searched with these
dynamics, then all parameters together on all rows.  A delay that the data do not support is left out (Bayesian
information criterion): it trades against f_n, whose standard error it multiplies by three.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.candidate import LATE, Candidate, Memory
from hystfmu.identify.features.dynamics import DYNAMICS_OPTIONS, Dynamics, bounds, search, unknown
from hystfmu.identify.features.identifiable import correlation_time, standard_errors
from hystfmu.identify.methods.bouc_wen import operator, searched
from hystfmu.identify.options import Option

TEXT = "Bouc-Wen hysteresis, then G0(s) with delay, variable projection"
MEMORY = Memory(1000.0)
MOST_ROWS = 5000  # more rows are thinned evenly for the starts, after filtering at the full rate
BANK = tuple((z_max, share, n) for z_max in (0.1, 0.3, 1.0, 3.0) for share in (0.0, 0.5) for n in (1.0, 2.0))
STARTS = ((0.5, 0.5, 1.5), (0.15, 0.2, 1.2), (2.0, 0.5, 1.5))  # z_max, gamma share, n
ENOUGH = 3e-3  # misfit, relative to the span, below which no other start is tried
DELAY = 2  # index of the delay among the parameters
EVALUATIONS = (15, 60)  # limit on evaluations of residuals and Jacobian: per start, for all parameters together

CANDIDATES = (Candidate(LATE, 0.5, 0.4),)
OPTIONS = (Option("n_max", 6.0, 1.0, 20.0, text="largest exponent n tried"), *DYNAMICS_OPTIONS)


def build(
    data: Dataset, options: Mapping[str, Any], seed: int, progress: Callable[[float], None]
) -> tuple[Graph, int, dict[str, Any]]:
    """Build the graph ``scaling -> bouc_wen -> sum -> transfer_function [-> delay] -> scaling``.

    It returns the graph, the number of its parameters, and f_n (Hz), zeta, delay (s), with a warning for each of these
    that the data do not determine.
    """
    rows, h, hold = data.counted, data.h, options["hold"]
    seen = data.u[: data.train.stop]
    middle, half = float(seen.max() + seen.min()) / 2, float(np.ptp(seen)) / 2
    x = (data.u - middle) / half
    stride = -(-len(data.y[rows]) // MOST_ROWS)

    def project(columns: Array, g: Dynamics, stride: int = stride) -> tuple[Array, Array]:
        """Return residuals, and the coefficients of 1 and of the columns after the dynamics."""
        y = data.y[rows][::stride]
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

    def error(p: Array, stride: int = 1) -> Array:
        e = project(responses(p[3:]), Dynamics.at(p, h), stride)[0]
        return np.asarray(e / (data.span * np.sqrt(len(e))))

    def error_of_shape(shape: Array) -> Array:
        return error(np.concatenate([dynamics, shape]), stride)

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

    def refined(first: Array, searched: NDArray[np.bool_]) -> tuple[Array, Any]:
        """Search the parameters `searched` from `first`, the others fixed."""

        def whole(q: Array) -> Array:
            p = first.copy()
            p[searched] = q
            return p

        def misfit(q: Array) -> Array:
            return error(whole(q))

        found = least_squares(
            misfit,
            first[searched],
            "3-point",
            (lo[searched], hi[searched]),
            x_scale=scale[searched],
            ftol=1e-12,
            max_nfev=EVALUATIONS[1],
        )
        return whole(found.x), found

    everything = np.ones(7, dtype=bool)
    p, found = refined(inside(np.concatenate([dynamics, best.x])), everything)
    progress(0.9)
    free = (p > lo + 1e-6 * (hi - lo)) & (p < hi - 1e-6 * (hi - lo))
    spread = standard_errors(found.fun, np.asarray(found.jac), free)
    parameters = 10
    if p[DELAY] > 0:
        independent = len(found.fun) / correlation_time(found.fun)
        prompt, without = refined(np.where(np.arange(7) == DELAY, 0.0, p), np.arange(7) != DELAY)
        if independent * np.log(without.cost / found.cost) <= np.log(independent):
            p, parameters = prompt, 9
    g = Dynamics.at(p, h)
    coefficients = project(responses(p[3:]), g, 1)[1]
    warned = unknown(g, spread[:3], data, options)  # the standard errors are those with the delay searched
    values = operator(x[:2], p[3:])[0]
    told = {**g.told, "bounded": searched(p[3:], lo[3:], hi[3:]), **({"warnings": warned} if warned else {})}
    return _graph(g, values, coefficients, (middle, half), hold, data), parameters, told


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

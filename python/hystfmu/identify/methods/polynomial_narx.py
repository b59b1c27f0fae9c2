"""Basis-function network for IPMC sensors: a polynomial of previous inputs, auxiliary functions and outputs.

The output is y(k) = theta' h(k). h contains all monomials up to order q of u(k-1..k-n_u), f(k-1..k-n_f) and
y(k-1..k-n_y). The auxiliary function f is the output of the Zhao-Tan operator. The weights theta are the solution of
one linear least-squares problem. Signals at neighbouring lags are nearly equal, so large weights could cancel each
other. Such weights amplify noise and frequencies outside the training data. A ridge on the scaled weights prevents
them. The block `recursive_least_squares` computes the same weights row by row.

With covariates c_j, scaled to [-1, 1], the weights are linear functions of the covariates: y(k) = (theta_0 + sum_j
c_j(k) theta_j)' h(k). This is also one least-squares problem. The graph then has one further network for each
covariate, whose output is multiplied by the covariate. With covariates, h contains no previous outputs.

As in `zhao_tan_mlp`, the range to which the input is scaled is a parameter, which is chosen by the training error.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb

import numpy as np

from hystfmu.base import Array, Indices, InputError, Progress
from hystfmu.data import Dataset
from hystfmu.data.dataset import Rows
from hystfmu.graph import Graph, Input, Node, Output
from hystfmu.identify.catalogue import (
    ANY,
    Candidate,
    Memory,
    Option,
    Options,
    Row,
    covariate_inputs,
    device,
    scaled_input,
)
from hystfmu.identify.features.plays import RANGE, branch_option, u0_of, u0_option
from hystfmu.identify.solvers.ridge import least_squares

TEXT = "polynomial of the lagged input and Zhao-Tan operator, least squares"
RANGES = (1.0, 2.0, 4.0)  # ranges of the scaled input that are tried
QUICK_LAGS = 3  # maximum number of lags in these trials
MOST_PARAMETERS = 5000

CANDIDATES = (Candidate(ANY, 0.05, 0.02),)
OPTIONS = (
    Option("n_u", 9, 1, 1000, text="number of lags of the input"),
    Option("n_f", 9, 0, 1000, text="number of lags of the auxiliary function; 0 omits this function"),
    Option("n_y", 0, 0, 1000, text="number of lags of the output"),
    Option("n_k", 1, 0, 1, text="first lag of input and auxiliary function; 0 includes the present values"),
    Option("q", 2, 1, 10, text="highest order of a monomial"),
    Option("ridge", 1e-3, 1e-12, 1e6, text="ridge on the weights, each scaled by its column"),
    branch_option("f"),
    RANGE,
    u0_option("the operator rests"),
    Option("margin", 0.05, 0.0, 1e300, text="the input is limited to the training range, extended by this fraction"),
)


@dataclass(frozen=True)
class Signals:
    """Signals from which the polynomial is computed, for all rows.

    The scaled input x and the auxiliary function f are the outputs of the blocks ``input`` and ``operator``. The scaled
    output is y = (measured - middle) / half. `beside` (rows, m) contains the covariates, scaled to [-1, 1].
    """

    nodes: tuple[Node, ...]
    x: Array
    f: Array
    y: Array
    middle: float
    half: float
    beside: Array

    def regressors(self, z: Array, q: int, rows: Rows) -> Array:
        """Return the monomials of z (rows, p), followed by their products with each covariate."""
        own = basis(z[rows], q)
        if self.beside.shape[1] == 0:
            return own
        return np.hstack([own, *(own * c[:, None] for c in self.beside[rows].T)])

    def lags(self, n_u: int, n_f: int, n_y: int, n_k: int) -> tuple[Array, Array]:
        """Return the lagged signals z(k), (rows, n_u + n_f + n_y), and gains that scale them to about [-1, 1].

        n_u, n_f and n_y are the numbers of lags, and n_k is the smallest lag of u and f.
        """
        z = np.column_stack([lagged(self.x, n_u, n_k), lagged(self.f, n_f, n_k), lagged(self.y, n_y)])
        most = [(np.abs(v).max(), n) for v, n in ((self.x, n_u), (self.f, n_f), (self.y, n_y))]
        return z, np.concatenate([np.full(n, 1 / m if m > 0 else 1.0) for m, n in most])


def signals(data: Dataset, span: float, memory: str, u0: float, margin: float) -> Signals:
    """Return the signals of the polynomial for the data, computed by the blocks ``scaling -> zhao_tan``.

    The scaled input has a range of width `span`. `memory` is the option of the operator, which starts at the input
    `u0`. Inputs are limited to the training range, extended on each side by `margin` times this range.
    """
    u, y = data.u[data.train], data.y[data.counted]
    (scaling, gain, offset), room = scaled_input(u, span), margin * float(np.ptp(u))
    nodes = (
        scaling.with_values(lo=float(u.min()) - room, hi=float(u.max()) + room),
        Node("operator", "zhao_tan", {}, {"memory": memory, "x0": gain * u0 + offset}),
    )
    ends = [Output("x", "input.y"), Output("f", "operator.h")]
    x, f = Graph(nodes, [("input.y", "operator.x")], [Input("u", ("input.u",))], ends).run(data.u, data.h).T
    middle, half = float(y.min() + y.max()) / 2, float(np.ptp(y)) / 2
    beside = _scaling(data, margin)
    c = data.covariates.values * beside["gain"] + beside["offset"]
    return Signals(nodes, x, f, (data.y - middle) / half, middle, half, c)


def _scaling(data: Dataset, margin: float) -> dict[str, Array]:
    """Return parameters of a block that scales covariates to [-1, 1] on the training rows, and limits their range.

    The limits are the ends of the training range, extended on each side by `margin` times this range.
    """
    c = data.covariates.values[data.train]
    lo, hi, wide = c.min(axis=0), c.max(axis=0), np.ptp(c, axis=0)
    limits = {"lo": lo - margin * wide, "hi": hi + margin * wide}
    return {"gain": 2 / wide, "offset": -(lo + hi) / wide, **limits}


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``scaling -> zhao_tan -> polynomial_narx -> scaling``; return graph and number of weights.

    An InputError is raised if there are too many weights, or if a fit with covariates has lags of y.
    """
    n_u, n_f, n_y, n_k, q = (options[name] for name in ("n_u", "n_f", "n_y", "n_k", "q"))
    if data.covariates and n_y:
        raise InputError(f"The option 'n_y' of polynomial_narx with covariates must be 0. Got {n_y} instead.")
    parameters = count(n_u + n_f + n_y, q) * (1 + len(data.covariates.names))
    rows = len(data.u[data.counted])
    if parameters > min(rows, MOST_PARAMETERS):
        raise InputError(
            f"The number of weights must be at most {MOST_PARAMETERS} and at most the {rows} training rows. "
            f"Got {parameters} for n_u = {n_u}, n_f = {n_f}, n_y = {n_y}, q = {q} instead."
        )
    u0 = u0_of(data, options)

    def front(span: float) -> Signals:
        return signals(data, span, options["memory"], u0, options["margin"])

    span = options["range"]
    if span is None:
        quick = [*(min(n, QUICK_LAGS) for n in (n_u, n_f, n_y)), n_k]
        trials = [(solve(front(trial), data.counted, quick, q, options["ridge"])[1], trial) for trial in RANGES]
        span = min(trials)[1] if n_f else 2.0
        progress(0.2)
    seen, lags = front(span), [n_u, n_f, n_y, n_k]
    theta, _, gains = solve(seen, data.counted, lags, q, options["ridge"])
    progress(0.4)
    weights = (theta.reshape(-1, count(n_u + n_f + n_y, q)) * basis(gains, q)).ravel()
    graph = assemble(data, seen, dict(zip(("n_u", "n_f", "n_y", "n_k"), lags, strict=True)), q, weights)
    if data.covariates:
        graph = _weighted(graph, data, _scaling(data, options["margin"]), weights)
    return graph, parameters


def solve(seen: Signals, rows: Rows, lags: list[int], q: int, ridge: float) -> tuple[Array, float, Array]:
    """Fit the weights of the scaled monomials up to order q; return weights, RMS error, and gains of the signals.

    `lags` contains n_u, n_f, n_y and n_k (see `Signals.lags`). `ridge` is the strength of the penalty on the weights.
    """
    z, gains = seen.lags(*lags)
    theta, rms = least_squares(seen.regressors(z * gains, q, rows), seen.y[rows], ridge)
    return theta, rms * seen.half, gains


def _weighted(graph: Graph, data: Dataset, scaling: Mapping[str, Array], theta: Array) -> Graph:
    """Add to the graph of `assemble` one network for each covariate, and multiply its output by this covariate."""
    names, first = data.covariates.names, graph.node("network")
    n = len(names)
    parts = theta.reshape(n + 1, -1)
    nodes = [n for n in graph.nodes if n.name != first.name]
    nodes += [first.with_values(theta=parts[0]), Node("total", "sum", {"n": n + 1})]
    nodes.append(Node("covariates", "scaling", {"n": n}, scaling))
    wires = [w for w in graph.wires if w[1] != "readout.u"]
    wires += [(f"{first.name}.y", "total.u[1]"), ("total.y", "readout.u")]
    for i, name in enumerate(names, 1):
        own, times = f"network_{name}", f"times_{name}"
        nodes.append(Node(own, first.type, first.dims, {"theta": parts[i]}))
        nodes.append(Node(times, "product", {"n": 2, "m": 0}))
        wires += [("input.y", f"{own}.u"), ("operator.h", f"{own}.f"), (f"{own}.y", f"{times}.u[1]")]
        wires += [(f"covariates.y[{i}]", f"{times}.u[2]"), (f"{times}.y", f"total.u[{i + 1}]")]
    ends = [(f"covariates.u[{i + 1}]",) for i in range(n)]
    return Graph(nodes, wires, [*graph.inputs, *covariate_inputs(data, ends)], graph.outputs)


def assemble(data: Dataset, seen: Signals, lags: Mapping[str, int], q: int, theta: Array) -> Graph:
    """Return the graph with the weights theta of the monomials, without the networks of covariates."""
    size = count(lags["n_u"] + lags["n_f"] + lags["n_y"], q)
    nodes = [
        *seen.nodes,
        Node("network", "polynomial_narx", {**lags, "q": q}, {"theta": theta[:size], "y0": seen.y[0]}),
        Node("readout", "scaling", {"n": 1}, {"gain": seen.half, "offset": seen.middle}),
    ]
    wires = [("input.y", "operator.x"), ("input.y", "network.u"), ("operator.h", "network.f")]
    return device(data, nodes, [*wires, ("network.y", "readout.u")])


def count(p: int, q: int) -> int:
    """Return the number of monomials of p variables up to order q, including the constant, (p + q)! / (p! q!)."""
    return comb(p + q, q)


@functools.lru_cache(maxsize=64)
def _factors(p: int, q: int) -> tuple[Indices, ...]:
    """Return for each degree 1..q the indices of the variables of each monomial, shape (monomials, degree)."""
    return tuple(
        np.array(list(combinations_with_replacement(range(p), d)), np.intp).reshape(-1, d) for d in range(1, q + 1)
    )


def basis(z: Array, q: int) -> Array:
    """Return the regressors h(k), shape (..., count(p, q)), for lagged signals z (..., p) and the order q.

    z = [u(k-1), ..., u(k-n_u), f(k-1), ..., f(k-n_f), y(k-1), ..., y(k-n_y)]. If the smallest lag of u and f is 0, u(k)
    and f(k) are the first elements of their parts of z. The regressors have the order of the block `polynomial_narx`:
    z, all products z_i z_j with i <= j, products of three and more variables, and finally the constant.
    """
    parts = []
    for factors in _factors(z.shape[-1], q):
        product = z[..., factors[:, 0]]
        for column in factors.T[1:]:
            product = product * z[..., column]
        parts.append(product)
    return np.concatenate([*parts, np.ones((*z.shape[:-1], 1))], axis=-1)


def lagged(v: Array, n: int, first: int = 1) -> Array:
    """Return v(k-first), ..., v(k-first-n+1) for every row k, shape (rows, n); v has the value v[0] before row 0."""
    rested = np.concatenate([np.full(n, v[0]), v])
    starts = range(n - first, -first, -1)
    return np.column_stack([rested[i : i + len(v)] for i in starts]) if n else np.empty((len(v), 0))


KINDS = {"polynomial_narx": Row(TEXT, build, OPTIONS, CANDIDATES, Memory(4600.0), covariates=True)}

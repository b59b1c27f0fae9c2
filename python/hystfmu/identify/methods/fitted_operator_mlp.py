"""Network with two inputs: u, and the output of a Prandtl-Ishlinskii model that is fitted to the data.

A sum of plays replaces the operators of Zhao & Tan 2008 and Shen & Ma 2017. The sum of plays differs from them only in
the shape of the branches. Non-negative least squares fits the sum of plays to the data. The network represents the
static nonlinearity.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import plays, thresholds, u0_of, u0_option
from hystfmu.identify.network.readout import Features, fit_readout, network_options
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "fitted weighted plays and a network on (x, their sum)"
MEMORY = Memory(1800.0, "N")
COVARIATES = True
BEND = Option("bend", 5, 1, 20, text="degree of the polynomial of y that the operator is fitted to; 1: y itself")
CANDIDATES = (Candidate(CLOSES, 1.0, 0.05, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("N", 40, 1, 100000, text="number of plays"),
    BEND,
    u0_option("every play rests"),
    *network_options(hidden=12, starts=3, iterations=150),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, prandtl_ishlinskii) -> scaling -> mlp -> scaling``; return graph and number of parameters."""
    u, rows = data.u, data.counted
    u0 = u0_of(data, options)
    r = thresholds(u[data.train], options["N"])
    columns = np.column_stack([u, plays(u, r, u0)])[rows]
    v, free = straightened(u[rows], data.y[rows], options["bend"], data.covariates.values[rows])
    w, _ = nonnegative(columns, v, free)
    progress(0.2)
    nodes = [
        Node("input", "scaling", {"n": 1}),
        Node("operator", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": u0}),
    ]
    front = Features(nodes, [("input.y", "operator.u")], ["input.u"], ["input.y", "operator.y"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, lambda f: progress(0.2 + 0.8 * f))
    return graph, parameters + len(w)


def straightened(x: Array, y: Array, degree: int, covariates: Array) -> tuple[Array, Array]:
    """Return the target and the free columns of a linear fit of an operator that precedes a static nonlinearity.

    The output is nearly y = f(h), where h is the operator and f is a static nonlinearity. If the inverse of f is nearly
    a polynomial, then h = y + q_2 P_2(y) + q_3 P_3(y) + ... This equation is linear in the weights of h and in the
    factors q_i, so one least-squares problem determines both. Without the terms q_i P_i(y), the weights of h would be
    wrong, because h would also have to represent the nonlinearity. With covariates (n, m), the factors q_i are linear
    functions of the covariates.

    The target is y (n,) scaled to [-1, 1]. Its sign is changed if y decreases with the input x (n,). The free columns
    (n, degree + m (degree + 1)) are the Legendre polynomials 1, P_2, ..., P_degree of the target, and the products of
    all Legendre polynomials with each covariate.
    """
    v = (2 * y - y.max() - y.min()) / np.ptp(y)
    v = np.asarray(v * np.copysign(1.0, float(np.dot(x - x.mean(), v))))
    basis = np.polynomial.legendre.legvander(v, degree)
    middle, half = (covariates.max(axis=0) + covariates.min(axis=0)) / 2, np.ptp(covariates, axis=0) / 2
    bilinear = [basis * c[:, None] for c in ((covariates - middle) / half).T]
    return v, np.hstack([np.delete(basis, 1, axis=1), *bilinear])

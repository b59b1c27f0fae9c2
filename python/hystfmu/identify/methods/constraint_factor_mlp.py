"""Shen & Ma 2017: a 2-5-1 network on the expanded input space (x, h); h is the constraint-factor operator of x.

The operator is fitted first, then the network. ``branch = literal`` and ``memory = last`` follow the paper literally.
``sweep`` tries 1, 2, .. hidden neurons. It keeps the number with the least error on the validation split, which is the
last 30 % of the training rows.
"""

from __future__ import annotations

from hystfmu.base.arrays import Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Option, Options
from hystfmu.identify.features.constraint_factor import Branch, increasing_branch, literal_branch, stack_coordinates
from hystfmu.identify.features.plays import branch_option, u0_of, u0_option
from hystfmu.identify.graphs import scaled_input
from hystfmu.identify.methods.fitted_operator_mlp import BEND, straightened
from hystfmu.identify.network.readout import Features, fit_readout, hidden_sweep, network_options

TEXT = "constraint-factor operator and a network on (x, h)"
COVARIATES = True
SHARE = 0.7  # of the training rows: fitted in a sweep; the rest is the validation split

CANDIDATES = (Candidate(CLOSES, 0.3, 0.1, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("m", 9, 1, 20, text="odd powers in the polynomial"),
    Option(
        "branch",
        "increasing",
        choices=("increasing", "literal"),
        text="least squares over increasing branches; literal: the paper's normal equations",
    ),
    branch_option(),
    Option("roughness", 1e-4, 0.0, 1e3, text="penalty on the third derivative of the branch"),
    BEND,
    Option("range", 1.0, 1e-6, 10.0, text="range that the input is scaled to before the operator"),
    Option("sweep", 0, 0, 1000, text="try 1 .. sweep hidden neurons; 0: use `hidden`"),
    u0_option("the operator rests"),
    *network_options(hidden=5, starts=3, iterations=230),
)


def fit_operator(data: Dataset, options: Options) -> tuple[Features, Branch]:
    """Fit ``scaling -> constraint_factor``; the features are the scaled input x and the operator h."""
    u, y, rows = data.u, data.y, data.counted
    u0 = u0_of(data, options)
    scaling, gain, offset = scaled_input(u[data.train], options["range"])
    x, x0 = gain * u + offset, gain * u0 + offset
    where = stack_coordinates(x, x0, options["memory"])
    if options["branch"] == "literal":
        branch = literal_branch(where, y / data.span, rows, options["m"])
    else:
        v, free = straightened(x[rows], y[rows], options["bend"], data.covariates.values[rows])
        branch = increasing_branch(where, v, free, rows, options["m"], options["roughness"])
    values = {"a0": branch.a[0], "a": branch.a[1:], "d_max": branch.d_max, "memory": options["memory"], "x0": x0}
    nodes = [scaling, Node("operator", "constraint_factor", {}, values)]
    ends = ["input.y", "operator.h"]
    return Features(nodes, [("input.y", "operator.x")], ["input.u"], ends, data), branch


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Build ``scaling -> constraint_factor -> scaling -> mlp -> scaling``; return graph and number of parameters."""
    front, branch = fit_operator(data, options)
    chosen, began = dict(options), 0.0
    if options["sweep"]:
        first, end = data.train.start, data.train.stop
        middle = first + round(SHARE * (end - first))
        scores = hidden_sweep(
            front.values,
            data.y,
            slice(first, middle),
            slice(middle, end),
            range(1, options["sweep"] + 1),
            options,
            seed,
            lambda f: progress(0.95 * f),
        )
        chosen["hidden"], began = min(scores, key=lambda n: scores[n]), 0.95
    graph, parameters, _ = fit_readout(front, data, chosen, seed, lambda f: progress(began + (1 - began) * f))
    return graph, parameters + len(branch.a)

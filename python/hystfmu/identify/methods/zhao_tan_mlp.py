"""Network of Zhao & Tan 2008 (2-12-1) with two inputs: x, and the output h of the hysteretic operator of x.

The shape of the branch g(d) = (1 - e^-d) d depends on the scale of x. Therefore the range to which the input is scaled
is a parameter. By default, several ranges are tried, and the range with the smallest training error is used. With an
inverse operator, and data whose input and output are exchanged, this kind gives the inverse model of the paper (section
III).
"""

from __future__ import annotations

from hystfmu.base.arrays import Progress, silent
from hystfmu.base.errors import InputError
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.catalogue import CLOSES, OPENS, Candidate, Option, Options
from hystfmu.identify.features.plays import RANGE, branch_option, u0_of, u0_option
from hystfmu.identify.graphs import scaled_input
from hystfmu.identify.network.readout import Features, fit_readout, network_options

TEXT = "Zhao-Tan operator and a network on (x, h)"
COVARIATES = True
RANGES = (0.5, 1.0, 2.0)  # ranges of x that are tried; g is convex up to d = 2, as loops of this class require
QUICK_ROWS = 500  # number of rows in these trials
OPERATORS = {  # input and output of each block
    "zhao_tan": ("x", "h"),
    "zhao_tan_inverse": ("h", "x"),
    "zhao_tan_inverse_reconstructed": ("h", "x"),
}

QUICK = {"starts": 1, "iterations": 30}
CANDIDATES = (
    Candidate(CLOSES, 2.0, 0.05, quick=QUICK),
    Candidate(OPENS, 2.0, 0.05, {"memory": "last"}, QUICK),
)
OPTIONS = (
    Option("operator", "zhao_tan", choices=tuple(OPERATORS), text="block of the second input of the network"),
    branch_option(),
    RANGE,
    u0_option("the operator rests"),
    *network_options(hidden=12, starts=3, iterations=150),
)


def features(data: Dataset, span: float, memory: str, u0: float, operator: str = "zhao_tan") -> Features:
    """Return the inputs of the network (features): the scaled input, and the output of the operator.

    `operator` is the block type of the operator. The scaled input has a range of width `span`. `memory` is the option
    of the operator, which rests at the input `u0`.
    """
    scaling, gain, offset = scaled_input(data.u[data.train], span)
    if operator == "zhao_tan":
        values: dict[str, Value] = {"memory": memory, "x0": gain * u0 + offset}
    elif memory == "dominant":
        scaling, values = scaling.with_values(offset=-gain * u0), {}  # an inverse operator rests at h = 0
    else:
        raise InputError(
            f"The 'memory' option with the operator {operator!r} must be 'dominant'. Got {memory!r} instead."
        )
    takes, gives = OPERATORS[operator]
    nodes = [scaling, Node("operator", operator, {}, values)]
    return Features(nodes, [("input.y", f"operator.{takes}")], ["input.u"], ["input.y", f"operator.{gives}"], data)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``scaling -> zhao_tan -> scaling -> mlp -> scaling``; return graph and number of weights and biases."""
    u0 = u0_of(data, options)
    span = options["range"]
    if span is None:
        quick, none = {**options, "starts": 1, "iterations": 40}, silent
        trials = []
        for i, trial in enumerate(RANGES):
            part = features(data, trial, options["memory"], u0, options["operator"])
            trials.append((fit_readout(part, data, quick, seed, none, most_rows=QUICK_ROWS)[2], trial))
            progress(0.1 * (i + 1))
        span = min(trials)[1]
    part = features(data, span, options["memory"], u0, options["operator"])
    graph, parameters, _ = fit_readout(part, data, options, seed, lambda f: progress(0.3 + 0.7 * f))
    return graph, parameters

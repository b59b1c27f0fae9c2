"""Network whose inputs are u and the outputs of a bank of plays, which represent the whole return-point memory.

Other kinds use two network inputs: the scaled input x, and the output h of an operator. These two values do not
determine the output, because the one-to-one theorem of Zhao & Tan 2008 has counterexamples. The outputs of a bank of
plays determine the output up to the resolution of the bank. A linear readout represents most of the output. The network
is trained on the remaining part, which is small and has kinks. Therefore the smallest weight decay of this network is
larger than in other kinds.

The initial memory of the plays is estimated. In a record of a device that was driven before the first row, wrong
initial values of the plays would also distort the network.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import plays, thresholds
from hystfmu.identify.methods.fitted_operator_mlp import straightened
from hystfmu.identify.network.readout import Features, fit_readout, network_options
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model.accuracy import rms

TEXT = "bank of plays and a network on them"
MEMORY = Memory(700.0, "N")
RECORDS = True
COVARIATES = True
ESTIMATES_MEMORY = True
ROUNDS, BEND = 3, 9  # rounds of the estimate of the initial memory, and degree of its polynomial of y
CLEARLY = 2.0  # required ratio of the errors with plays at rest and with estimated plays, on rows that depend on them
MOST = 0.02  # error (relative to the span) above which plays do not describe the device, so that they stay at rest
MOST_EVALUATIONS = 30
SIMILAR = 0.02  # weight of differences of neighbouring plays, relative to the range, in the estimate
LEAST_DECAY = 1e-7
CANDIDATES = (Candidate(CLOSES, 2.0, 0.05, quick={"starts": 1, "iterations": 30}),)
OPTIONS = (
    Option("N", 32, 1, 10000, text="number of plays"),
    Option("u0", None, -1e300, 1e300, text="initial memory: every play rests at this input; default: estimated"),
    *network_options(hidden=6, starts=2, iterations=150, least_decay=LEAST_DECAY),
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit ``(u, play_bank) -> scaling -> mlp -> scaling`` and a linear readout; return graph, number of parameters."""
    r = thresholds(data.u[data.train], options["N"])
    z0 = initial(data, r) if options["u0"] is None else options["u0"]
    nodes = [
        Node("input", "scaling", {"n": 1}),
        Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": z0}),
    ]
    front = Features(nodes, [("input.y", "bank.u")], ["input.u"], ["input.y", "bank.z"], data)
    graph, parameters, _ = fit_readout(front, data, options, seed, progress, linear=True, least_decay=LEAST_DECAY)
    return graph, parameters


def initial(data: Dataset, r: Array) -> float | Array:
    """Return the outputs (n,) of plays with half-widths r (n,) at the first row, or the first input if they rest there.

    The output of a play is its initial output z, limited to an interval [low, high]. The ends of this interval are the
    outputs for the smallest and the largest possible z. In turn, non-negative least squares gives the weights of the
    plays before a static nonlinearity (see `straightened`), and bounded least squares gives all z from the rows at
    which low < high. For several records or covariates, the plays are assumed to be at rest.
    """
    first = float(data.u[0])
    if len(data.starts) > 1 or data.covariates:
        return first
    rows, ends = data.counted, (first - r, first + r)
    low, high = (plays(data.u, r, end)[rows] for end in ends)
    some = (low < high).any(axis=1)
    if not some.any():
        return first
    u, none = data.u[rows], np.zeros((len(some), 0))
    # plays of similar widths have similar outputs; this also determines the outputs of plays without weight
    similar = SIMILAR / float(np.ptp(u)) * (np.eye(len(r)) - np.eye(len(r), k=-1))
    z, errors = np.full(len(r), first), []
    for _ in range(ROUNDS):
        v, free = straightened(u, data.y[rows], BEND, none)
        w, q = nonnegative(np.column_stack([u, np.clip(z, low, high)]), v, free)
        target = v - free @ q - w[0] * u

        def left(z: Array) -> Array:
            e = np.clip(z, low, high)[some] @ w[1:] - target[some]  # noqa: B023 - called at once
            return np.concatenate([e, similar @ (z - first)])

        def slopes(z: Array) -> Array:
            return np.vstack([np.where((low < z) & (z < high), w[1:], 0.0)[some], similar])  # noqa: B023

        errors.append(rms(left(z)))
        z = least_squares(left, z, slopes, ends, max_nfev=MOST_EVALUATIONS).x
    whole = rms(np.clip(z, low, high) @ w[1:] - target)
    clear = errors[0] > CLEARLY * rms(left(z)) and whole < 2 * MOST  # the span of the target is 2
    return z if clear else first

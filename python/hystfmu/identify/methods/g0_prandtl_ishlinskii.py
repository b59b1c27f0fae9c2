"""Hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) PI[u] (Yu & Alici 2005, fig. 1).

G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1). Only f_n, zeta and tau are searched. For each trial, the outputs of
the plays are filtered by G0 and delayed, and non-negative least squares gives their weights (variable projection, Golub
& Pereyra 1973).

Trap: wrong thresholds distort every loop, and the fitted dynamics compensate for this error. With 40 equally spaced
thresholds, f_n can be wrong by 5 %. Therefore the dynamics are first searched with N equally spaced thresholds. Then
FINER * N thresholds are fitted with these dynamics. Non-negative least squares gives only a few of them a positive
weight. The dynamics are searched again with these thresholds.

Trap: linear interpolation between the samples of a sine reduces its amplitude by the fraction (omega h)^2/12, and the
fitted dynamics compensate for this, too. For f_n = 400 Hz, zeta = 0.7 and cycles down to 10 ms, 50 samples in the
shortest cycle cause an error of f_n of 1.7 %. Therefore the shortest cycle should have at least 100 samples.

A rate-independent operator commutes with a delay, so the delay can be before or after the hysteresis.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Node
from hystfmu.identify.catalogue import LAGS, Built, Candidate, Memory, Option, Options
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS, Dynamics, search, told, uncertainty
from hystfmu.identify.features.plays import plays, thresholds, u0_of, u0_option
from hystfmu.identify.graphs import device, scaled_input, wired
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "weighted plays, then G0(s) with delay, variable projection"
MEMORY = Memory(5200.0, "N")
MOST_ROWS = 5000  # maximum number of rows of a fit; more rows are thinned evenly after they are filtered
FINER, ROUNDS = 8, 2  # the thresholds are selected from FINER * N equally spaced thresholds, in ROUNDS rounds

CANDIDATES = (Candidate(LAGS, 1.0, 1.0),)
OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays in the first search"),
    Option("w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; an inverse needs more than 0"),
    u0_option("every play rests"),
    *DYNAMICS_OPTIONS,
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the graph ``scaling -> prandtl_ishlinskii -> transfer_function [-> delay] -> scaling``.

    The function returns the graph, the number of its parameters, and further results: f_n (Hz), zeta and the delay (s),
    with a warning for each of these three values that the data do not determine.
    """
    rows, h = data.counted, data.h
    u0 = u0_of(data, options)
    scaling, gain, shift = scaled_input(data.u[data.train])
    x, x0 = gain * data.u + shift, gain * u0 + shift
    stride = -(-len(data.y[rows]) // MOST_ROWS)
    y = data.y[rows][::stride]
    ones = np.ones((len(y), 1))
    hold, least = options["hold"], options["w0_min"] / gain

    def project(g: Dynamics, columns: Array) -> tuple[Array, Array, float]:
        """Return the residuals, the weights of the plays, and the offset, for given dynamics."""
        filtered = g.filter(columns, h, hold)[rows][::stride]
        w, (offset,) = nonnegative(filtered, y - least * filtered[:, 0], ones)
        w[0] += least
        return filtered @ w + offset - y, w, float(offset)

    r = thresholds(x[data.train], options["N"])
    columns = np.column_stack([x, plays(x, r, x0)])
    g = search(lambda g: project(g, columns)[0], data, options, lambda f: progress(0.5 * f))
    for i in range(ROUNDS):
        finer = thresholds(x[data.train], FINER * options["N"])
        columns = np.column_stack([x, plays(x, finer, x0)])
        r = finer[project(g, columns)[1][1:] > 0]
        if not len(r):
            r = finer[-1:]
        columns = np.column_stack([x, plays(x, r, x0)])
        g = search(lambda g: project(g, columns)[0], data, options, silent, g)  # noqa: B023 - called at once
        progress(0.5 + 0.5 * (i + 1) / ROUNDS)
    _, w, offset = project(g, columns)
    spread = uncertainty(lambda g: project(g, columns)[0], g, data, options)
    hysteresis = Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": x0})
    g0, *delays = g.nodes(h, hold)
    late = [node.with_values(y0=float(w.sum() * x0)) for node in delays]
    chain = [scaling, hysteresis, g0, *late, Node("readout", "scaling", {"n": 1}, {"offset": offset})]
    return device(data, chain, wired(chain)), len(r) + 5, told(g, spread, data, options)

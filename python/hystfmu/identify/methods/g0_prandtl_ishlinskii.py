"""Hysteresis followed by linear dynamics with delay: y = c + e^(-s tau) G0(s) PI[u] (Yu & Alici 2005, fig. 1).

G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1). The weights of the plays enter linearly. For every trial of (f_n,
zeta, tau) the plays are filtered by G0 and delayed; they are the columns of a non-negative least-squares problem. Only
three parameters are searched (variable projection, Golub & Pereyra 1973).

Trap: wrong thresholds distort every loop, and the dynamics compensate for this error. With 40 equally spaced thresholds
f_n can be wrong by 5 %. So the first search uses N equally spaced thresholds. Then the method fits FINER N thresholds
and keeps the thresholds with a positive weight (non-negative least squares selects few). With these it searches the
dynamics again.

Trap: ramps between the samples of a sine reduce its amplitude by (omega h)^2/12, and the dynamics compensate for this
reduction, too. With f_n 400 Hz, zeta 0.7 and cycles down to 10 ms, the error of f_n is 1.7 % for 50 samples in the
shortest cycle; use 100 samples.

A rate-independent operator commutes with a delay, so the place of the delay does not matter.
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
MOST_ROWS = 5000  # more rows are thinned evenly, after filtering at the full rate
FINER, ROUNDS = 8, 2  # thresholds are selected from FINER N even ones, in ROUNDS rounds

CANDIDATES = (Candidate(LAGS, 1.0, 1.0),)
OPTIONS = (
    Option("N", 40, 1, 10000, text="number of plays in the first search"),
    Option("w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; an inverse needs more than 0"),
    u0_option("every play rests"),
    *DYNAMICS_OPTIONS,
)


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Build the graph ``scaling -> prandtl_ishlinskii -> transfer_function [-> delay] -> scaling``.

    The result is the graph, the number of its parameters, and f_n (Hz), zeta and delay (s), with a warning for each of
    these three values that the data do not determine.
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
        """Return residuals, weights and offset."""
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

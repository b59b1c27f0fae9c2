"""Sums with weights >= 0: plays, plays before linear dynamics, and Krasnosel'skii-Pokrovskii kernels.

prandtl_ishlinskii        y = c + w0 u + sum_i w_i p_{r_i}[u]  (Krejci & Kuhnen 2001, eq. 5-9)
g0_prandtl_ishlinskii     y = c + e^(-s tau) G0(s) PI[u],  G0(s) = 1 / (s^2/omega_n^2 + 2 zeta s/omega_n + 1)
                          (Yu & Alici 2005, fig. 1)
krasnoselskii_pokrovskii  y = c + sum_i w_i k_i[u]  (Banks, Kurdila & Webb 1997)

Non-negative least squares gives the weights and the offset c. Shen & Ma 2017 fit the first model in 20 hours with a
general optimiser. In the second model, only f_n, zeta and tau are searched. For each trial, the outputs of the plays
are filtered by G0 and delayed, and non-negative least squares gives their weights (variable projection, Golub & Pereyra
1973). A rate-independent operator commutes with a delay, so the delay can be before or after the hysteresis.

Trap: wrong thresholds distort every loop, and the fitted dynamics compensate for this error. With 40 equally spaced
thresholds, f_n can be wrong by 5 %. Therefore the dynamics are first searched with N equally spaced thresholds. Then
FINER * N thresholds are fitted with these dynamics. Non-negative least squares gives only a few of them a positive
weight. The dynamics are searched again with these thresholds.

Trap: linear interpolation between the samples of a sine reduces its amplitude by the fraction (omega h)^2/12, and the
fitted dynamics compensate for this, too. For f_n = 400 Hz, zeta = 0.7 and cycles down to 10 ms, 50 samples in the
shortest cycle cause an error of f_n of 1.7 %. Therefore the shortest cycle should have at least 100 samples.

The output of a kernel k_i lies between two ramps, which start at the inputs p1_i <= p2_i. These inputs lie on a grid of
`levels` points over the range of u. The model has levels (levels + 1) / 2 kernels, that is, 210 kernels for the 20
levels of Zhao & Tan 2008, section V.
"""

from typing import Any

import numpy as np

from hystfmu.base import Array, Mask, Progress, silent
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.catalogue import (
    CLOSES,
    LAGS,
    Built,
    Candidate,
    Memory,
    Option,
    Options,
    Row,
    device,
    scaled_input,
    wired,
)
from hystfmu.identify.estimate.dynamics import DYNAMICS_OPTIONS, Weighted, search, told, uncertainty
from hystfmu.identify.features.plays import thresholds, u0_of, u0_option, with_plays
from hystfmu.identify.solvers.nonnegative import nonnegative

MOST_ROWS = 5000  # maximum number of rows of a fit with dynamics; more rows are thinned evenly after they are filtered
FINER, ROUNDS = 8, 2  # the thresholds are selected from FINER * N equally spaced thresholds, in ROUNDS rounds
CHUNK = 4096  # number of rows of kernels that are processed together


def weighted(columns: Array, y: Array, least: float = 0.0) -> tuple[Array, float]:
    """Return the weights >= 0 of `columns` (n, p) and the offset that best approximate y (n,).

    The weight of the first column is at least `least`.
    """
    w, (offset,) = nonnegative(columns, y - least * columns[:, 0], np.ones((len(columns), 1)))
    w[0] += least
    return w, float(offset)


def prandtl_ishlinskii(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit the graph ``prandtl_ishlinskii -> scaling``; return graph and number of parameters."""
    u0 = u0_of(data, options)
    rows = data.counted
    r = thresholds(data.u[data.train], options["N"])
    columns = data.along(lambda u: with_plays(u, r, u0))[rows]
    progress(0.1)
    w, offset = weighted(columns, data.y[rows], options["w0_min"])
    return sum_of_plays(w[0], r, w[1:], u0, offset, data), len(r) + 2


def sum_of_plays(w0: float, r: Any, w: Any, u0: float, offset: float, data: Dataset) -> Graph:
    """Return the graph of a Prandtl-Ishlinskii model with an offset.

    w0 is the linear weight. r and w are the thresholds and weights of the plays, which rest at the input u0.
    """
    nodes = [
        Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w0, "r": r, "w": w, "u0": u0}),
        Node("readout", "scaling", {"n": 1}, {"offset": offset}),
    ]
    return device(data, nodes, wired(nodes), ["hysteresis.u"], start=u0)


def g0_prandtl_ishlinskii(data: Dataset, options: Options, seed: int, progress: Progress) -> Built:
    """Fit the graph ``scaling -> prandtl_ishlinskii -> transfer_function [-> delay] -> scaling``.

    The function returns the graph, the number of its parameters, and further results: f_n (Hz), zeta and the delay (s),
    with a warning for each of these three values that the data do not determine.
    """
    hold = options["hold"]
    rows = np.arange(len(data.u))[data.counted]
    rows = rows[:: -(-len(rows) // MOST_ROWS)]
    scaling, gain, shift = scaled_input(data.u[data.train])
    x, x0, least = gain * data.u + shift, gain * u0_of(data, options) + shift, options["w0_min"] / gain

    def fit(columns: Array, y: Array) -> tuple[Array, Mask]:
        w, offset = weighted(columns[:, :-1], y, least)
        return np.append(w, offset), np.append(w > 0, True)

    def behind(r: Array) -> Weighted:
        """Return the problem for the thresholds r: the input, the outputs of the plays, and a constant."""
        return Weighted(np.column_stack([with_plays(x, r, x0), np.ones(len(x))]), data, rows, hold, fit)

    plays = behind(thresholds(x[data.train], options["N"]))
    g = search(plays, data, options, lambda f: progress(0.5 * f))
    for i in range(ROUNDS):
        finer = thresholds(x[data.train], FINER * options["N"])
        r = finer[behind(finer).project(g)[1][1:-1] > 0]
        if not len(r):
            r = finer[-1:]
        plays = behind(r)
        g = search(plays, data, options, silent, g)
        progress(0.5 + 0.5 * (i + 1) / ROUNDS)
    weights = plays.project(g)[1]
    w, offset = weights[:-1], weights[-1]
    spread = uncertainty(plays, g, data, options)
    hysteresis = Node("hysteresis", "prandtl_ishlinskii", {}, {"w0": w[0], "r": r, "w": w[1:], "u0": x0})
    g0, *delays = g.nodes(data.h, hold)
    late = [node.with_values(y0=float(w.sum() * x0)) for node in delays]
    chain = [scaling, hysteresis, g0, *late, Node("readout", "scaling", {"n": 1}, {"offset": offset})]
    return device(data, chain, wired(chain)), len(r) + 5, told(g, spread, data, options)


def grid(lo: float, hi: float, levels: int) -> tuple[float, Array, Array]:
    """Return the length a of the ramps, and the inputs p1 <= p2 (n,) at which the two ramps of each kernel start.

    The ramps start at lo, lo + a, ..., hi - a with a = (hi - lo) / levels, so that each kernel saturates within the
    range lo to hi of the input.
    """
    a = (hi - lo) / levels
    i, j = np.tril_indices(levels)
    points = np.asarray(lo + a * np.arange(levels), dtype=np.float64)
    return a, points[j], points[i]


def ridge(x: Array, a: float) -> Array:
    """Return the ramp function of x: -1 for x < 0, 1 for x > a, and linear between 0 and a."""
    return np.asarray(np.clip(2 * (x / a) - 1, -1, 1))


def kernels(u: Array, a: float, p1: Array, p2: Array, k0: Array) -> Array:
    """Return the outputs (rows, n) of all kernels for the input u (rows,), from the initial values k0 (n,)."""
    out, k = np.empty((len(u), len(p1))), k0
    for first in range(0, len(u), CHUNK):  # the ramps of all rows together would need four times the memory
        part = u[first : first + CHUNK, None]
        for row, (low, high) in enumerate(zip(ridge(part - p2, a), ridge(part - p1, a), strict=True), first):
            k = out[row] = np.minimum(np.maximum(k, low), high)
    return out


def krasnoselskii_pokrovskii(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit a graph with one block ``krasnoselskii_pokrovskii``; return graph and number of parameters."""
    u0 = u0_of(data, options)
    rows, levels = data.counted, options["levels"]
    lo, hi = float(data.u[data.train].min()), float(data.u[data.train].max())
    a, p1, p2 = grid(lo, hi, levels)
    k0 = ridge(u0 - (p1 + p2) / 2, a)  # demagnetised state: each kernel is on the ramp midway between its two ramps
    columns = data.along(lambda u: kernels(u, a, p1, p2, k0), data.train.stop)[rows]
    progress(0.2)
    w, offset = weighted(columns, data.y[rows])
    values: dict[str, Value] = {"lo": lo, "hi": hi, "w": w, "offset": offset, "u0": u0}
    node = Node("hysteresis", "krasnoselskii_pokrovskii", {"n": levels}, values)
    return device(data, [node], (), ["hysteresis.u"], "hysteresis.y", u0), len(w) + 1


KINDS = {
    "prandtl_ishlinskii": Row(
        "weighted plays, non-negative least squares; exact inverse",
        prandtl_ishlinskii,
        (
            Option("N", 40, 1, 100000, text="number of plays"),
            Option(
                "w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; above 0 a continuous inverse exists"
            ),
            u0_option("every play rests"),
        ),
        (Candidate(CLOSES, 0.02, 0.01), Candidate(CLOSES, 0.05, 0.06, {"N": 200})),
        Memory(800.0, "N"),
        records=True,
    ),
    "g0_prandtl_ishlinskii": Row(
        "weighted plays, then G0(s) with delay, variable projection",
        g0_prandtl_ishlinskii,
        (
            Option("N", 40, 1, 10000, text="number of plays in the first search"),
            Option("w0_min", 0.0, 0.0, 1e300, text="least weight of the linear term; an inverse needs more than 0"),
            u0_option("every play rests"),
            *DYNAMICS_OPTIONS,
        ),
        (Candidate(LAGS, 0.6, 0.1),),
        Memory(5200.0, "N"),
    ),
    "krasnoselskii_pokrovskii": Row(
        "Krasnosel'skii-Pokrovskii kernels, weights >= 0",
        krasnoselskii_pokrovskii,
        (
            Option("levels", 20, 1, 200, text="number of grid points; the model has levels (levels + 1) / 2 kernels"),
            u0_option("demagnetised"),
        ),
        (Candidate(CLOSES, 0.02, 0.03, local=True),),
        Memory(2200.0, "levels", 2),
        records=True,
    ),
}

"""Krasnosel'skii-Pokrovskii model: y = c + sum_i w_i k_i[u] with weights w_i >= 0.

The output of kernel k_i lies between two ramps, which start at the inputs p1_i <= p2_i. These inputs lie on a grid of
`levels` points over the range of u. The model has levels (levels + 1) / 2 kernels, that is, 210 kernels for the 20
levels of Zhao & Tan 2008, section V. One non-negative least-squares problem gives the weights. Source: Banks, Kurdila &
Webb 1997.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array, Progress
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Node
from hystfmu.identify.catalogue import CLOSES, Candidate, Memory, Option, Options
from hystfmu.identify.features.plays import u0_of, u0_option
from hystfmu.identify.graphs import device
from hystfmu.identify.solvers.nonnegative import nonnegative

TEXT = "Krasnosel'skii-Pokrovskii kernels, weights >= 0"
MEMORY = Memory(2200.0, "levels", 2)
RECORDS = True
CANDIDATES = (Candidate(CLOSES, 0.02, 0.03, local=True),)
OPTIONS = (
    Option("levels", 20, 1, 200, text="number of grid points; the model has levels (levels + 1) / 2 kernels"),
    u0_option("demagnetised"),
)
CHUNK = 4096  # number of rows that are processed together


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


def build(data: Dataset, options: Options, seed: int, progress: Progress) -> tuple[Graph, int]:
    """Fit a graph with one block ``krasnoselskii_pokrovskii``; return graph and number of parameters."""
    u0 = u0_of(data, options)
    rows = data.counted
    u = data.u[data.train]
    lo, hi = float(u.min()), float(u.max())
    a, p1, p2 = grid(lo, hi, options["levels"])
    k0 = ridge(u0 - (p1 + p2) / 2, a)  # demagnetised state: each kernel is on the ramp midway between its two ramps
    columns = data.along(lambda u: kernels(u, a, p1, p2, k0), data.train.stop)[rows]
    progress(0.2)
    w, (offset,) = nonnegative(columns, data.y[rows], np.ones((len(columns), 1)))
    values = {"lo": lo, "hi": hi, "w": w, "offset": offset, "u0": u0}
    node = Node("hysteresis", "krasnoselskii_pokrovskii", {"n": options["levels"]}, values)
    return device(data, [node], (), ["hysteresis.u"], "hysteresis.y", u0), len(w) + 1

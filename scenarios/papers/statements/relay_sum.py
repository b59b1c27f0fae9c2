"""Preisach's sum of relays in a plain loop, compared with the block in Everett's form and with increments from an
extremum.

The equations are eq. 1 of the IPMC paper and of Yu & Alici 2005, and eq. 2 of the IPMC paper (increment of the output
after an extremum u_p).
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Node, Value
from papers.row import Row

STEPS, SEED = 10, 0  # number of intervals of the grid over [-1, 1], which contains the inputs; seed of the density
ROUNDING = 1e-12


def density() -> Array:
    """Return the weights of the relays, one for each cell alpha > beta of the grid and 0 below, (STEPS, STEPS).

    The weights are whole numbers, so that their sums are exact.
    """
    return np.asarray(np.tril(np.random.default_rng(SEED).integers(1, 10, (STEPS, STEPS)).astype(float)))


def relay_sum(u: Array, mu: Array) -> Array:
    """Return the sum (n,) over relays that switch up at alpha_i and down at beta_j, and that are down at first."""
    edges = np.linspace(-1, 1, STEPS + 1)
    alpha = (edges[1:, None] + edges[:-1, None]) / 2 + 1e-9  # the offset makes alpha > beta for cells on the diagonal
    beta = alpha.T - 2e-9
    state, out = -np.ones_like(mu), np.empty(len(u))
    for k, v in enumerate(u):
        state = np.where(v >= alpha, 1.0, np.where(v <= beta, -1.0, state))
        out[k] = np.sum(mu * state)
    return out


def everett(mu: Array) -> Array:
    """Return the Everett integral of the density for each (alpha_i, beta_j), in the form of the block."""
    cells = [mu[j:i, j:i].sum() for i in range(1, STEPS + 1) for j in range(i)]
    return np.array(cells)


def block_row() -> Row:
    """Return a row that compares the block and the relays on random grid levels."""
    mu = density()
    levels: Array = np.random.default_rng(SEED).integers(0, STEPS + 1, 400) * np.float64(2 / STEPS) - 1
    values: dict[str, Value] = {"lo": -1.0, "hi": 1.0, "E": everett(mu), "start": "low"}
    y = Graph.single(Node("relays", "preisach", {"n": STEPS}, values)).run(levels)
    worst = float(np.abs(y - relay_sum(levels, mu)).max() / mu.sum())
    what = f"block preisach against {STEPS * (STEPS + 1) // 2} relays in a plain loop, of span"
    return Row(what, None, None, worst / 2, ROUNDING, note="on the grid of the relays", place="eq. 1")


def increment_row() -> Row:
    """Return a row that compares increments from an extremum u_p, for two histories and for another u_p."""
    mu, step = density(), 2 / STEPS
    rises = [[0, -1, 1, -0.4, 0.4], [0, 1, -0.8, 0.8, -0.4, 0.4], [0, -1, 1, -0.8, 0.0]]
    u = [signals.ramps(list(r), step) for r in rises]
    rows = round(0.8 / step) + 1
    gained = [(y := relay_sum(v, mu)[-rows:]) - y[0] for v in u]
    other, same = (50 * float(np.abs(gained[0] - g).max()) / mu.sum() for g in (gained[2], gained[1]))
    return Row(
        "difference of increments from an extremum, % of span",
        0.0,
        other,
        same,
        note="ours: the same extremum u_p, another history; literal: another u_p, the increment a function of u - u_p",
        place="eq. 2",
        sense="equal",
    )

"""Preisach's sum of relays, computed relay by relay, and compared with the block `preisach`.

The block uses Everett integrals. The sum is eq. 1 of the IPMC paper and of Yu & Alici 2005. Eq. 2 of the IPMC paper,
the increment of the output after an extremum u_p, is also tested.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Node, Value
from papers.table import Row, Stated

ROW = Stated(__name__)

STEPS, SEED = 10, 0  # number of intervals of the grid over [-1, 1], which contains the inputs; seed of the density
ROUNDING = 1e-12


def density() -> Array:
    """Return random weights of the relays, shape (STEPS, STEPS).

    The grid has one weight for each cell with alpha > beta. The other entries are 0. The weights are integers, so that
    their sums are exact.
    """
    return np.asarray(np.tril(np.random.default_rng(SEED).integers(1, 10, (STEPS, STEPS)).astype(float)))


def relay_sum(u: Array, mu: Array) -> Array:
    """Return the output (n,) of the relays with weights mu for an input u (n,).

    Relay (i, j) switches up at alpha_i and down at beta_j. All relays are down at first.
    """
    edges = np.linspace(-1, 1, STEPS + 1)
    alpha = (edges[1:, None] + edges[:-1, None]) / 2 + 1e-9  # the offset makes alpha > beta for cells on the diagonal
    beta = alpha.T - 2e-9
    state, out = -np.ones_like(mu), np.empty(len(u))
    for k, v in enumerate(u):
        state = np.where(v >= alpha, 1.0, np.where(v <= beta, -1.0, state))
        out[k] = np.sum(mu * state)
    return out


def everett(mu: Array) -> Array:
    """Return the Everett integrals of the weights mu for all (alpha_i, beta_j), in the order that the block expects."""
    cells = [mu[j:i, j:i].sum() for i in range(1, STEPS + 1) for j in range(i)]
    return np.array(cells)


def block_row() -> Row:
    """Return a table row with the largest difference between the block and the sum of relays.

    The input consists of random levels of the grid.
    """
    mu = density()
    levels: Array = np.random.default_rng(SEED).integers(0, STEPS + 1, 400) * np.float64(2 / STEPS) - 1
    values: dict[str, Value] = {"lo": -1.0, "hi": 1.0, "E": everett(mu), "start": "low"}
    y = Graph.single(Node("relays", "preisach", {"n": STEPS}, values)).run(levels)
    worst = float(np.abs(y - relay_sum(levels, mu)).max() / mu.sum())
    what = f"block preisach against {STEPS * (STEPS + 1) // 2} relays in a plain loop, of span"
    return Row(what, None, None, worst / 2, ROUNDING, note="on the grid of the relays", place="eq. 1")


def increment_row() -> Row:
    """Return a table row with the differences of output increments after an extremum u_p.

    Two histories with the same u_p are compared, and one history with another u_p.
    """
    mu, step = density(), 2 / STEPS
    rises = [[0, -1, 1, -0.4, 0.4], [0, 1, -0.8, 0.8, -0.4, 0.4], [0, -1, 1, -0.8, 0.0]]
    u = [signals.ramps(list(r), step) for r in rises]
    rows = round(0.8 / step) + 1
    gained = [(y := relay_sum(v, mu)[-rows:]) - y[0] for v in u]
    other, same = (50 * float(np.abs(gained[0] - g).max()) / mu.sum() for g in (gained[2], gained[1]))
    return ROW("increments", other, same)

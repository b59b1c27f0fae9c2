"""Preisach model whose density depends on the rate of the input (eqs. 2 and 3 of Yu & Alici 2005).

The model is y = c + sum over the cells of (mu_0 + mu_1 du/dt) relay[u]: the density is expanded to first order in du/dt
(Mayergoyz 1991, ch. 2). The parameters c, mu_0 and mu_1 are linear. If the data contain no information about a cell, a
ridge penalty makes its density almost 0. The strength of this penalty is chosen on the last part of the training rows.
The relays switch as in the classical Preisach model.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset, signals
from hystfmu.graph import Graph, Node
from hystfmu.identify import errors
from hystfmu.identify.features.smooth_density import triangles
from hystfmu.report.plot import Line, Plot
from papers.row import Row

STEPS = 12  # number of intervals of the grid over the range of u, that is, 78 cells
THIN = 5  # every fifth row is used for training
RIDGES = (1e-4, 1e-3, 1e-2, 1e-1)  # candidates of the ridge, relative to the norm of a column
INNER = 2 / 3  # fraction of the training rows that is fitted when the ridge is chosen on the other rows
REACH = 1.02  # range of the grid over the trained range
ALPHA, BETA = 0.3, -0.2  # thresholds of the relay in the diagram

Response = Callable[[Array], Array]


def relays(u: Array, n: int, most: float) -> Array:
    """Return the outputs of the relays of all cells in the Preisach plane, shape (rows, n (n + 1) / 2).

    `u` is the input, shape (rows,). The plane is divided by a grid with n intervals over [-most, most].
    """
    cells = triangles(n)
    out = np.empty((len(u), cells.shape[1]), order="F")
    for c, E in enumerate(cells.T):
        out[:, c] = Graph.single(Node("relays", "preisach", {"n": n}, {"lo": -most, "hi": most, "E": E})).run(u)
    return out


def preisach(record: Dataset, dynamic: bool) -> Response:
    """Fit the model of eq. 2 to a record, and return a function that computes its response to an input.

    If `dynamic` is True, the model is that of eq. 3, whose density depends on the rate of the input.
    """
    most = REACH * float(np.abs(record.u).max())

    def regressors(u: Array) -> Array:
        cells = relays(u, STEPS, most)
        parts = [np.ones((len(u), 1)), cells]
        return np.hstack([*parts, cells * np.gradient(u, record.h)[:, None]] if dynamic else parts)

    A, y = regressors(record.u)[::THIN], record.y[::THIN]
    scale = np.maximum(np.linalg.norm(A, axis=0), 1e-12)
    n, inner = A.shape[1], round(INNER * len(y))

    def weights(ridge: float, end: int) -> Array:
        B = np.vstack([A[:end] / scale, ridge * np.eye(n)])
        return np.asarray(np.linalg.lstsq(B, np.concatenate([y[:end], np.zeros(n)]), rcond=None)[0] / scale)

    ridge = min(RIDGES, key=lambda r: float(np.linalg.norm(A[inner:] @ weights(r, inner) - y[inner:])))
    w = weights(ridge, len(y))
    return lambda u: np.asarray(regressors(u) @ w)


def rows(record: Dataset, plant: Response, ours: tuple[float, float]) -> list[Row]:
    """Return table rows with the errors of the models of eqs. 2 and 3 on the training record and on held-out signals.

    Parameters
    ----------
    record : Dataset
        Training data.
    plant : function
        Function that returns the true output (n,) for an input (n,).
    ours : tuple of float
        RMS error of our model on the training signal, and its largest RMS error on the held-out signals (%FS).
    """
    tests = {name: (u, plant(u)) for name, u in signals.held_out().items()}
    cells = STEPS * (STEPS + 1) // 2
    found = []
    for place, dynamic, name in (("eq. 2", False, "Preisach sum"), ("eq. 3", True, "dynamic Preisach sum")):
        model = preisach(record, dynamic)
        trained = errors(model(record.u), record.y, record.span)["rms_percent"]
        worst = max(errors(model(u), y, record.span)["rms_percent"] for u, y in tests.values())
        note = f"{(1 + dynamic) * cells + 1} weights; ours: plays, then G0(s)"
        found += [
            Row(f"{name}: RMS, %FS, {what}", None, e, best, note=note, place=place)
            for what, e, best in (("training signal", trained, ours[0]), ("held out, worst", worst, ours[1]))
        ]
    return found


def drawings() -> tuple[Plot, ...]:
    """Return diagrams like figs. 4 (output of a relay) and 5 (Preisach plane after a decaying input) of the paper."""
    u = signals.decaying_sine(3, 0.3, 200)
    relay, state = np.empty(len(u)), -1.0
    for k, v in enumerate(u):
        state = 1.0 if v >= ALPHA else -1.0 if v <= BETA else state
        relay[k] = state
    turns = u[np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1]
    alpha, beta = np.repeat(turns[::2], 2)[1:], np.repeat(turns[1::2], 2)[:-1]
    line = np.array([-1.0, 1.0])
    return (
        Plot("fig. 4: elementary operator", "u", "relay", [Line("relay", u, relay)]),
        Plot(
            "fig. 5: Preisach plane after a decaying input",
            "beta",
            "alpha",
            [Line("alpha = beta", line, line), Line("memory", np.append(-1.0, beta), np.append(alpha[0], alpha))],
        ),
    )

"""Two models of a static Bouc-Wen operator, which is not a sum of plays: plays, and the kind that `auto` chooses.

The operator is y = c + a u + b z with dz/du = A - (beta sgn(du z) + gamma) |z|^n (Wen 1976). It is integrated along
every ramp of the input by scipy's RK45. The core uses another integration method.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset, signals
from hystfmu.identify import fit
from hystfmu.model import accuracy
from papers.row import Row

A, BETA, GAMMA, N = 1.3, 1.1, 0.6, 1.4
OFFSET, LINEAR, WEIGHT = 0.2, 0.35, 0.9
REVERSALS = 60


def response(u: Array) -> Array:
    """Return the output (n,) of the operator for an input u (n,), from z = 0."""
    from scipy.integrate import solve_ivp

    turns = [0, *(np.flatnonzero(np.diff(np.sign(np.diff(u))) != 0) + 1).tolist(), len(u) - 1]
    z = np.zeros(len(u))
    for i, j in pairwise(turns):
        s = np.sign(u[j] - u[i])

        def slope(x: float, z: Array, s: float = s) -> Array:
            return np.asarray(s * (A - (BETA * np.sign(s * z) + GAMMA) * np.abs(z) ** N))

        path = np.abs(u[i : j + 1] - u[i])
        z[i : j + 1] = solve_ivp(slope, (0, path[-1]), [z[i]], t_eval=path, rtol=1e-9, atol=1e-11).y[0]
    return OFFSET + LINEAR * u + WEIGHT * z


def rows() -> list[Row]:
    """Return a table row with the largest held-out RMS errors of a sum of plays and of the kind that `auto` chooses."""
    u = signals.training(REVERSALS, 1)
    data = Dataset.from_signal(u, response(u))
    plays, chosen = fit(data, "prandtl_ishlinskii"), fit(data, "auto")
    of = [
        max(e["rms_percent"] for e in accuracy.held_out_table(m, response, data.span).values()) for m in (plays, chosen)
    ]
    note = f"literal: plays of any number; ours: --model auto chose {chosen.key}, memory {chosen.fit['memory']}"
    return [Row("static Bouc-Wen operator, worst held-out RMS, % of span", None, of[0], of[1], 0.03, note=note)]

"""Numerical tests of eqs. 1 to 7 of Shen & Ma 2017: the operator and the printed normal equations."""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import signals
from hystfmu.graph import Graph, Node, Value
from hystfmu.identify.methods.constraint_factor_mlp import basis, stack_coordinates
from papers.statements.printed import from_last_extremum
from papers.table import Row, Stated

ROW = Stated(__name__)

A0, A = 0.2, (1.0, -0.3)  # coefficients of the operator that is compared with the block
M = 3  # order at which eq. 7 is solved; order 9 of the paper is too ill-conditioned to show one wrong entry
ROUNDING = 1e-12


def rows(u: Array, y: Array, trained: slice) -> list[Row]:
    """Return the table rows of the tests of eqs. 1 to 7.

    u and y (n,) are a record. The branch is fitted to its rows `trained`.
    """
    return [_main(), _normal_equations(u, y, trained)]


def _main() -> Row:
    """Return a table row with the largest difference between the block `constraint_factor` and eqs. 1 and 2.

    The branches start at the last extremum, as in the paper.
    """
    u = signals.nested_reversals(40, 1)

    def branch(d: float) -> float:
        x = abs(float(d))
        polynomial = A0 + sum(a * x ** (2 * j - 1) for j, a in enumerate(A, 1))
        return float(np.sign(d) * (1 - np.exp(-x)) * polynomial)

    h = from_last_extremum(u, branch)
    values: dict[str, Value] = {"a0": A0, "a": A, "memory": "last", "x0": float(u[0])}
    block = Graph.single(Node("operator", "constraint_factor", {"m": len(A)}, values)).run(u)
    what = "block constraint_factor against eqs. 1 and 2 in a plain loop, largest difference"
    return Row(what, None, None, float(np.abs(block - h).max()), ROUNDING, note="last extremum", place="eqs. 1-2")


def _normal_equations(u: Array, y: Array, trained: slice) -> Row:
    """Return a table row with the fit residuals of the branch, for the printed and for the corrected normal equations.

    The two versions differ in the last entry of eq. 7. The branch is fitted to the rows `trained` of u and y (n,).
    """
    where = stack_coordinates(u, float(u[0]), "last")
    rows = np.flatnonzero(where.start[trained] >= 0)
    v = np.sign(where.weight[rows]) * (y[rows] - y[where.start[rows]])
    B = basis(where.d[rows], M)
    X = B.T @ B
    wrong = X.copy()
    wrong[M, M] = float(np.sum((1 - np.exp(-where.d[rows])) ** 2 * where.d[rows] ** (2 * (M - 1))))
    of = [float(np.sqrt(np.mean((B @ np.linalg.solve(left, B.T @ v) - v) ** 2))) for left in (wrong, X)]
    best = float(np.sqrt(np.mean((B @ np.linalg.lstsq(B, v, rcond=None)[0] - v) ** 2)))
    return ROW("normal_equations", of[0] / best, of[1] / best, target=1 + 1e-06)

"""First-order and total effects of the parameters on the metrics, from the existing runs of a study.

A polynomial chaos expansion is fitted to the runs by least squares. Its terms are products of polynomials that are
orthonormal under the distribution of each parameter. The squares of its coefficients are shares of the variance. The
first-order Sobol index of a parameter is the sum over the terms with this parameter alone. The total index is the sum
over all terms with this parameter (Sudret 2008, Reliability Engineering & System Safety 93, 964-979). The expansion has
the degree with the smallest leave-one-out error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array

MOST_DEGREE = 12
RUNS_PER_TERM = 2  # at least
MOST_TERMS = 300
MOST_LEVELS = 64  # of a parameter that is drawn from a list
EXACT = 0.9999  # of the variance: a higher degree adds nothing


@dataclass(frozen=True)
class Effects:
    """Sobol indices of p parameters on m metrics.

    Attributes
    ----------
    first, total : array, shape (p, m)
        Share of the variance that a parameter explains alone (`first`), and with all its interactions (`total`); 0 to
        1.
    explained : array, shape (m,)
        Share of the variance that the expansion predicts for a run outside the fit. Below about 0.9 the indices are
        rough.
    """

    first: Array
    total: Array
    explained: Array


def effects(x: Array, y: Array) -> Effects:
    """Estimate the Sobol indices of independent parameters.

    Parameters
    ----------
    x : array, shape (n, p)
        Drawn values: uniform in [0, 1], or at most 64 equally likely values.
    y : array, shape (n, m)
        Metrics.
    """
    n, p = x.shape
    spread = np.ptp(x, axis=0) > 0
    variance = y.var(axis=0)
    moved = variance > 0
    best = Effects(np.zeros((p, y.shape[1])), np.zeros((p, y.shape[1])), np.zeros(y.shape[1]))
    bases = [_orthonormal(column) for column in x.T]
    for degree in range(1, MOST_DEGREE + 1):
        if not np.any(best.explained[moved] < EXACT):
            break
        width = math.comb(int(spread.sum()) + degree, degree)
        if RUNS_PER_TERM * width > n or width > MOST_TERMS:
            break
        powers = _powers([b.shape[1] - 1 for b in bases], degree)
        A = np.prod([b[:, k] for b, k in zip(bases, powers.T, strict=True)], axis=0)
        Q, R = np.linalg.qr(A)
        along = Q.T @ y
        left_out = (y - Q @ along) / np.maximum(1 - (Q**2).sum(axis=1), 1e-9)[:, None]
        explained = 1 - np.divide((left_out**2).mean(axis=0), variance, out=np.ones_like(variance), where=moved)
        squares = np.linalg.lstsq(R, along, rcond=1e-10)[0] ** 2
        total = squares[1:].sum(axis=0)
        share = np.divide(squares, total, out=np.zeros_like(squares), where=moved & (total > 0))
        better = moved & (explained > best.explained)
        best.explained[better] = explained[better]
        for k in range(p):
            has, others = powers[:, k] > 0, np.delete(powers, k, axis=1).any(axis=1)
            best.total[k, better] = share[has][:, better].sum(axis=0)
            best.first[k, better] = share[has & ~others][:, better].sum(axis=0)
    return best


def _orthonormal(column: Array) -> Array:
    """Return the orthonormal polynomials of degree 0, 1, ... at the values, shape (n, degrees + 1)."""
    levels = np.unique(column)
    if len(levels) > MOST_LEVELS:
        scale = np.sqrt(2 * np.arange(MOST_DEGREE + 1) + 1)
        return np.asarray(np.polynomial.legendre.legvander(2 * column - 1, MOST_DEGREE) * scale)
    Q, _ = np.linalg.qr(np.polynomial.legendre.legvander(2 * levels - 1, MOST_DEGREE))  # as many as there are levels
    return np.asarray(np.sqrt(len(levels)) * Q[np.searchsorted(levels, column)])


def _powers(most: list[int], degree: int) -> Array:
    """Return the degree of each term in each parameter, shape (terms, p).

    The total degree is at most `degree`. All degrees of the first term are 0.
    """
    rows: list[tuple[int, ...]] = [()]
    for m in most:
        rows = [(*r, k) for r in rows for k in range(min(m, degree - sum(r)) + 1)]
    return np.array(rows)

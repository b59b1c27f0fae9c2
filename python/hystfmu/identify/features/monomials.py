"""Basis of a polynomial NFIR or NARX model: all monomials up to order q of the lagged signals.

The order is that of the block `polynomial_narx`: z = [u(k-1), ..., u(k-n_u), f(k-1), ..., f(k-n_f), y(k-1), ...,
y(k-n_y)], then all products z_i z_j with i <= j, then of three, ..., finally the constant (IPMC paper, eqs. 8 to 11).
u and f may start at u(k), f(k) instead.
"""

from __future__ import annotations

import functools
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array


def count(p: int, q: int) -> int:
    """Return the number of monomials of p variables up to order q with the constant, (p + q)! / (p! q!)."""
    return comb(p + q, q)


@functools.lru_cache(maxsize=64)
def _factors(p: int, q: int) -> tuple[NDArray[np.intp], ...]:
    """Return, per degree 1..q, the variables of each monomial; shape (monomials of that degree, degree)."""
    return tuple(
        np.array(list(combinations_with_replacement(range(p), d)), np.intp).reshape(-1, d) for d in range(1, q + 1)
    )


def basis(z: Array, q: int) -> Array:
    """Compute the regressor h(k) of eq. 11, (..., count(p, q)), of lagged signals z (..., p) up to order q."""
    parts = []
    for factors in _factors(z.shape[-1], q):
        product = z[..., factors[:, 0]]
        for column in factors.T[1:]:
            product = product * z[..., column]
        parts.append(product)
    return np.concatenate([*parts, np.ones((*z.shape[:-1], 1))], axis=-1)


def lagged(v: Array, n: int, first: int = 1) -> Array:
    """Return v(k-first), ..., v(k-first-n+1) for every row k, shape (rows, n); v rests at v[0] before row 0."""
    rested = np.concatenate([np.full(n, v[0]), v])
    starts = range(n - first, -first, -1)
    return np.column_stack([rested[i : i + len(v)] for i in starts]) if n else np.empty((len(v), 0))

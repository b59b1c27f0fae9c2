"""Linear fit of an operator before a static nonlinearity, and the initial memory of plays that it shows.

If a device was driven before the first row, its plays do not rest at the first input. Wrong initial outputs cause
errors until a full swing wipes them out, and these errors distort the weights of a model.
"""

import numpy as np
from scipy.optimize import least_squares

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.identify.features.plays import plays
from hystfmu.identify.solvers.nonnegative import nonnegative
from hystfmu.model import rms

ROUNDS, BEND = 3, 9  # rounds of the estimate of the initial memory, and degree of its polynomial of y
CLEARLY = 2.0  # required ratio of the errors with plays at rest and with estimated plays, on rows that depend on them
MOST = 0.02  # error (relative to the span) above which plays do not describe the device, so that they stay at rest
MOST_EVALUATIONS = 30
SIMILAR = 0.02  # weight of differences of neighbouring plays, relative to the range, in the estimate


def straightened(x: Array, y: Array, degree: int, covariates: Array) -> tuple[Array, Array]:
    """Return the target and the free columns of a linear fit of an operator that precedes a static nonlinearity.

    The output is nearly y = f(h), where h is the operator and f is a static nonlinearity. If the inverse of f is nearly
    a polynomial, then h = y + q_2 P_2(y) + q_3 P_3(y) + ... This equation is linear in the weights of h and in the
    factors q_i, so one least-squares problem determines both. Without the terms q_i P_i(y), the weights of h would be
    wrong, because h would also have to represent the nonlinearity. With covariates (n, m), the factors q_i are linear
    functions of the covariates.

    The target is y (n,) scaled to [-1, 1]. Its sign is changed if y decreases with the input x (n,). The free columns
    (n, degree + m (degree + 1)) are the Legendre polynomials 1, P_2, ..., P_degree of the target, and the products of
    all Legendre polynomials with each covariate.
    """
    v = (2 * y - y.max() - y.min()) / np.ptp(y)
    v = np.asarray(v * np.copysign(1.0, float(np.dot(x - x.mean(), v))))
    basis = np.polynomial.legendre.legvander(v, degree)
    middle, half = (covariates.max(axis=0) + covariates.min(axis=0)) / 2, np.ptp(covariates, axis=0) / 2
    bilinear = [basis * c[:, None] for c in ((covariates - middle) / half).T]
    return v, np.hstack([np.delete(basis, 1, axis=1), *bilinear])


def initial(data: Dataset, r: Array) -> float | Array:
    """Return the outputs (n,) of plays with half-widths r (n,) at the first row, or the first input if they rest there.

    The output of a play is its initial output z, limited to an interval [low, high]. The ends of this interval are the
    outputs for the smallest and the largest possible z. In turn, non-negative least squares gives the weights of the
    plays before a static nonlinearity (see `straightened`), and bounded least squares gives all z from the rows at
    which low < high. For several records or covariates, the plays are assumed to be at rest.
    """
    first = float(data.u[0])
    if len(data.starts) > 1 or data.covariates:
        return first
    rows, ends = data.counted, (first - r, first + r)
    low, high = (plays(data.u, r, end)[rows] for end in ends)
    some = (low < high).any(axis=1)
    if not some.any():
        return first
    u = data.u[rows]
    none = np.zeros((len(u), 0))
    # plays of similar widths have similar outputs; this also determines the outputs of plays without weight
    similar = SIMILAR / float(np.ptp(u)) * (np.eye(len(r)) - np.eye(len(r), k=-1))
    z, errors = np.full(len(r), first), []
    for _ in range(ROUNDS):
        v, free = straightened(u, data.y[rows], BEND, none)
        w, q = nonnegative(np.column_stack([u, np.clip(z, low, high)]), v, free)
        target = v - free @ q - w[0] * u

        def left(z: Array) -> Array:
            e = np.clip(z, low, high)[some] @ w[1:] - target[some]  # noqa: B023 - called at once
            return np.concatenate([e, similar @ (z - first)])

        def slopes(z: Array) -> Array:
            return np.vstack([np.where((low < z) & (z < high), w[1:], 0.0)[some], similar])  # noqa: B023

        errors.append(rms(left(z)))
        z = least_squares(left, z, slopes, ends, max_nfev=MOST_EVALUATIONS).x
    whole = rms(np.clip(z, low, high) @ w[1:] - target)
    clear = errors[0] > CLEARLY * rms(left(z)) and whole < 2 * MOST  # the span of the target is 2
    return z if clear else first

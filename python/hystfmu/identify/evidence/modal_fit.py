"""Fit of modes and a delay to records, by weighted least squares over the bins of their Fourier transforms.

The output is a sum of columns with linear weights. The columns depend on the frequencies and damping ratios of the
modes and on the delay, which are searched. The linear weights are computed for each trial (variable projection: Golub &
Pereyra 1973, SIAM J. Numer. Anal. 10(2) 413-432, in the form of Kaufman 1975).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hystfmu.base import Array, Mask
from hystfmu.identify.evidence.problem import Problem, Seen, Structure
from hystfmu.identify.solvers.trust_region import Differences, refined

SCALE, STEP = 0.1, 1e-4  # scale of all parameters; finite differences, relative to it
EVALUATIONS, TOLERANCE = 15, 3e-6  # maximum number of evaluations of errors and Jacobian; change that ends a search
CLUSTERS = 60  # number of clusters of neighbouring bins, whose errors can be correlated
LEAST_ZETA, MOST_ZETA = 1e-3, 3.0
DEPENDENT = 1e-9  # a normalised column with a smaller component orthogonal to the previous columns is omitted
MOST_DELAY = 10.0  # upper bound of the delay (steps)
KNOWN_F, KNOWN_ZETA, KNOWN_SHARE = 0.1, 0.5, 1 / 5  # largest relative standard errors of a mode that counts as known
HIGHEST = 0.35  # largest frequency of a known mode, relative to the sampling rate


@dataclass(frozen=True)
class Fitted:
    """Result of the fit of modes and a delay.

    ``p`` contains ln f_n and ln zeta of each mode, and the delay in steps. ``weights`` contains the weights of the
    modes, of the rest column, which is the delayed input, and of the free decays. ``error`` is the weighted sum of
    squares over ``count`` real and imaginary parts. ``covariance`` is the covariance matrix of p and gain, in this
    order. If the fit has no rest column, ``rest_se`` is the standard error that the weight of this column would have.
    """

    structure: Structure
    p: Array
    weights: Array
    error: float
    count: int
    covariance: Array
    rest_se: float = 0.0

    @property
    def gain(self) -> Array:
        """Weights of the modes and of the rest column."""
        return self.weights[: self.structure.modes + self.structure.rest]

    @property
    def misfit(self) -> float:
        """Mean square of the weighted errors per degree of freedom. It is 1 if the errors are only noise."""
        return self.error / max(self.count - len(self.p) - len(self.weights), 1)

    def left(self, problem: Problem) -> Array:
        """Return the measured output (n,) minus modes, rest column and free decays; slow parts are not subtracted."""
        return np.asarray(problem.seen.y - problem.columns(self.structure, self.p) @ self.weights)

    def known(self, seen: Seen) -> Mask:
        """Return for each mode whether the record determines it.

        The criteria are the standard errors, the bounds of the search, and the coherence near the mode.
        """
        r = seen.response
        sd = np.sqrt(np.diag(self.covariance))
        known = np.zeros(self.structure.modes, dtype=bool)
        for k in range(self.structure.modes):
            f_n, zeta = np.exp(self.p[2 * k : 2 * k + 2])
            near = (r.f > f_n / 2 ** (1 / 3)) & (r.f < f_n * 2 ** (1 / 6))
            known[k] = (
                sd[2 * k] < KNOWN_F
                and sd[2 * k + 1] < KNOWN_ZETA
                and f_n < HIGHEST / seen.h
                and LEAST_ZETA * 1.05 < zeta < MOST_ZETA / 1.05
                and sd[len(self.p) + k] < KNOWN_SHARE * abs(self.gain[k])
                and near.any()
                and np.mean(r.seen[near]) > 0.5
            )
        return known


def fit(problem: Problem, structure: Structure, start: Array) -> Fitted:
    """Fit modes and a delay to the records of `problem`; `start` is the start value of the parameters p."""
    base = np.linalg.qr(problem.slow_rows())[0]

    def free(columns: Array) -> Array:
        rows = problem.rows(columns)
        return rows - base @ (base.T @ rows)

    target = free(problem.seen.y[:, None])[:, 0]

    @lru_cache(maxsize=1)  # the errors, the derivatives and the result are those of one point
    def solved(key: bytes) -> tuple[Array, Array, Array, Array]:
        c = free(problem.columns(structure, np.frombuffer(key)))
        size = np.linalg.norm(c, axis=0)
        size[size == 0] = 1.0
        q, r = np.linalg.qr(c / size)
        # the column of a free decay can be almost zero, or almost equal to another column
        used = np.abs(np.diag(r)) > DEPENDENT
        q, r = q[:, used], r[np.ix_(used, used)]
        gain, along = np.zeros(len(used)), q.T @ target
        gain[used] = np.linalg.solve(r, along) / size[used]
        return q @ along - target, gain, q, c

    def held(p: Array) -> tuple[Callable[[Array], Array], Array]:
        _, gain, q, c = solved(p.tobytes())
        # the columns at p are known
        return lambda at: c @ gain if at is p else free(problem.columns(structure, at) @ gain[:, None])[:, 0], q

    longest, m = max(r.stop - r.start for r in problem.seen.records) * problem.seen.h, structure.modes
    low = np.append(np.tile([np.log(1 / longest), np.log(LEAST_ZETA)], m), -1.0)
    high = np.append(np.tile([np.log(0.5 / problem.seen.h), np.log(MOST_ZETA)], m), MOST_DELAY)
    errors = Differences(lambda p: solved(p.tobytes())[0], np.full(len(low), SCALE), (low, high), STEP, held)
    found = refined(errors, start, EVALUATIONS, TOLERANCE)
    e, gain, _, c = solved(found.p.tobytes())
    n = structure.modes + structure.rest
    told = len(found.p) + n
    covariance = _covariance(np.hstack([errors.slopes(found.p)[0], c]), e)[:told, :told]
    return Fitted(structure, found.p, gain, 2 * found.cost, len(e), covariance)


def _covariance(j: Array, e: Array) -> Array:
    """Return the covariance matrix of the parameters, from the Jacobian j and the weighted errors e.

    Two estimates are computed, and for each parameter the larger variance is used. The first estimate assumes white
    errors with the variance of the residuals. The second estimate assumes errors that are correlated within clusters of
    neighbouring bins, like model errors (sandwich estimator: Liang & Zeger 1986, Biometrika 73(1) 13).
    """
    size = np.linalg.norm(j, axis=0)
    size[size < 1e-100] = 1.0
    _, s, vt = np.linalg.svd(j / size, full_matrices=False)
    s = np.maximum(s, 1e-12 * s.max(initial=1e-300))
    inverse = (vt.T / s**2) @ vt
    n, m = j.shape
    white = inverse * max(1.0, float(e @ e) / max(n - m, 1))
    half = n // 2
    lever = np.sum((j / size @ (vt.T / s)) ** 2, axis=1)
    lever = np.cumsum(lever[:half] + lever[half:])
    # all clusters contain the same amount of information; a cluster with all information would have a score of 0
    place = np.minimum((lever / lever[-1] * CLUSTERS).astype(int), CLUSTERS - 1)
    score = j / size * e[:, None]
    both = np.zeros((CLUSTERS, m))
    np.add.at(both, place, score[:half] + score[half:])
    used = len(np.unique(place))
    sandwich = inverse @ (both.T @ both) @ inverse * (used / max(used - m, 1))
    larger = np.sqrt(np.maximum(1.0, np.diag(sandwich) / np.diag(white)))
    return np.asarray(white * np.outer(larger, larger) / np.outer(size, size))

"""Fit of modes and a delay to records, by weighted least squares over the bins of their Fourier transforms.

The output is a sum of columns with linear weights. The columns depend on the frequencies and damping ratios of the
modes and on the delay, which the Levenberg-Marquardt method determines. The linear weights are computed for each trial
(variable projection: Golub & Pereyra 1973, SIAM J. Numer. Anal. 10(2) 413-432, in the form of Kaufman 1975).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.identify.evidence.problem import Problem, Seen, Structure

STEP = 1e-4  # finite differences of the Jacobian: of ln f_n (times min(1, zeta)), of ln zeta, and of the delay in steps
MOST_STEPS = 12
CLUSTERS = 60  # number of clusters of neighbouring bins, whose errors can be correlated
LEAST_ZETA, MOST_ZETA = 1e-3, 3.0
DEPENDENT = 1e-9  # a normalised column with a smaller component orthogonal to the previous columns is omitted
MOST_DELAY = 10.0  # upper bound of the delay (steps)
KNOWN_F, KNOWN_ZETA, KNOWN_SHARE = 0.1, 0.5, 1 / 5  # largest relative standard errors of a mode that counts as known
HIGHEST = 0.35  # largest frequency of a known mode, relative to the sampling rate


@dataclass(frozen=True)
class Fitted:
    """Result of the fit of modes and a delay.

    ``p`` contains ln f_n and ln zeta of each mode, and the delay in steps. ``gain`` contains the weights of the modes
    and of the rest column, which is the delayed input. ``error`` is the weighted sum of squares over ``count`` real and
    imaginary parts. ``covariance`` is the covariance matrix of p and gain, in this order. ``decay`` contains the
    weights of the free decays. If the fit has no rest column, ``rest_se`` is the standard error that the weight of this
    column would have.
    """

    structure: Structure
    p: Array
    gain: Array
    error: float
    count: int
    covariance: Array
    decay: Array
    rest_se: float = 0.0

    @property
    def misfit(self) -> float:
        """Mean square of the weighted errors per degree of freedom. It is 1 if the errors are only noise."""
        return self.error / max(self.count - len(self.p) - len(self.gain) - len(self.decay), 1)

    def left(self, problem: Problem) -> Array:
        """Return the measured output (n,) minus modes, rest column and free decays; slow parts are not subtracted."""
        made = problem.columns(self.structure, self.p) @ self.gain
        return np.asarray(problem.seen.y - (made + problem.decays(self.structure, self.p) @ self.decay))

    def known(self, seen: Seen) -> NDArray[np.bool_]:
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
    slow, target = problem.slow_rows(), problem.rows(problem.seen.y[:, None])
    base = np.linalg.qr(slow)[0]
    target = (target - base @ (base.T @ target))[:, 0]

    def free(rows: Array) -> Array:
        return rows - base @ (base.T @ rows)

    n = structure.modes + structure.rest

    def linear(p: Array) -> Array:
        return free(problem.rows(np.hstack([problem.columns(structure, p), problem.decays(structure, p)])))

    def at(p: Array) -> tuple[float, Array, Array, Array]:
        c = linear(p)
        size = np.linalg.norm(c, axis=0)
        size[size == 0] = 1.0
        q, r = np.linalg.qr(c / size)
        # the column of a free decay can be almost zero, or almost equal to another column
        used = np.abs(np.diag(r)) > DEPENDENT
        q, r = q[:, used], r[np.ix_(used, used)]
        gain, along = np.zeros(len(used)), q.T @ target
        gain[used] = np.linalg.solve(r, along) / size[used]
        e = target - q @ along
        return float(e @ e), gain, q, e

    def slopes(p: Array, gain: Array) -> Array:
        made = []
        here = problem.columns(structure, p)
        for k in range(structure.modes):
            for j, d in ((0, STEP * min(1.0, np.exp(p[2 * k + 1]))), (1, STEP)):
                moved = p.copy()
                moved[2 * k + j] += d
                change = (problem.column(moved, k) - here[:, k]) * gain[k]
                mine = gain[n:].reshape(max(structure.modes, 1), -1)[k]
                if mine.any():
                    change = change + (problem.decay(moved, k) - problem.decay(p, k)) @ mine
                made.append(change / d)
        moved = p.copy()
        moved[-1] += STEP
        made.append((problem.columns(structure, moved) - here) @ gain[:n] / STEP)
        return free(problem.rows(np.column_stack(made)))

    lo, hi = _bounds(problem, structure)
    p = np.clip(start, lo, hi)
    error, gain, q, e = at(p)
    damping = 1e-3
    for _ in range(MOST_STEPS):
        j = slopes(p, gain)
        j -= q @ (q.T @ j)
        size = np.linalg.norm(j, axis=0)
        size[size == 0] = 1.0
        better = False
        for _ in range(5):
            stacked = np.vstack([j / size, np.sqrt(damping) * np.eye(len(p))])
            step = np.linalg.lstsq(stacked, np.concatenate([e, np.zeros(len(p))]), rcond=None)[0] / size
            step = np.clip(step, -0.5, 0.5)
            trial = np.clip(p + step, lo, hi)
            new = at(trial)
            if new[0] < error:
                better = True
                break
            damping = max(damping * 8, 1e-6)
        if not better:
            break
        gone, moved = (
            error - new[0],
            np.max(np.abs(trial - p) / np.append(np.tile([1e-7, 1e-5], structure.modes), 1e-5)),
        )
        p, (error, gain, q, e) = trial, new
        damping = max(damping / 8, 1e-9)
        if gone < 3e-6 * error or moved < 1:
            break
    told = len(p) + n
    covariance = _covariance(np.hstack([slopes(p, gain), linear(p)]), e)[:told, :told]
    return Fitted(structure, p, gain[:n], error, len(e), covariance, gain[n:])


def _bounds(problem: Problem, structure: Structure) -> tuple[Array, Array]:
    longest = max(r.stop - r.start for r in problem.seen.records) * problem.seen.h
    low = np.append(np.tile([np.log(1 / longest), np.log(LEAST_ZETA)], structure.modes), -1.0)
    high = np.append(np.tile([np.log(0.5 / problem.seen.h), np.log(MOST_ZETA)], structure.modes), MOST_DELAY)
    return low, high


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

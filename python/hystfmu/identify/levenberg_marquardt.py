"""Levenberg-Marquardt: least squares of any function that gives residuals and their Jacobian.

Every iteration factors the Jacobian once, J = Q R, and tries dampings mu on the small triangle:
min |R s + Q'r|^2 + mu |D s|^2, by QR again, never by the normal equations.
Damping and its update: Marquardt 1963; More 1978 (scaling D by the largest column norms seen so far).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.core import Array


def minimise(
    p: Array,
    function: Callable[[Array], tuple[Array, Array]],
    iterations: int,
    tolerance: float = 1e-5,
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[Array, float]:
    """Least squares from the start p; stops when 10 iterations gain less than `tolerance` of the sum of squares.

    Returns
    -------
    p : array
    sum_of_squares : float
    """
    mu = 1e-2
    r, J = function(p)
    cost = float(r @ r)
    scale = np.zeros(len(p))
    history = [cost]
    for i in range(iterations):
        progress(i / iterations)
        norms = np.linalg.norm(J, axis=0)
        scale = np.maximum(scale, np.maximum(norms, 1e-8 * max(norms.max(), 1e-300)))
        Q, R = np.linalg.qr(J / scale)
        right = np.concatenate([-(Q.T @ r), np.zeros(len(p))])
        for _ in range(12):
            damped = np.vstack([R, np.sqrt(mu) * np.eye(len(p))])
            q, t = np.linalg.qr(damped)
            trial = p + np.linalg.solve(t, q.T @ right) / scale
            r_trial, J_trial = function(trial)
            cost_trial = float(r_trial @ r_trial)
            if cost_trial < cost:
                break
            mu *= 4
        else:
            break
        p, r, J, cost = trial, r_trial, J_trial, cost_trial
        mu = max(mu / 5, 1e-14)
        history.append(cost)
        if len(history) > 10 and history[-11] - cost < tolerance * cost:
            break
    return p, cost

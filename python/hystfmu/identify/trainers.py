"""The trainers of a network, by name, on one footing: each minimises a sum of squares from a start.

levenberg_marquardt  the default: half the error of the next in a third of the time.
powell_beale         conjugate gradients with restarts, as in Zhao & Tan 2008; takes every iteration it is given.
lbfgs                limited-memory quasi-Newton (Nocedal 1980; scipy), for networks too large for a Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hystfmu.core import Array
from hystfmu.identify import conjugate_gradient
from hystfmu.identify.conjugate_gradient import Gradient

TRAINERS = ("levenberg_marquardt", "powell_beale", "lbfgs")
MEMORY = 20  # pairs of L-BFGS

Residuals = Callable[[Array], tuple[Array, Array]]


def minimise(
    trainer: str,
    p: Array,
    function: Residuals,
    iterations: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[Array, float]:
    """Least squares by one of `TRAINERS`.

    Parameters
    ----------
    trainer : str
        A name of `TRAINERS`.
    p : array, shape (n,)
        Start.
    function : function
        Residuals (rows,) and their Jacobian (rows, n) at a point.
    iterations : int
        Most iterations.
    progress : function
        Called with the fraction done, 0..1.

    Returns
    -------
    p : array, shape (n,)
    sum_of_squares : float
    """
    if trainer == "levenberg_marquardt":
        from hystfmu.identify import levenberg_marquardt

        return levenberg_marquardt.minimise(p, function, iterations, progress=progress)

    def gradient(p: Array) -> tuple[float, Array]:
        r, J = function(p)
        return float(r @ r) / len(r), 2 * (J.T @ r) / len(r)

    rows = len(function(p)[0])
    p, mean = minimise_gradient(trainer, p, gradient, iterations, progress)
    return p, mean * rows


def minimise_gradient(
    trainer: str,
    p: Array,
    function: Gradient,
    iterations: int,
    progress: Callable[[float], None] = lambda fraction: None,
) -> tuple[Array, float]:
    """Minimum of a function given with its gradient, by ``powell_beale`` or ``lbfgs``; returns point and value."""
    if trainer == "powell_beale":
        p, value, _ = conjugate_gradient.minimise(p, function, iterations, progress=progress)
        return p, value
    from scipy.optimize import minimize

    done = 0

    def count(_: Array) -> None:
        nonlocal done
        done += 1
        progress(min(done / iterations, 1.0))

    # no early end: a network creeps along valleys where a step gains little and the next ones much
    limits = {"maxiter": iterations, "maxfun": 20 * iterations, "maxcor": MEMORY, "ftol": 0.0, "gtol": 1e-12}
    result = minimize(function, p, jac=True, method="L-BFGS-B", callback=count, options=limits)
    return np.asarray(result.x), float(result.fun)

"""The trainers of a network, by name, on one footing: each minimises a sum of squares from a start.

levenberg_marquardt  the default: half the error of the next in a third of the time.
powell_beale         conjugate gradients with restarts, as in Zhao & Tan 2008; takes every iteration it is given.
lbfgs                quasi-Newton with limited memory (Nocedal 1980; scipy), for networks too large for a Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers import conjugate_gradient, levenberg_marquardt
from hystfmu.identify.solvers.conjugate_gradient import Gradient

PAIRS = 20  # steps that L-BFGS remembers

Residuals = Callable[[Array], tuple[Array, Array]]
Progress = Callable[[float], None]


class Trainer(Protocol):
    """What every trainer looks like."""

    def __call__(self, p: Array, function: Residuals, iterations: int, *, progress: Progress) -> tuple[Array, float]:
        """Least squares from the start p (n,).

        `function` gives residuals (rows,) and their Jacobian (rows, n); returned are the point found and the sum of
        squares there.
        """


def powell_beale(
    p: Array,
    function: Residuals,
    iterations: int,
    *,
    progress: Progress = lambda fraction: None,
    gradient: Gradient | None = None,
) -> tuple[Array, float]:
    """Conjugate gradients with Powell-Beale restarts on the sum of squares; `gradient` where it costs less than J."""
    return conjugate_gradient.minimise(p, gradient or _sum_of_squares(function), iterations, progress=progress)[:2]


def lbfgs(
    p: Array,
    function: Residuals,
    iterations: int,
    *,
    progress: Progress = lambda fraction: None,
    gradient: Gradient | None = None,
) -> tuple[Array, float]:
    """L-BFGS on the sum of squares; `gradient` where it costs less than the Jacobian."""
    return lbfgs_gradient(p, gradient or _sum_of_squares(function), iterations, progress)


def lbfgs_gradient(
    p: Array, function: Gradient, iterations: int, progress: Progress = lambda fraction: None
) -> tuple[Array, float]:
    """L-BFGS on a function that gives value and gradient (n,); returns the point (n,) and the value there."""
    from scipy.optimize import minimize

    done = 0

    def count(_: Array) -> None:
        nonlocal done
        done += 1
        progress(min(done / iterations, 1.0))

    # no early end: training creeps along valleys where one step gains little and later ones much
    limits: Any = {"maxiter": iterations, "maxfun": 20 * iterations, "maxcor": PAIRS, "ftol": 0.0, "gtol": 1e-12}
    call: Any = minimize  # its stubs know only one-dimensional arrays by type
    result = call(function, p, jac=True, method="L-BFGS-B", callback=count, options=limits)
    return np.asarray(result.x), float(result.fun)


def _sum_of_squares(function: Residuals) -> Gradient:
    def gradient(p: Array) -> tuple[float, Array]:
        r, J = function(p)
        return float(r @ r), 2 * (J.T @ r)

    return gradient


TRAINERS: dict[str, Trainer] = {
    "levenberg_marquardt": levenberg_marquardt.minimise,
    "powell_beale": powell_beale,
    "lbfgs": lbfgs,
}

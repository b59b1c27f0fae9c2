"""Trainers of a network by name, with a common signature: each minimises a sum of squares from a start.

levenberg_marquardt the default: half the error of the second one in a third of the time. powell_beale conjugate
gradients with restarts, as in Zhao & Tan 2008; uses all iterations. lbfgs limited-memory quasi-Newton (Nocedal 1980;
scipy), for networks too large for a Jacobian.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.identify.solvers import conjugate_gradient, levenberg_marquardt
from hystfmu.identify.solvers.conjugate_gradient import Gradient

PAIRS = 20  # memory of L-BFGS in steps

Residuals = Callable[[Array], tuple[Array, Array]]
Progress = Callable[[float], None]


class Trainer(Protocol):
    """Signature of a trainer."""

    def __call__(self, p: Array, function: Residuals, iterations: int, *, progress: Progress) -> tuple[Array, float]:
        """Minimise the sum of squares from the start p (n,).

        `function` returns residuals (m,) and their Jacobian (m, n).  The result is the point found (n,) and the sum of
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
    """Minimise by conjugate gradients with Powell-Beale restarts; `gradient` avoids the Jacobian."""
    return conjugate_gradient.minimise(p, gradient or _sum_of_squares(function), iterations, progress=progress)[:2]


def lbfgs(
    p: Array,
    function: Residuals,
    iterations: int,
    *,
    progress: Progress = lambda fraction: None,
    gradient: Gradient | None = None,
) -> tuple[Array, float]:
    """Minimise by L-BFGS; `gradient` avoids the Jacobian."""
    return lbfgs_gradient(p, gradient or _sum_of_squares(function), iterations, progress)


def lbfgs_gradient(
    p: Array, function: Gradient, iterations: int, progress: Progress = lambda fraction: None
) -> tuple[Array, float]:
    """Minimise by L-BFGS a function that returns value and gradient (n,); return the point (n,) and the value there."""
    from scipy.optimize import minimize

    done = 0

    def count(_: Array) -> None:
        nonlocal done
        done += 1
        progress(min(done / iterations, 1.0))

    # no early stop: training crosses flat valleys, where one step gains little and later ones much
    limits: Any = {"maxiter": iterations, "maxfun": 20 * iterations, "maxcor": PAIRS, "ftol": 0.0, "gtol": 1e-12}
    call: Any = minimize  # its stubs accept only arrays typed as one-dimensional
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

"""H-infinity loop shaping: the controller that is most robust against perturbations of a shaped plant.

McFarlane & Glover, IEEE Trans. Automat. Control 37 (1992) 759-769; Skogestad & Postlethwaite, Multivariable Feedback
Control, 2nd ed., section 9.4. For a discrete plant, the design uses the bilinear transformation, which preserves all
norms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import python_control


@dataclass(frozen=True)
class LoopShaping:
    """A controller for negative feedback, and the robust stability margins of the shaped plant.

    Attributes
    ----------
    controller : control.StateSpace
        Weight times robust controller, u = K (r - y).
    robust : control.StateSpace
        The robust controller without the weight.
    b_opt : float
        Largest margin that any controller reaches: size of coprime factor perturbations, at most 1. Below 0.25 the
        weight is too demanding.
    b : float
        Guaranteed margin of this controller, b_opt / ratio.
    """

    controller: Any
    robust: Any
    b_opt: float
    b: float


def loop_shaping(G: Any, W: Any, ratio: float = 1.1) -> LoopShaping:
    """Design the robust controller of a shaped plant G W.

    Parameters
    ----------
    G : control.TransferFunction or control.StateSpace
        Plant with one input and one output, continuous or with a step.
    W : control.TransferFunction or control.StateSpace
        Weight before the plant; it gives the loop its shape.
    ratio : float
        Ratio of the optimal margin to that of this controller, above 1; 1.1 is usual.

    Returns
    -------
    LoopShaping

    Raises
    ------
    InputError
        `ratio` is not above 1, or the shaped plant has uncontrollable or unobservable states.
    """
    if not ratio > 1:
        raise InputError(f"The ratio must be a float in (1, inf). Got {ratio:g} instead.")
    control = python_control()
    shaped = control.ss(G) * control.ss(W)
    h = float(shaped.dt)
    system = shaped.A, shaped.B, shaped.C, shaped.D
    try:
        found, least = robust_controller(_to_continuous(system, h) if h else system, ratio)
    except np.linalg.LinAlgError:
        raise InputError("The shaped plant must be stabilisable and detectable. Got one that is not.") from None
    robust = control.ss(*(_to_discrete(found, h) if h else found), h)
    return LoopShaping(control.ss(W) * robust, robust, 1 / least, 1 / (ratio * least))


def robust_controller(system: StateSpace, ratio: float) -> tuple[StateSpace, float]:
    """Return the controller for negative feedback of a shaped plant, and the least norm.

    Skogestad & Postlethwaite, eq. 9.69 to 9.73.

    Parameters
    ----------
    system : (A, B, C, D)
        Continuous state space, one input and one output.
    ratio : float
        Ratio of the optimal margin to that of this controller, above 1.
    """
    # here, so that a process for a foreign FMU does not wait for it
    from scipy.linalg import solve_continuous_are

    A, B, C, D = system
    S, R = np.eye(B.shape[1]) + D.T @ D, np.eye(C.shape[0]) + D @ D.T
    F = A - B @ np.linalg.solve(S, D.T @ C)
    Z = solve_continuous_are(F.T, C.T, B @ np.linalg.solve(S, B.T), R)
    X = solve_continuous_are(F, B, C.T @ np.linalg.solve(R, C), S)
    least = float(np.sqrt(1 + np.abs(np.linalg.eigvals(X @ Z)).max()))
    gamma = ratio * least
    K = -np.linalg.solve(S, D.T @ C + B.T @ X)
    inject = np.asarray(gamma**2 * np.linalg.solve(((1 - gamma**2) * np.eye(len(A)) + X @ Z).T, Z @ C.T), float)
    return (A + B @ K + inject @ (C + D @ K), inject, -B.T @ X, D.T), least


def _to_continuous(system: StateSpace, h: float) -> StateSpace:
    """Map z to s = 2 / h (z - 1) / (z + 1); the gains of states keep the norms."""
    A, B, C, D = system
    M = np.linalg.inv(A + np.eye(len(A)))
    root = 2 / np.sqrt(h)
    return 2 / h * M @ (A - np.eye(len(A))), root * M @ B, root * C @ M, D - C @ M @ B


def _to_discrete(system: StateSpace, h: float) -> StateSpace:
    """Map s back to z."""
    A, B, C, D = system
    M = np.asarray(np.linalg.inv(np.eye(len(A)) - h / 2 * A), float)
    root = np.sqrt(h)
    return M @ (np.eye(len(A)) + h / 2 * A), root * M @ B, root * C @ M, D + h / 2 * C @ M @ B

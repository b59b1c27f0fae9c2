"""H-infinity loop shaping: the controller that is most robust against perturbations of a shaped plant.

McFarlane & Glover, IEEE Trans. Automat. Control 37 (1992) 759-769; Skogestad & Postlethwaite, Multivariable Feedback
Control, 2nd ed., section 9.4. For a discrete plant, the design uses the bilinear transformation, which preserves all
norms. In front of an integral, the controller consists of second-order filters in series.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.design.linear import python_control
from hystfmu.design.plants import Plant
from hystfmu.graph import Node


@dataclass(frozen=True)
class LoopShaping:
    """A controller for negative feedback, and the robust stability margins of the shaped plant.

    Attributes
    ----------
    controller : control.StateSpace
        Product K of weight and robust controller, u = K (r - y).
    robust : control.StateSpace
        The robust controller without the weight.
    b_opt : float
        Largest margin of any controller: size of coprime factor perturbations, at most 1. If it is below 0.25, the
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
        Weight in front of the plant. It determines the shape of the loop.
    ratio : float
        Ratio of the optimal margin to the margin of the controller, above 1. A usual value is 1.1.

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
    """Return the controller for negative feedback of a shaped plant, and the smallest norm.

    Skogestad & Postlethwaite, eq. 9.69 to 9.73.

    Parameters
    ----------
    system : (A, B, C, D)
        Continuous state space, one input and one output.
    ratio : float
        Ratio of the optimal margin to the margin of the controller, above 1.
    """
    # imported here, so that a process for a foreign FMU does not wait for the import
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
    """Map z to s = 2 / h (z - 1) / (z + 1). The states are scaled so that the norms are preserved."""
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


RATIO = 1.1  # margin given away against the optimum
FAST = 3.0  # times the sampling rate (rad/s over 1/s): poles and zeros above are left out


@functools.lru_cache(maxsize=64)
def robust_filters(plant: Plant, h: float, weight: float, zero: float) -> tuple[Node, ...]:
    """Return filters of static gain 1 for use in front of an integral; empty if there is no such controller.

    Parameters
    ----------
    plant : Plant
        Plant. Its delay includes the computing time.
    h : float
        Step (s).
    weight : float
        Gain K of the integral in the weight (1/s).
    zero : float
        Time constant T_z of the zero in the weight (s).
    """
    try:
        (A, B, C, D), _ = robust_controller(_shaped(plant, plant.delay + h / 2, weight, zero), RATIO)
        zeros, poles = _zeros(A, B, C, D), np.linalg.eigvals(A)
    except (np.linalg.LinAlgError, ValueError):
        return ()
    if (poles.real >= 0).any():
        return ()
    zeros = np.append(zeros, -1 / zero)
    top = FAST / h
    zeros, poles = zeros[np.abs(zeros) < top], poles[np.abs(poles) < top]
    if len(zeros) > len(poles):  # what was left out was faster than all that counts
        poles = np.append(poles, [-top] * (len(zeros) - len(poles)))
    tops, bottoms = _factors(zeros), _factors(poles)
    if any(f[-1] == 0 for f in tops + bottoms):
        return ()
    tops += [np.ones(1)] * (len(bottoms) - len(tops))
    nodes = []
    for i, (b, a) in enumerate(zip(tops, bottoms, strict=True)):
        values: dict[str, Any] = {"b": (b / b[-1]).tolist(), "a": (a / a[-1]).tolist(), "hold": "foh"}
        dims = {"na": len(a) - 1, "nb": len(b) - 1}
        nodes.append(Node(f"robust_{i + 1}", "transfer_function", dims, values))
    return tuple(nodes)


def _factors(roots: Any) -> list[Any]:
    """Return real polynomials of degree 2, slowest roots first. An odd number of roots adds one of degree 1."""
    pairs = [np.poly([r, r.conjugate()]).real for r in roots if r.imag > 0]
    real = sorted((r.real for r in roots if abs(r.imag) <= 1e-9 * abs(r)), key=abs)
    pairs += [np.poly(real[k : k + 2]) for k in range(0, len(real) - 1, 2)]
    single = [np.poly(real[-1:])] * (len(real) % 2)
    return [*sorted(pairs, key=lambda p: abs(p[-1])), *single]


def _shaped(plant: Plant, delay: float, weight: float, zero: float) -> StateSpace:
    """Return the weight and the plant in series as one state space. The time is in s."""
    n = 2 * len(plant.f_n)
    G: StateSpace = np.zeros((n, n)), np.zeros((n, 1)), np.zeros((1, n)), np.array([[plant.rest]])
    for i, (f, zeta, k) in enumerate(zip(plant.f_n, plant.zeta, plant.share, strict=True)):
        w, at = 2 * np.pi * f, slice(2 * i, 2 * i + 2)
        G[0][at, at] = [[0, w], [-w, -2 * zeta * w]]
        G[1][2 * i + 1, 0] = w
        G[2][0, 2 * i] = k
    T = delay  # second-order Pade: (1 - sT/2 + s^2 T^2/12) / (1 + sT/2 + s^2 T^2/12)
    late = np.array([[0.0, 1.0], [-12 / T**2, -6 / T]]), np.array([[0.0], [1.0]]), np.array([[0.0, -12 / T]]), np.eye(1)
    integral = np.zeros((1, 1)), np.eye(1), np.array([[weight]]), np.array([[weight * zero]])
    return _series(_series(integral, late), G)


def _series(first: StateSpace, then: StateSpace) -> StateSpace:
    A, B, C, D = first
    F, G, H, K = then
    top = np.hstack([A, np.zeros((len(A), len(F)))])
    return (
        np.vstack([top, np.hstack([G @ C, F])]),
        np.vstack([B, G @ D]),
        np.hstack([K @ C, H]),
        K @ D,
    )


def _zeros(A: Any, B: Any, C: Any, D: Any) -> Any:
    """Return the finite zeros of a state space with one input and one output."""
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.linalg import eigvals

    n = len(A)
    pencil, mass = np.block([[A, B], [C, D]]), np.zeros((n + 1, n + 1))
    mass[:n, :n] = np.eye(n)
    found = eigvals(pencil, mass)
    return found[np.isfinite(found) & (np.abs(found) < 1e3 * np.abs(np.linalg.eigvals(A)).max())]

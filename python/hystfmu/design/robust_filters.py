"""H-infinity loop shaping as second-order filters in series before an integral.

The shaped plant is G(s) e^(-s T) (1 + s T_z) K / s: modes, the delay with that of the hold as a Pade approximant, an
integral and a zero.  McFarlane & Glover 1992, IEEE Trans. Automat. Control 37, 759-769.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from hystfmu.design.delays import StateSpace
from hystfmu.design.loop_shaping import robust_controller
from hystfmu.design.plants import Plant
from hystfmu.graph import Node

RATIO = 1.1  # margin given away against the optimum
FAST = 3.0  # times the sampling rate (rad/s over 1/s): poles and zeros above are left out


@functools.lru_cache(maxsize=64)
def robust_filters(plant: Plant, h: float, weight: float, zero: float) -> tuple[Node, ...]:
    """Return filters of static gain 1 in series before an integral; empty if there is no such controller.

    Parameters
    ----------
    plant : Plant
        Its delay contains the time for computing.
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
    """Return real polynomials of degree 2, and one of degree 1 if the number is odd, slowest roots first."""
    pairs = [np.poly([r, r.conjugate()]).real for r in roots if r.imag > 0]
    real = sorted((r.real for r in roots if abs(r.imag) <= 1e-9 * abs(r)), key=abs)
    pairs += [np.poly(real[k : k + 2]) for k in range(0, len(real) - 1, 2)]
    single = [np.poly(real[-1:])] * (len(real) % 2)
    return [*sorted(pairs, key=lambda p: abs(p[-1])), *single]


def _shaped(plant: Plant, delay: float, weight: float, zero: float) -> StateSpace:
    """Return the plant behind its weight as one state space; time in s."""
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
    # here, so that a process for a foreign FMU does not wait for it
    from scipy.linalg import eigvals

    n = len(A)
    pencil, mass = np.block([[A, B], [C, D]]), np.zeros((n + 1, n + 1))
    mass[:n, :n] = np.eye(n)
    found = eigvals(pencil, mass)
    return found[np.isfinite(found) & (np.abs(found) < 1e3 * np.abs(np.linalg.eigvals(A)).max())]

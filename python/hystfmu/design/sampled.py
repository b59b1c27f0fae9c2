"""State space of any sampled graph at rest: exact tangent of one step, by differences of its states.

The core keeps everything that a run changes in one vector. The columns of A, B, C and D are differences of one step
from the rest and from a point near it, in each direction of this vector and of the inputs. At rest all values of a
controller are zero, so that differences lose no digits, and a small step stays in the linear range of a switching term.
A memory of hysteresis has no tangent; the caller replaces it by a gain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace, close, cut, shift_registers
from hystfmu.graph import Graph

SMALL = 1e-12  # distance from rest
KINDS = ("input", "output")
SETTLED = 3  # steps at rest before the differences: first steps of differences and filters are over
GROWN = 1e6 * SMALL  # a motion that is still one at rest
CHECKED, SAME = 40, 1e-4  # steps of the comparison with a run of the graph, and its largest relative difference


def sampled(graph: Graph, h: float) -> StateSpace:
    """Return A, B, C, D of one step of a graph at rest, all inputs zero, with step h (s); delays become states.

    Parameters
    ----------
    graph : Graph
        Graph of controllers, observers, filters and delays.
    h : float
        Step (s).

    Returns
    -------
    A, B, C, D : array, shapes (n, n), (n, m), (p, n), (p, m)
        x[k] = A x[k-1] + B u[k], y[k] = C x[k-1] + D u[k]: an output reads the input of the same step.

    Raises
    ------
    InputError
        The graph is not linear at rest.
    """
    opened = cut(graph, sort=False)
    system = trimmed(_differences(opened.graph, h))
    if opened.steps:
        system = close(system, shift_registers(opened.steps))
    _check(graph, h, system)
    return system


def _differences(graph: Graph, h: float) -> StateSpace:
    executor = graph.executor()
    inputs, outputs = (
        [p.reference + k for p in graph.ports if p.kind == kind for k in range(p.size)] for kind in KINDS
    )
    for reference in inputs:
        executor.set(reference, 0.0)
    executor.start(0.0)
    for k in range(SETTLED):
        executor.step((k + 1) * h, h)
    rest = executor.state
    n, m = len(rest), len(inputs)

    def step(x: Array, u: Array) -> Array:
        executor.state = rest + x
        for reference, value in zip(inputs, u.tolist(), strict=True):
            executor.set(reference, value)
        executor.step((SETTLED + 1) * h, h)
        return np.concatenate([executor.state, [executor.get(r) for r in outputs]])

    def column(k: int) -> Array:
        away = np.zeros(n + m)
        away[k] = SMALL
        up, down = (step(s * away[:n], s * away[n:]) for s in (1, -1))
        return np.asarray((up - down) / (2 * SMALL))

    T = np.column_stack([column(k) for k in range(n + m)])
    return T[:n, :n], T[:n, n:], T[n:, :n], T[n:, n:]


def trimmed(system: StateSpace) -> StateSpace:
    """Keep only controllable and observable states; parameters and clocks in the vector are neither."""
    A, B, C, D = system
    moved = _closure(A != 0, (B != 0).any(axis=1))
    shown = _closure((A != 0).T, (C != 0).any(axis=0))
    keep = np.flatnonzero(moved & shown)
    return A[np.ix_(keep, keep)], B[keep], C[:, keep], D


def _closure(edges: NDArray[np.bool_], first: NDArray[np.bool_]) -> NDArray[np.bool_]:
    found = first.copy()
    while True:
        more = found | (edges[:, found].any(axis=1) if found.any() else found)
        if (more == found).all():
            return found
        found = more


def _check(graph: Graph, h: float, system: StateSpace) -> None:
    """Refuse a graph whose response to small signals differs from that of its tangent."""
    A, B, C, D = system
    m, p = B.shape[1], C.shape[0]
    u = np.zeros((CHECKED, m))
    u[2:] = SMALL * np.random.default_rng(0).choice([-1.0, 1.0], (CHECKED - 2, m))
    at_rest = graph.executor().run(np.zeros((CHECKED, m)), p, h)
    moved = graph.executor().run(u, p, h) - at_rest
    x, said = np.zeros(len(A)), np.empty((CHECKED, p))
    for k in range(CHECKED):
        said[k] = C @ x + D @ u[k]
        x = A @ x + B @ u[k]
    small = np.maximum.accumulate(np.abs(said).max(axis=1)) <= GROWN  # an unstable graph soon reaches its limits
    said, moved = said[small], moved[small]
    size = float(np.abs(said).max())
    if not (np.isfinite(moved).all() and np.abs(moved - said).max() <= SAME * size + 1e-3 * SMALL * (size == 0)):
        names = ", ".join(dict.fromkeys(n.type for n in graph.nodes))
        raise InputError(f"The blocks must be linear at rest to have margins. Got {names}, which move otherwise.")

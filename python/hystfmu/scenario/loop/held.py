"""Dynamics of a plant discretised for a held command that comes late, also by a fraction of a step."""

from __future__ import annotations

import functools

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace


def held(plant: StateSpace, h: float, delay: float) -> StateSpace:
    """Discretise dynamics for a command that is held for a step h (s) and comes `delay` steps late, exactly.

    Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3.

    Parameters
    ----------
    plant : (A, B, C, D), shapes (n, n), (n, 1), (1, n), (1, 1)
        One input and one output, without direct feed-through; time in s.  Without states it is a gain D.
    h : float
        Step (s).
    delay : float
        Delay in steps, also a fraction.

    Returns
    -------
    (A, B, C, D), shapes (n + q, n + q), (n + q, 1), (1, n + q), (1, 1)
        States of the plant, then the q past commands that still act; a gain takes the last one that has come.

    Raises
    ------
    InputError
        Direct feed-through: the output of a step would depend on a command of the same step.  Overflow in a step.
    """
    return _held(tuple((m.shape, np.ascontiguousarray(m).tobytes()) for m in plant), h, delay)


@functools.lru_cache(maxsize=256)
def _held(content: tuple[tuple[tuple[int, ...], bytes], ...], h: float, delay: float) -> StateSpace:
    A, B, C, D = (np.frombuffer(data).reshape(shape) for shape, data in content)
    if not len(A):
        past = 1 + int(np.ceil(delay - 1e-9))
        return np.eye(past, k=-1), np.eye(past)[:, :1], D * np.eye(past)[-1:], np.zeros((1, 1))
    if np.any(D):
        raise InputError("The dynamics of the plant must have no direct feed-through. Got some.")
    whole = int(np.floor(delay + 1e-12))
    part = max(delay - whole, 0.0) if delay - whole > 1e-9 else 0.0
    late, now = _over(A, B, part * h), _over(A, B, (1 - part) * h)
    n, past = len(A), whole + (part > 0)
    M, N = np.zeros((n + past, n + past)), np.zeros((n + past, 1))
    M[:n, :n] = now[0] @ late[0]
    weights = {whole: now[1], whole + 1: now[0] @ late[1]}  # of u(k - j)
    for j, w in weights.items():
        if j == 0:
            N[:n] += w
        elif j <= past:
            M[:n, n + j - 1 : n + j] += w
    if not (np.isfinite(M).all() and np.isfinite(N).all()):
        raise InputError("The dynamics of the plant must stay finite over a step. Got some that overflow.")
    if past:
        N[n] = 1.0
        M[n + 1 :, n:-1] = np.eye(past - 1)
    return M, N, np.hstack([C, np.zeros((1, past))]), np.zeros((1, 1))


def _over(A: Array, B: Array, t: float) -> tuple[Array, Array]:
    """Return e^(A t) and the integral of e^(A s) B over 0 .. t."""
    # here, so that a process for a foreign FMU does not wait for it
    from scipy.linalg import expm

    n = len(A)
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses what overflows
        M = expm(np.block([[A, B], [np.zeros((1, n + 1))]]) * t)
    return M[:n, :n], M[:n, n:]

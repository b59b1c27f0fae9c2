"""Discretised dynamics of a plant for a held, delayed command, also with a fractional delay or a ramp."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.delays import StateSpace
from hystfmu.graph import Node

TINY = 1e-9  # of a step: such a part of one is none


def ramp_of(dynamics: Sequence[Node], step: float) -> float:
    """Return the ramp time of a new command for dynamics in series (s).

    It is the step of the dynamics if their command rises on a ramp, otherwise 0.
    """
    if not dynamics:
        return 0.0
    first = dynamics[0]
    chosen = any(v.name == "hold" for v in first.block.parameters)
    ramps = first.value("hold")[0] == 1 if chosen else first.block.hold == "foh"
    return step if ramps else 0.0


def held(plant: StateSpace, h: float, delay: float, ramp: float = 0.0) -> StateSpace:
    """Discretise dynamics exactly for a command that is held for a step h (s) and delayed by `delay` steps.

    Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., section 2.3, for a command that jumps.

    Parameters
    ----------
    plant : (A, B, C, D), shapes (n, n), (n, 1), (1, n), (1, 1)
        Plant with one input and one output. The time is in s. A plant without states is a gain D.
    h : float
        Step (s).
    delay : float
        Delay in steps; fractions are allowed.
    ramp : float
        Time (s), at most h, in which the command changes linearly from its last value to the new value.

    Returns
    -------
    (A, B, C, D), shapes (n + q, n + q), (n + q, 1), (1, n + q), (1, 1)
        The states are the states of the plant, then the q delayed commands. Direct feed-through reads the command at
        the end of a step. This is a past command, because the command of the same sample follows later.

    Raises
    ------
    InputError
        A value overflows in a step.
    """
    return _held(tuple((m.shape, np.ascontiguousarray(m).tobytes()) for m in plant), h, delay, ramp)


@functools.lru_cache(maxsize=256)
def _held(content: tuple[tuple[tuple[int, ...], bytes], ...], h: float, delay: float, ramp: float) -> StateSpace:
    A, B, C, D = (np.frombuffer(data).reshape(shape) for shape, data in content)
    whole = int(np.floor(delay + TINY))
    part = delay - whole if delay - whole > TINY else 0.0
    # of u(k - whole), u(k - whole - 1), u(k - whole - 2): what they add to the states, and their share at the end
    free, weights, end = np.eye(len(A)), np.zeros((len(A), 3)), np.zeros(3)
    for length, first, last in _lines(part, ramp / h):
        through, jump, line = _over(A, B, length * h)
        free, weights = through @ free, through @ weights + jump @ first[None] + line @ (last - first)[None]
        end = last if length > 0 else end
    through_now = D * end[None]
    n, used = len(A), np.flatnonzero(weights.any(0) | (np.arange(3) == 0))[-1]
    past = max(whole + int(used), whole + 1 + int(np.flatnonzero(through_now)[-1]) if D.any() else 0)
    M, N = np.zeros((n + past, n + past)), np.zeros((n + past, 1))
    M[:n, :n] = free
    for j, w in zip(range(whole, past + 1), weights.T, strict=False):  # of u(k - j)
        (N if j == 0 else M[:, n + j - 1 : n + j])[:n, 0] = w
    if not (np.isfinite(M).all() and np.isfinite(N).all()):
        raise InputError("The dynamics of the plant must stay finite over a step. Got some that overflow.")
    if past:
        N[n] = 1.0
        M[n + 1 :, n:-1] = np.eye(past - 1)
    out = np.hstack([C, np.zeros((1, past + 3))])
    out[:, n + whole : n + whole + 3] = through_now
    return M, N, out[:, : n + past], np.zeros((1, 1))


def _lines(part: float, ramp: float) -> Iterator[tuple[float, Array, Array]]:
    """Yield the straight lines of the command in a step: length, and weights of three commands at the two ends.

    A new command arrives after a part of the step. The ramp to this command may end in the next step. The two times are
    fractions of a step.
    """
    new, last, older = np.eye(3)
    over = max(part + ramp - 1, 0.0)  # what is left of the ramp before at the start of the step
    risen = 1.0 - over / ramp if ramp else 1.0
    yield over, (1 - risen) * older + risen * last, last
    yield part - over, last, last
    risen = (min(part + ramp, 1.0) - part) / ramp if ramp else 1.0
    yield min(part + ramp, 1.0) - part, last, (1 - risen) * last + risen * new
    yield 1 - min(part + ramp, 1.0), new, new


def _over(A: Array, B: Array, t: float) -> tuple[Array, Array, Array]:
    """Return e^(A t), the effect of an input of 1, and the effect of an input from 0 to 1, all for the time t."""
    # imported here, so that a process for a foreign FMU does not wait for the import
    from scipy.linalg import expm

    n = len(A)
    if not t > 0:
        return np.eye(n), np.zeros((n, 1)), np.zeros((n, 1))
    chain = np.zeros((n + 2, n + 2))
    chain[:n, :n], chain[:n, n : n + 1], chain[n, n + 1] = A * t, B * t, 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # the caller refuses what overflows
        M = expm(chain)
    return M[:n, :n], M[:n, n : n + 1], M[:n, n + 1 :]

"""What the excitation can tell: reversals under noise, minor loops and whether they close, and warnings when it cannot.

A sum of plays has return-point memory: after an excursion u: a -> b -> a its output is back where it was, and the loop
is closed (wiping-out and congruence: Mayergoyz 1991, ch. 1).  A Bouc-Wen operator has not: it creeps along the outer
branch (Ikhouane & Rodellar 2007, ch. 3).  So the gap of the minor loops in the data tells the class before any fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.core import Array
from hystfmu.data import Dataset
from hystfmu.identify.dead_band import noise

OPEN = 0.5  # percent of the span of y: a larger gap is no return-point memory
LEAST_LOOP = 0.02  # of the range of u: smaller loops say little
LEAST_SAMPLES = 100  # per cycle: extrema seen only at samples cost 2.6 / 0.10 / 0.03 % at 10 / 50 / 100
SURE = 3.0  # standard errors
RETURN_POINT, BOUC_WEN, UNKNOWN = "return-point", "bouc-wen", "unknown"


@dataclass(frozen=True)
class Excitation:
    """What the training rows hold.

    Parameters
    ----------
    reversals : int
        Turning points of u outside its noise.
    samples_per_cycle : float
        Rows for two reversals, on average.
    loops : int
        Minor loops that u closes.
    gap : float
        RMS over the loops of y after minus y before, noise taken out, in percent of the span of y.
    memory : str
        ``return-point``, ``bouc-wen`` or ``unknown``.
    warnings : tuple of str
        Why the memory cannot be identified from these rows; empty if it can.
    """

    reversals: int
    samples_per_cycle: float
    loops: int
    gap: float
    memory: str
    warnings: tuple[str, ...]


def turning_points(u: Array, band: float) -> Array:
    """Rows (m,) of the extrema of u (n,) that are followed by a way back of more than `band`; a plateau is none."""
    found: list[int] = []
    top = bottom = direction = 0
    for k, value in enumerate(u.tolist()):
        top = k if value >= u[top] else top
        bottom = k if value <= u[bottom] else bottom
        if direction >= 0 and value < u[top] - band:
            found += [top] if top > 0 else []
            direction, bottom = -1, k
            top = k
        elif direction <= 0 and value > u[bottom] + band:
            found += [bottom] if bottom > 0 else []
            direction, top = 1, k
            bottom = k
    return np.array(found, dtype=int)


def reversals(u: Array) -> Array:
    """Turning points (m,) of u (n,) outside its noise: with a way back of 6 sigma and 0.1 % of its range."""
    return turning_points(u, max(6 * noise(u), 1e-3 * float(np.ptp(u))))


def gaps(u: Array, y: Array, turns: Array) -> Array:
    """For every minor loop a -> b -> a of u: y where u is back at a (between samples), minus y at a."""
    found = []
    level = u[turns]
    for i in range(1, len(turns) - 1):
        size = abs(level[i + 1] - level[i])
        if size < LEAST_LOOP * np.ptp(u) or abs(level[i] - level[i - 1]) < size:
            continue
        end = turns[i + 2] + 1 if i + 2 < len(turns) else len(u)
        way = (u[turns[i + 1] : end] - level[i]) * np.sign(level[i] - level[i + 1])
        back = np.flatnonzero(way >= 0)
        if len(back):
            k = int(turns[i + 1] + back[0])
            share = way[back[0]] / (way[back[0]] - way[back[0] - 1])
            found.append(y[k] - share * (y[k] - y[k - 1]) - y[turns[i]])
    return np.array(found)


def examine(data: Dataset) -> Excitation:
    """Reversals, minor loops and memory class of the training rows.

    Parameters
    ----------
    data : Dataset
        With a measured output.  Rate dependence and creep open loops too, so the gap is an upper bound on what the
        memory does; noise of y is taken out, and where it hides the limit of 0.5 % the class is ``unknown``.
    """
    u, y = data.u[data.train], data.y[data.train]
    turns = reversals(u)
    between = np.diff(turns)
    samples = 2 * float(between.mean()) if len(between) else float(len(u))
    d, sigma, span = gaps(u, y, turns), noise(y), float(np.ptp(y))
    gap, memory = 0.0, UNKNOWN
    if len(d):
        square, by_noise = float(np.mean(d**2)), 2 * sigma**2
        error = SURE * by_noise * np.sqrt(2 / len(d))
        gap = 100 * float(np.sqrt(max(square - by_noise, 0.0))) / span
        if gap > OPEN and square - by_noise > error:
            memory = BOUC_WEN
        elif 100 * np.sqrt(error) / span <= OPEN:
            memory = RETURN_POINT
    return Excitation(len(turns), samples, len(d), gap, memory, _warnings(u[turns], samples, len(d)))


def _warnings(levels: Array, samples: float, loops: int) -> tuple[str, ...]:
    found = []
    swings = np.abs(np.diff(levels))
    if len(swings) < 3 or bool(np.all(np.diff(swings) <= 0.01 * swings.max())):
        found.append(
            "the input is one decaying (or steady) oscillation, which does not identify memory; "
            "excite with at least 60 reversals of different amplitudes"
        )
    elif not loops:
        found.append("the input closes no minor loop, so that return-point memory cannot be told from any other")
    if samples < LEAST_SAMPLES:
        found.append(f"{samples:.0f} samples per cycle; at least {LEAST_SAMPLES} show the reversals well enough")
    return tuple(found)

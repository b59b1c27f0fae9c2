"""Memory class of the data: reversals outside the noise, minor loops, closure; warnings if it is not informative.

A sum of plays has return-point memory: after an excursion u: a -> b -> a the output returns to its value, and the minor
loop is closed (wiping-out and congruence: Mayergoyz 1991, ch. 1). A Bouc-Wen operator has no return-point memory: its
output drifts along the outer branch (Ikhouane & Rodellar 2007, ch. 3). So the gap of the minor loops in the data gives
the memory class before any fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise, reversals

OPEN = 0.5  # percent of the span of y: a larger gap contradicts return-point memory
LEAST_LOOP = 0.02  # of the range of u: smaller loops are not informative
LEAST_SAMPLES = 50  # per cycle: sampling of the extrema costs 2.6 / 0.10 / 0.03 % at 10 / 50 / 100
MISSED = 260.0  # percent of the span, over the square of the samples per cycle: the same costs as a formula
SURE = 3.0  # standard errors
NO_WIDTH = 0.1  # percent of the span of y: a thinner loop counts as no hysteresis
BINS = 50
MOST_TURNS = 200  # reversals after which the search for the return to an extremum ends
SPEEDS = 2.0  # ratio of speeds that makes rate dependence visible
RETURN_POINT, OPEN_LOOPS, NONE, UNKNOWN = "return-point", "no return-point", "none", "unknown"


@dataclass(frozen=True)
class Excitation:
    """Properties of the excitation in the training rows.

    Parameters
    ----------
    reversals : int
        Number of turning points of u outside its noise.
    samples_per_cycle : float
        Mean number of rows between every second reversal.
    loops : int
        Number of minor loops that u closes.
    gap : float
        Gap: RMS over the loops of y after the loop minus y before it, corrected for noise, in percent of the span of y.
    several_speeds : bool
        Whether the mean speeds of half cycles differ by a factor of 2 (10th and 90th percentile), so that rate
        dependence is visible.
    memory : str
        ``return-point``; ``no return-point``, for example the memory of a Bouc-Wen operator or of the last extremum
        only; ``none`` if y is a function of u; or ``unknown``.
    warnings : tuple of str
        Reasons why the excitation is not informative enough to identify memory; empty if it is.
    coarse : tuple of str
        Warning that the rows are too far apart to contain the extrema of a static model. Models with dynamics do not
        need this warning, because dynamics smooth the extrema.
    """

    reversals: int
    samples_per_cycle: float
    loops: int
    gap: float
    several_speeds: bool
    memory: str
    warnings: tuple[str, ...]
    coarse: tuple[str, ...]


def gaps(u: Array, y: Array, turns: Array) -> Array:
    """Return the gap of y for every extremum that u (n,) returns to.

    The gap is y at the return, interpolated, minus y at the extremum.

    Before the return, u must stay inside the branch that led to the extremum; smaller loops are allowed.
    """
    found = []
    level = np.append(u[turns], u[-1])
    at = np.append(turns, len(u) - 1)
    for i in range(1, len(turns)):
        side, depth = np.sign(level[i] - level[i - 1]), 0.0
        for j in range(i + 1, min(i + MOST_TURNS, len(level))):
            way = side * (level[j] - level[i])
            if way >= 0:
                back = at[j - 1]
                k = int(back + np.argmax(side * (u[back : at[j] + 1] - level[i]) >= 0))
                if depth >= LEAST_LOOP * np.ptp(u):
                    share = side * (u[k] - level[i]) / (side * (u[k] - u[k - 1]))
                    found.append(y[k] - share * (y[k] - y[k - 1]) - y[turns[i]])
                break
            depth = max(depth, -way)
            if depth > abs(level[i] - level[i - 1]):
                break
    return np.array(found)


def width(u: Array, y: Array) -> float:
    """Return the RMS distance of y (n,) from a function of u (n,): straight lines over `BINS` parts of sorted rows."""
    order = np.argsort(u, kind="stable")
    square = 0.0
    for part in np.array_split(order, min(BINS, len(u) // 4)):
        columns = np.column_stack([u[part] - u[part].mean(), np.ones(len(part))])
        square += float(np.sum((y[part] - columns @ np.linalg.lstsq(columns, y[part], rcond=None)[0]) ** 2))
    return float(np.sqrt(square / len(u)))


def examine(data: Dataset) -> Excitation:
    """Determine reversals, minor loops and memory class of the training rows.

    Rate dependence and creep also open loops, so the gap is an upper bound for the effect of the memory. The gap is
    corrected for the noise of y. The class is ``unknown`` if the noise hides the limit of 0.5 %, or if extrema between
    two samples explain the gap.

    Parameters
    ----------
    data : Dataset
        Data with a measured output.
    """
    u, y = data.u[data.train], data.y[data.train]
    turns = reversals(u)
    between = np.diff(turns)
    samples = 2 * float(between.mean()) if len(between) else float(len(u))
    d, sigma, span = gaps(u, y, turns), noise(y), float(np.ptp(y))
    gap, memory = 0.0, UNKNOWN
    if width(u, y) ** 2 - sigma**2 * (1 - SURE * np.sqrt(2 / len(y))) < (NO_WIDTH / 100 * span) ** 2:
        memory = NONE
    elif len(d):
        square, by_noise = float(np.mean(d**2)), 2 * sigma**2
        error = SURE * by_noise * np.sqrt(2 / len(d))
        gap = 100 * float(np.sqrt(max(square - by_noise, 0.0))) / span
        if gap > OPEN and square - by_noise > error:
            # extrema between two samples open a loop of any memory
            memory = OPEN_LOOPS if gap > SURE * MISSED / samples**2 else UNKNOWN
        elif 100 * np.sqrt(error) / span <= OPEN:
            memory = RETURN_POINT
    several = spreads(u)[0] > SPEEDS
    return Excitation(
        len(turns), samples, len(d), gap, several, memory, _warnings(u[turns], len(d), memory), _coarse(samples)
    )


def spreads(u: Array) -> tuple[float, float]:
    """Return the 90th over the 10th percentile of mean speed and of duration of the half cycles of u (n,)."""
    turns = reversals(u)
    between = np.diff(turns)
    if not len(between):
        return 1.0, 1.0
    ends = [np.percentile(v, [90, 10]) for v in (np.abs(np.diff(u[turns])) / between, between)]
    speed, duration = (float(most / least) for most, least in ends)
    return speed, duration


def _coarse(samples: float) -> tuple[str, ...]:
    if samples >= LEAST_SAMPLES:
        return ()
    return (f"{samples:.0f} samples per cycle; at least {LEAST_SAMPLES} are needed to resolve the reversals",)


def _warnings(levels: Array, loops: int, memory: str) -> tuple[str, ...]:
    found = []
    if memory == NONE:
        found.append(f"the output is a function of the input: its loops are thinner than {NO_WIDTH} % of the span of y")
    swings = np.abs(np.diff(levels))
    if len(swings) < 3 or bool(np.all(np.diff(swings) <= 0.01 * swings.max())):
        found.append(
            "the input is one decaying (or steady) oscillation, which is not informative enough to identify memory; "
            "excite with at least 60 reversals of different amplitudes"
        )
    elif not loops:
        found.append("the input closes no minor loop, so it is not informative about return-point memory")
    return tuple(found)

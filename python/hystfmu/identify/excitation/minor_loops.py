"""Memory class of a record, determined from its minor loops before any fit.

A sum of plays has return-point memory: if the input goes from a to b and back to a, the output returns to its value,
and the minor loop is closed (wiping-out and congruence: Mayergoyz 1991, ch. 1). A Bouc-Wen operator has no return-point
memory: its minor loops stay open, and its output moves along the outer branch (Ikhouane & Rodellar 2007, ch. 3).
Therefore the gap between the two ends of a minor loop shows the memory class of the device.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise, reversals, turning_points

OPEN = 0.5  # gap (% of the span of y) above which the record contradicts return-point memory
LEAST_LOOPS = 5  # number of closed loops that show return-point memory; single loops also close where y saturates
LEAST_LOOP = 0.02  # depth relative to the range of u below which a loop is not used
# number of rows per cycle below which a warning is given; with 10, 50 and 100 rows per cycle, extrema between two rows
# cause errors of 2.6, 0.10 and 0.03 % of the span
LEAST_SAMPLES = 50
MISSED = 260.0  # these errors (% of the span) are about MISSED divided by the square of the rows per cycle
SURE = 3.0  # number of standard errors of a significant gap
NO_WIDTH = 0.1  # RMS width of the loops (% of the span of y) below which the record shows no hysteresis
BINS = 50
MOST_TURNS = 200  # number of reversals after which the search for the return to an extremum ends
SPEEDS = 2.0  # ratio of speeds above which a record is informative about rate dependence
RETURN_POINT, OPEN_LOOPS, NONE, UNKNOWN = "return-point", "no return-point", "none", "unknown"


@dataclass(frozen=True)
class Excitation:
    """Properties of the excitation in the training rows.

    Parameters
    ----------
    reversals : int
        Number of reversals of u that are larger than its noise.
    samples_per_cycle : float
        Mean number of rows in two half cycles, without reversals smaller than `LEAST_LOOP` of the range of u.
    loops : int
        Number of minor loops after which u returns to its value before the loop.
    gap : float
        RMS of the gaps of the minor loops, corrected for noise, in percent of the span of y. The gap of a loop is y
        after the loop minus y before it.
    several_speeds : bool
        Whether the record is informative about rate dependence: the 90th percentile of the mean speeds of the half
        cycles is more than twice the 10th percentile.
    memory : str
        Memory class. ``return-point``: minor loops close. ``no return-point``: minor loops stay open, as with a
        Bouc-Wen operator, or with a memory of only the last extremum. ``none``: y is a function of u. ``unknown``: the
        record does not determine the class.
    warnings : tuple of str
        Reasons why the excitation is not informative enough to identify the memory. Empty if it is informative.
    coarse : tuple of str
        Warning that the sampling rate is too low to resolve the extrema. The warning applies to static models only,
        because dynamics smooth the extrema.
    """

    reversals: int
    samples_per_cycle: float
    loops: int
    gap: float
    several_speeds: bool
    memory: str
    warnings: tuple[str, ...]
    coarse: tuple[str, ...]

    @property
    def closes(self) -> bool:
        """Result of the test whether enough minor loops close to exclude kinds with open loops."""
        return self.memory == RETURN_POINT and self.loops >= LEAST_LOOPS


def gaps(u: Array, y: Array, turns: Array) -> Array:
    """Return the gap of the minor loop after each extremum of u (n,) to which u returns.

    The gap is the interpolated y at the return minus y at the extremum. Between the extremum and the return, u must
    stay within the range of the branch that led to the extremum. Smaller loops inside this range are permitted. `turns`
    contains the rows of the extrema.
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
    """Return the RMS distance between y (n,) and a function of u (n,), in the unit of measure of y.

    The rows are sorted by u and divided into `BINS` parts. In each part, the function is a straight line.
    """
    order = np.argsort(u, kind="stable")
    square = 0.0
    for part in np.array_split(order, min(BINS, len(u) // 4)):
        columns = np.column_stack([u[part] - u[part].mean(), np.ones(len(part))])
        square += float(np.sum((y[part] - columns @ np.linalg.lstsq(columns, y[part], rcond=None)[0]) ** 2))
    return float(np.sqrt(square / len(u)))


def examine(data: Dataset) -> Excitation:
    """Determine the reversals, the minor loops and the memory class of the training rows.

    The gap is corrected for the noise of y. Rate dependence and creep also open loops, so the gap is an upper bound for
    the effect of the memory. The class is ``unknown`` if the record has no minor loops, if the noise is too large to
    detect a gap of 0.5 %, or if extrema between two rows can cause the gap.

    Parameters
    ----------
    data : Dataset
        Data with a measured output.
    """
    u, y = data.u[data.train], data.y[data.train]
    turns = reversals(u)
    # a small chirp has many reversals, but its missed extrema cause errors of its own small size only
    between = np.diff(turning_points(u, max(6 * noise(u), LEAST_LOOP * float(np.ptp(u)))))
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
            # extrema between two rows cause a gap for every class of memory
            memory = OPEN_LOOPS if gap > SURE * MISSED / samples**2 else UNKNOWN
        elif 100 * np.sqrt(error) / span <= OPEN:
            memory = RETURN_POINT
    several = spreads(u)[0] > SPEEDS
    return Excitation(
        len(turns), samples, len(d), gap, several, memory, _warnings(u[turns], len(d), memory), _coarse(samples)
    )


def several_speeds(u: Array, records: Sequence[slice], train: slice) -> bool:
    """Return whether the training rows of all records together have several speeds."""
    rows = [np.arange(r.start, r.stop)[max(train.start - r.start, 0) :] for r in records]
    return spreads(*(u[r[r < train.stop]] for r in rows))[0] > SPEEDS


def spreads(*records: Array) -> tuple[float, float]:
    """Return how much the mean speeds and the durations of the half cycles of the inputs u (n,) of records vary.

    Each of the two numbers is the ratio of the largest 90th to the smallest 10th percentile of a record. With
    percentiles of all half cycles together, a record at a high frequency, which has many of them, would hide another.
    """
    ends = []
    for u in records:
        turns = reversals(u) if len(u) else np.zeros(0, dtype=int)
        between = np.diff(turns)
        if len(between):
            ends.append([np.percentile(v, [90, 10]) for v in (np.abs(np.diff(u[turns])) / between, between)])
    if not ends:
        return 1.0, 1.0
    speed, duration = np.max(ends, axis=0)[:, 0] / np.min(ends, axis=0)[:, 1]
    return float(speed), float(duration)


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

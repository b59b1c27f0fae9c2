"""Axes and curves of diagrams: padded range, round ticks, their numbers; SVG path data thinned to a screen.

`common.js` has the same functions of axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hystfmu.base.arrays import Array

LONGEST_TICK = 5  # characters without an exponent
DIGITS = 12  # of a tick: fewer than doubles have, so that sums of steps are round
FEW_DECADES = 2.5
GAP = 8  # points between two names
WIDE = 12.0  # points: the width of such a letter
LETTER = 7.7  # points: the width of a digit beside an axis


def axis(values: Array) -> tuple[tuple[float, float], list[float]]:
    """Return the range of an axis and its ticks at 1, 2 or 5 times a power of ten."""
    lo, hi = float(values.min()), float(values.max())
    if hi - lo < 1e-9 * max(abs(lo), abs(hi), 1e-300):
        pad = max(abs(hi), 1e-12) * 0.5
        lo, hi = lo - pad, hi + pad
    rough = (hi - lo) / 5
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    room = 0.04 * (hi - lo)
    first, last = math.ceil((lo - room) / step), math.floor((hi + room) / step)
    return (lo - room, hi + room), [k * step for k in range(first, last + 1)]


def decades(values: Array) -> tuple[tuple[float, float], list[float]]:
    """Return the range of a logarithmic axis and its ticks, all as powers of ten.

    The ticks are at decades. If there are few decades, ticks at 2 and 5 times a decade are added.
    """
    lo, hi = (math.log10(v) for v in (float(values.min()), float(values.max())))
    room = 0.04 * (hi - lo) or 0.5
    lo, hi = lo - room, hi + room
    between = (1, 2, 5) if hi - lo < FEW_DECADES else (1,)
    found = [k + math.log10(m) for k in range(math.floor(lo), math.ceil(hi) + 1) for m in between]
    return (lo, hi), [v for v in found if lo <= v <= hi]


def sparse(ticks: Sequence[float], names: Sequence[str], size: float) -> list[tuple[float, str]]:
    """Return ticks and their names along an axis of `size` points.

    Only every second or third tick is returned if names would overlap.
    """
    wide = LETTER * max(map(len, names), default=0) + GAP
    every = max(1, math.ceil(wide * len(ticks) / size))
    return list(zip(ticks, names, strict=True))[::every]


def tick(v: float) -> str:
    """Return the text of a number at an axis. It has an exponent if this makes a long number shorter."""
    plain = f"{v:.{DIGITS}g}"
    mantissa, _, power = f"{v:.{DIGITS - 1}e}".partition("e")
    other = f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"
    if "e" in plain:
        return other
    return other if len(plain.lstrip("-")) > LONGEST_TICK and len(other) < len(plain) else plain


def width_of(text: str) -> float:
    """Return the width of a label."""
    return sum(WIDE if c in "mMwW@%" else LETTER for c in text)


def width(ticks: Sequence[float]) -> float:
    """Return the width of the numbers at an axis."""
    return LETTER * max((len(tick(v)) for v in ticks), default=0)


def path(x: Array, y: Array) -> str:
    """Return a curve as SVG path data in relative steps of a tenth of a point.

    Decimals would need three times the size.
    """
    points = np.column_stack([x, y])
    tenths = np.round(10 * points).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    return f"M{tenths[0, 0]} {tenths[0, 1]}l" + " ".join(f"{a} {b}" for a, b in steps.tolist() or [[0, 0]])


def dots(x: Array, y: Array) -> str:
    """Return points as SVG path data: closed subpaths without length. Round line ends make them visible."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0, prepend=0).tolist()
    return f"M{steps[0][0]} {steps[0][1]}z" + "".join(f"m{a} {b}z" for a, b in steps[1:])


def thin(x: Array, y: Array, points: int, envelope: bool = False) -> tuple[Array, Array]:
    """Return at most `points` rows of a curve, evenly spaced.

    With `envelope`, return the lowest and the highest row of every piece of the curve.
    """
    n = len(x)
    if n <= points:
        return x, y
    if not envelope:
        picked = np.unique(np.linspace(0, n - 1, points).round().astype(int))
        return x[picked], y[picked]
    extremes = []  # ripple and peaks stay visible
    for piece in np.array_split(np.arange(n), points // 2):
        extremes += sorted((piece[y[piece].argmin()], piece[y[piece].argmax()]))
    picked = np.array(extremes)
    return x[picked], y[picked]

"""Axes of diagrams, with ranges, ticks and labels, and conversion of curves to SVG path data.

`common.js` contains the same functions for axes.
"""

import math
from collections.abc import Sequence

import numpy as np

from hystfmu.base import Array

LONGEST_TICK = 5  # maximum number of characters of a tick label without exponent
DIGITS = 12  # significant digits of a tick: fewer than those of a double, so that rounding errors are not shown
FEW_DECADES = 2.5
GAP = 8  # minimum distance of two labels, in points
WIDE = 12.0  # width of a wide letter, in points
LETTER = 7.7  # width of a digit in a tick label, in points


def axis(values: Array) -> tuple[tuple[float, float], list[float]]:
    """Return the range and the ticks of an axis for given values.

    The distance of the ticks is 1, 2 or 5 times a power of ten.
    """
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
    """Return the range of a logarithmic axis and its ticks, as decimal logarithms.

    The ticks are at powers of ten. If there are few of them, ticks at 2 and 5 times a power of ten are added.
    """
    lo, hi = (math.log10(v) for v in (float(values.min()), float(values.max())))
    room = 0.04 * (hi - lo) or 0.5
    lo, hi = lo - room, hi + room
    between = (1, 2, 5) if hi - lo < FEW_DECADES else (1,)
    found = [k + math.log10(m) for k in range(math.floor(lo), math.ceil(hi) + 1) for m in between]
    return (lo, hi), [v for v in found if lo <= v <= hi]


def sparse(ticks: Sequence[float], names: Sequence[str], size: float) -> list[tuple[float, str]]:
    """Return ticks with their labels for an axis with a length of `size` points.

    If labels would overlap, only every second or third tick is returned.
    """
    wide = LETTER * max(map(len, names), default=0) + GAP
    every = max(1, math.ceil(wide * len(ticks) / size))
    return list(zip(ticks, names, strict=True))[::every]


def tick(v: float) -> str:
    """Return the label of a tick. The number has an exponent if this makes a long label shorter."""
    plain = f"{v:.{DIGITS}g}"
    mantissa, _, power = f"{v:.{DIGITS - 1}e}".partition("e")
    other = f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"
    if "e" in plain:
        return other
    return other if len(plain.lstrip("-")) > LONGEST_TICK and len(other) < len(plain) else plain


def width_of(text: str) -> float:
    """Return the width of a label in points."""
    return sum(WIDE if c in "mMwW@%" else LETTER for c in text)


def width(ticks: Sequence[float]) -> float:
    """Return the width of the longest tick label of an axis in points."""
    return LETTER * max((len(tick(v)) for v in ticks), default=0)


def path(x: Array, y: Array) -> str:
    """Return a curve as SVG path data with relative coordinates in tenths of a point.

    Absolute coordinates with decimals would need three times as many characters.
    """
    points = np.column_stack([x, y])
    tenths = np.round(10 * points).astype(int)
    steps = np.diff(tenths, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    return f"M{tenths[0, 0]} {tenths[0, 1]}l" + " ".join(f"{a} {b}" for a, b in steps.tolist() or [[0, 0]])


def dots(x: Array, y: Array) -> str:
    """Return points as SVG path data. A point is a closed subpath of length 0, which round line ends make visible."""
    tenths = np.round(10 * np.column_stack([x, y])).astype(int)
    steps = np.diff(tenths, axis=0, prepend=0).tolist()
    return f"M{steps[0][0]} {steps[0][1]}z" + "".join(f"m{a} {b}z" for a, b in steps[1:])


def thin(x: Array, y: Array, points: int, envelope: bool = False) -> tuple[Array, Array]:
    """Return at most `points` evenly selected points of a curve.

    With `envelope`, the curve is divided into pieces, and the lowest and the highest point of each piece are returned.
    """
    n = len(x)
    if n <= points:
        return x, y
    if not envelope:
        picked = np.unique(np.linspace(0, n - 1, points).round().astype(int))
        return x[picked], y[picked]
    extremes = []  # so that oscillations and peaks stay visible
    for piece in np.array_split(np.arange(n), points // 2):
        extremes += sorted((piece[y[piece].argmin()], piece[y[piece].argmax()]))
    picked = np.array(extremes)
    return x[picked], y[picked]

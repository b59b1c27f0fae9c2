"""Axes of diagrams: the padded range, round ticks, and their numbers; `common.js` has the same."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hystfmu.base.arrays import Array

LONGEST_TICK = 5  # characters without an exponent
DIGITS = 12  # of a tick: fewer than doubles have, so that sums of steps are round
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


def tick(v: float) -> str:
    """Return a number beside an axis: with an exponent if it is long and that is shorter."""
    plain = f"{v:.{DIGITS}g}"
    mantissa, _, power = f"{v:.{DIGITS - 1}e}".partition("e")
    other = f"{mantissa.rstrip('0').rstrip('.')}e{int(power)}"
    if "e" in plain:
        return other
    return other if len(plain.lstrip("-")) > LONGEST_TICK and len(other) < len(plain) else plain


def width(ticks: Sequence[float]) -> float:
    """Return the width of the numbers beside an axis."""
    return LETTER * max((len(tick(v)) for v in ticks), default=0)

"""Values of an FMU as numbers: whole numbers are rounded to the nearest, a boolean is true from one half on."""

from __future__ import annotations

import math
from typing import Any

from hystfmu.fmu.foreign.finding import Finding
from hystfmu.fmu.foreign.instance import REAL

_WORDS = {"true": 1.0, "false": 0.0}


def numbers(text: Any) -> tuple[float, ...]:
    """Return the numbers in a start value; `true` and `false` are 1 and 0, and integers beyond the range of doubles
    stay ints."""
    return tuple(_WORDS[w] if w in _WORDS else _number(w) for w in str(text).split())


def _number(word: str) -> float:
    x = float(word)
    try:
        return x if x == int(word) else int(word)
    except ValueError:
        return x


def carried(v: Any, x: float) -> float:
    """Return the value that a variable takes for the number x; an int for whole numbers.

    Raises
    ------
    Finding
        A whole number that is not finite or does not fit the type.
    """
    if v.type in REAL:
        return x
    if not isinstance(x, int) and not math.isfinite(x):
        raise Finding(f"{v.name}: a variable of type {v.type} cannot take {x}")
    if v.type == "Boolean":
        return float(x >= 0.5)
    low, high = _bounds(v.type)
    whole = round(x)
    if not low <= whole <= high:
        raise Finding(f"{v.name}: {x:g} does not fit the type {v.type}")
    return whole


def _bounds(kind: str) -> tuple[int, int]:
    bits = int("".join(c for c in kind if c.isdigit()) or 32)
    return (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)

"""Units of measure of expressions, in base units: what is not stated is unknown, a number has none of its own."""

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pymoca.ast as ast

Unit = tuple[tuple[str, int], ...]  # base unit and exponent, sorted
NUMBER: Unit = ()
SAME = {"noEvent", "pre", "abs", "min", "max", "smooth", "sum", "mod", "delay", "homotopy", "previous", "hold"}
PURE = {"sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "asin", "acos", "atan", "atan2", "sign"}
_DERIVED = {
    "Hz": "s-1", "rad": "", "V": "kg.m2.s-3.A-1", "N": "kg.m.s-2", "C": "A.s", "F": "A2.s4.kg-1.m-2",
    "Ohm": "kg.m2.s-3.A-2", "J": "kg.m2.s-2", "W": "kg.m2.s-3", "Pa": "kg.m-1.s-2", "H": "kg.m2.s-2.A-2",
    "T": "kg.s-2.A-1", "Wb": "kg.m2.s-2.A-1",
}  # fmt: skip


class ClashError(Exception):
    """Two units of measure that do not add."""


@dataclass(frozen=True)
class Literal:
    """A number: it fits any unit in a sum, and is a factor in a product."""


Found = Unit | Literal | None
"""A unit, a number, or unknown."""


def parsed(text: str) -> Unit | None:
    """A unit as Modelica writes it, in base units; None for "" or one that is not known here."""
    if not text:
        return None
    total: Counter[str] = Counter()
    for sign, part in zip((1, -1), (*text.split("/", 1), ""), strict=False):
        for factor in filter(None, re.split(r"[.*()]+", part)):
            m = re.fullmatch(r"([A-Za-z]+?)(-?\d+)?", factor)
            if factor == "1":
                continue
            if m is None:
                return None
            power = sign * int(m[2] or 1)
            base = _DERIVED.get(m[1])
            if base is None:
                total[m[1]] += power
            for inner in filter(None, (base or "").split(".")):
                k = re.fullmatch(r"([A-Za-z]+)(-?\d+)?", inner)
                assert k is not None
                total[k[1]] += power * int(k[2] or 1)
    return _sorted(total)


def written(u: Unit) -> str:
    """A unit for a message."""
    return ".".join(f"{b}{p if p != 1 else ''}" for b, p in u) or "1"


def of(e: Any, unit_of: Callable[[str], Unit | None]) -> Found:
    """The unit of an expression.

    Raises
    ------
    ClashError
        Two terms of a sum have different units.
    """
    if isinstance(e, ast.Primary):
        return Literal()
    if isinstance(e, ast.ComponentRef):
        return (("s", 1),) if str(e) == "time" else unit_of(str(e))
    if isinstance(e, ast.IfExpression):
        return _sum([of(x, unit_of) for x in e.expressions])
    if not isinstance(e, ast.Expression):
        return None
    name = str(e.operator)
    given = [of(x, unit_of) for x in e.operands]
    if name in ("+", "-") or name in SAME:
        return _sum(given[1:] if name == "smooth" else given[:1] if name in ("delay", "mod") else given)
    if name in ("*", "/") and len(given) == 2:
        return _product(given[0], given[1], 1 if name == "*" else -1)
    if name == "der":
        return _product(given[0], (("s", 1),), -1)
    if name in PURE:
        return NUMBER
    if name == "^" and isinstance(e.operands[1], ast.Primary) and isinstance(given[0], tuple):
        power = e.operands[1].value
        return tuple((b, int(p * power)) for b, p in given[0]) if p_is_whole(power) else None
    return None


def p_is_whole(power: Any) -> bool:
    """Is it an exponent that keeps exponents whole?"""
    return isinstance(power, int | float) and float(power).is_integer() and power != 0


def _sum(found: list[Found]) -> Found:
    units = [u for u in found if isinstance(u, tuple)]
    if len(set(units)) > 1:
        raise ClashError(f"{written(units[0])} and {written(next(u for u in units if u != units[0]))} are added")
    if units:
        return units[0] if None not in found else None
    return None if None in found or not found else Literal()


def _product(a: Found, b: Found, sign: int) -> Found:
    if a is None or b is None:
        return None
    if isinstance(a, Literal) and isinstance(b, Literal):
        return Literal()
    total: Counter[str] = Counter(dict(a) if isinstance(a, tuple) else {})
    for base, p in b if isinstance(b, tuple) else ():
        total[base] += sign * p
    return _sorted(total)


def _sorted(total: Counter[str]) -> Unit:
    return tuple(sorted((b, p) for b, p in total.items() if p))

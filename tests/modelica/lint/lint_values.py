"""Rules of the lint on types and variability of expressions: what is whole, what is a text, what may change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from lint_variability import differentiated
from shapes import class_of
from syntax_tree import calls, inside, plain

_WHOLE = {"size", "integer", "Integer", "ndims"}
_LIKE = {"+", "-", "*", "div", "mod", "rem", "max", "min", "abs", "sum", "pre", "noEvent", "fill"}


def real_as_integer(c: library.Class) -> Iterator[str]:
    """A size, an Integer and the range of a loop are whole numbers by their type, not by their value."""
    for name, s in c.tree.symbols.items():
        given = library.modifiers(s.class_modification).get("value")
        if str(s.type) == "Integer" and kind(given, c) == "Real":
            yield f"the Integer {name} has a Real value"
        if any(kind(d, c) == "Real" for row in s.dimensions for d in row):
            yield f"a size of {name} is a Real"
    for loop in _loops([*c.tree.equations, *c.tree.initial_equations, *c.tree.statements]):
        for i in loop.indices:
            ends = i.expression
            if isinstance(ends, ast.Slice) and "Real" in (kind(ends.start, c), kind(ends.stop, c)):
                yield f"the range of {i.name} is Real"


def string_sum(c: library.Class) -> Iterator[str]:
    """Only texts are added to a text: a number is written by String()."""
    for e in _sums([c.tree.equations, c.tree.statements, *_bindings(c)]):
        kinds = [kind(x, c) for x in e.operands]
        if "String" in kinds and set(kinds) - {"String", None}:
            yield f"a text and a number are added ({next(k for k in kinds if k not in ('String', None))})"


def higher_variability(c: library.Class) -> Iterator[str]:
    """A constant follows from constants; a parameter, a size and an attribute from parameters."""
    for name, s in c.tree.symbols.items():
        given = library.modifiers(s.class_modification)
        constant = "constant" in s.prefixes
        wanted = {"constant"} if constant else {"constant", "parameter"}
        places = [
            [d for row in s.dimensions for d in row],
            [v for k, v in given.items() if k in ("start", "min", "max")],
        ]
        if {"constant", "parameter"} & set(s.prefixes) and "value" in given:
            places.append([given["value"]])
        if c.tree.type in ("block", "model", "record"):
            for ref in sorted({r for p in places for r in _read(p)}):
                if changes(ref, c, wanted):
                    yield f"{name} depends on {ref}, which changes {'after translation' if constant else 'in a run'}"


def circular_parameter(c: library.Class) -> Iterator[str]:
    """No parameter depends on itself."""
    fixed = {n: s for n, s in library.components(c).items() if {"parameter", "constant"} & set(s.prefixes)}
    needs = {
        n: {plain(r) for r in _read(library.modifiers(s.class_modification).get("value"))} for n, s in fixed.items()
    }
    for name in fixed if c.tree.type in ("block", "model", "record") else ():
        reached, front = set(), needs[name]
        while front:
            reached |= front
            front = set().union(*(needs.get(n, set()) for n in front)) - reached
        if name in reached:
            yield f"the parameter {name} depends on itself"


def deprecated(c: library.Class) -> Iterator[str]:
    """No operator that the specification advises against."""
    for e in [*c.tree.equations, *c.tree.statements]:
        if calls(e, "cardinality"):
            yield "calls cardinality()"


def start_unfixed(c: library.Class) -> Iterator[str]:
    """A state that has a start value says whether the solver must keep it."""
    for name in differentiated(c):
        s = c.tree.symbols.get(name)
        given = library.modifiers(s.class_modification) if s is not None else {}
        if "start" in given and "fixed" not in given:
            yield f"the state {name} has a start value, and does not say whether it is fixed"


RULES = (real_as_integer, string_sum, higher_variability, circular_parameter, deprecated, start_unfixed)


def kind(e: Any, c: library.Class) -> str | None:
    """Integer, Real, Boolean or String; None where that is not known."""
    if isinstance(e, ast.Primary):
        names = {bool: "Boolean", int: "Integer", float: "Real", str: "String"}
        return names.get(type(e.value))
    if isinstance(e, ast.ComponentRef):
        s = library.components(c).get(e.name)
        return _of_symbol(s, c) if s is not None and not e.child else None
    if isinstance(e, ast.IfExpression):
        return _widest([kind(x, c) for x in e.expressions])
    if isinstance(e, ast.Expression):
        name = str(e.operator)
        if name in _WHOLE:
            return "Integer"
        if name == "String":
            return "String"
        found = [kind(x, c) for x in e.operands]
        if name in ("/", "^"):
            return "Real" if set(found) <= {"Integer", "Real"} else None
        return _widest(found[:1] if name == "fill" else found) if name in _LIKE else None
    return None


def changes(ref: str, c: library.Class, wanted: set[str]) -> bool:
    """Does a component of a class vary more than the prefixes that are wanted allow?"""
    head, _, tail = ref.partition(".")
    s = library.components(c).get(plain(head))
    if ref == "time":
        return True
    if s is None or wanted & set(s.prefixes) or {"parameter"} & wanted & set(s.prefixes):
        return False
    of = class_of(s, c)
    return changes(tail, of, wanted) if tail and of else not (tail or "constant" in s.prefixes)


def _of_symbol(s: ast.Symbol, c: library.Class) -> str | None:
    if str(s.type) in ("Integer", "Boolean", "String", "Real"):
        return str(s.type)
    of = class_of(s, c)
    return "Real" if of is not None and of.tree.type == "type" and not of.tree.symbols else None


def _widest(found: list[str | None]) -> str | None:
    if None in found or not found:
        return None
    return "Real" if set(found) == {"Integer", "Real"} else found[0] if len(set(found)) == 1 else None


def _read(e: Any) -> Iterator[str]:
    """References outside size(): the size of an array is that of its declaration."""
    if isinstance(e, ast.ComponentRef):
        yield str(e)
    elif not (isinstance(e, ast.Expression) and str(e.operator) in ("size", "ndims")):
        for i in inside(e):
            yield from _read(i)


def _bindings(c: library.Class) -> list[Any]:
    return [e for s in c.tree.symbols.values() for e in library.modifiers(s.class_modification).values()]


def _sums(e: Any) -> Iterator[ast.Expression]:
    if isinstance(e, ast.Expression) and str(e.operator) == "+":
        yield e
    for i in inside(e):
        yield from _sums(i)


def _loops(found: list[Any]) -> Iterator[Any]:
    for e in found:
        if isinstance(e, ast.ForEquation | ast.ForStatement):
            yield e
        blocks = getattr(e, "blocks", None) or [getattr(e, "equations", []) or getattr(e, "statements", [])]
        for block in blocks:
            yield from _loops(block)

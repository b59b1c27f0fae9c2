"""Sizes in a class for the defaults of its parameters: which components there are, and how many scalars they have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import prod
from typing import Any

import library
import numpy as np
import pymoca.ast as ast
from source import declared

PRIMITIVE = ("Real", "Integer", "Boolean")
Scope = dict[str, Any]


class UnknownSizeError(Exception):
    """A size that does not follow from the defaults of the parameters."""


def present(c: library.Class, scope: Scope) -> dict[str, ast.Symbol]:
    """The components of a class without the conditional ones that are not there."""
    conditions: dict[str, str] = {}
    for k in lineage(c):
        for name, e in declared(k).items():
            if m := re.search(r"\bif (not )?(\w+)\s*(?:\"\"\s*)?\Z", e.text.strip()):
                conditions[name] = (m[1] or "") + m[2]
    found = {}
    for name, s in library.components(c).items():
        condition = conditions.get(name, "")
        value = scope.get(condition.removeprefix("not "), True)
        if bool(value) != condition.startswith("not "):
            found[name] = s
    return found


def lineage(c: library.Class) -> Iterator[library.Class]:
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None:
            yield from lineage(base)
    yield c


def scope_of(c: library.Class) -> Scope:
    """Values of the parameters and constants of a class that follow from their defaults."""
    scope: Scope = {}
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None:
            scope |= scope_of(base)
            for key, value in library.modifiers(e.class_modification).items():
                _put(scope, key, value)
    for name, s in c.tree.symbols.items():
        value = library.modifiers(s.class_modification).get("value")
        if value is not None and {"parameter", "constant"} & set(s.prefixes):
            _put(scope, name, value)
        of = class_of(s, c)
        if of is not None and of.tree.type == "record":
            scope |= {f"{name}.{k}": v for k, v in (scope_of(of) | modified(s, scope)).items()}
    return scope


def modified(s: ast.Symbol, scope: Scope) -> Scope:
    found: Scope = {}
    for key, value in library.modifiers(s.class_modification).items():
        try:
            found[key] = value_of(value, scope)
        except UnknownSizeError:
            continue
    return found


def _put(scope: Scope, key: str, e: Any) -> None:
    try:
        scope[key] = value_of(e, scope)
    except UnknownSizeError:
        scope.pop(key, None)


def value_of(e: Any, scope: Scope) -> Any:
    try:
        return library.evaluate(e, scope)
    except (NotImplementedError, AttributeError, TypeError, KeyError, ValueError) as x:
        raise UnknownSizeError(str(e)) from x


def shape(s: ast.Symbol, scope: Scope) -> tuple[int, ...]:
    found = []
    for d in (d for row in s.dimensions for d in row):
        if isinstance(d, ast.Primary) and d.value is None:
            continue
        value = value_of(d, scope)
        if not isinstance(value, int | np.integer):
            raise UnknownSizeError(str(d))
        found.append(int(value))
    return tuple(found)


def class_of(s: ast.Symbol, c: library.Class) -> library.Class | None:
    """The class of a component, by its name as written where it is declared; None for a built-in type."""
    if str(s.type) in PRIMITIVE:
        return None
    where = next((k for k in lineage(c) if k.tree.symbols.get(s.name) is s), c)
    return library.find(str(s.type), where.name)


def is_causal(c: library.Class) -> bool:
    return c.tree.type == "connector" and not c.tree.symbols


def direction(s: ast.Symbol, of: library.Class | None) -> str:
    if of is not None and is_causal(of):
        return "input" if "Input" in of.short_name else "output"
    return "input" if "input" in s.prefixes else "output"


def size_of(e: Any, c: library.Class, scope: Scope) -> int | None:
    """Scalars of an expression; None: not known, as for a call."""
    if isinstance(e, ast.Primary):
        return 1
    if isinstance(e, ast.ComponentRef):
        return _reference(e, c, scope)
    if isinstance(e, ast.Array):
        inner = [size_of(v, c, scope) for v in e.values]
        return None if None in inner else sum(i for i in inner if i is not None)
    if isinstance(e, ast.Expression) and str(e.operator) in ("+", "-", "der", "noEvent", "pre"):
        inner = [size_of(x, c, scope) for x in e.operands]
        return next((i for i in inner if i is not None and i > 1), None if None in inner else 1)
    if isinstance(e, ast.Expression) and str(e.operator) in ("*", "/"):
        return 1 if all(size_of(x, c, scope) == 1 for x in e.operands) else None  # w*z is a scalar or not
    if isinstance(e, tuple | list):
        inner = [size_of(v, c, scope) for v in e]
        return None if None in inner else sum(i for i in inner if i is not None)
    return None


def _reference(ref: ast.ComponentRef, c: library.Class, scope: Scope) -> int | None:
    s = library.components(c).get(ref.name)
    if s is None:
        return 1 if ref.name in scope or str(ref) == "time" else None
    dims = list(shape(s, scope))
    for k, i in enumerate([x for row in ref.indices for x in row if x is not None]):
        if isinstance(i, ast.Slice):
            if i.start is not None and getattr(i.start, "value", i.start) is not None:
                dims[k] = int(value_of(i.stop, scope) - value_of(i.start, scope)) + 1
        else:
            dims[k] = 1
    own = prod(dims)
    if not ref.child:
        return own
    of = class_of(s, c)
    inner = _reference(ref.child[0], of, scope_of(of) | modified(s, scope)) if of else None
    return own * inner if inner is not None else None

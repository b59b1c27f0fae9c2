"""Rules of the lint on equations: what rumoca takes although Modelica forbids it, or although it simulates badly."""

import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from syntax_tree import assigned, calls, inside, plain, plain_equations, references, text_of, with_bases

RELATIONS = {"<", ">", "<=", ">="}


def outside_when(c: library.Class) -> Iterator[str]:
    inside = {
        n for k in with_bases(c) for e in k.tree.equations if isinstance(e, ast.WhenEquation) for n in assigned(e)
    }
    outside = {n for e in c.tree.equations if not isinstance(e, ast.WhenEquation) for n in assigned(e)}
    discrete = {n for n, s in library.components(c).items() if "discrete" in s.prefixes}
    for name in sorted((inside | discrete) & outside):
        yield f"{name} is discrete and assigned outside 'when'"
    for name in sorted(discrete - inside - outside):
        yield f"{name} is discrete and never assigned"


def assigned_input(c: library.Class) -> Iterator[str]:
    inputs = set(library.ports(c, "RealInput"))
    for name in sorted({n for e in c.tree.equations for n in assigned(e)} & inputs):
        yield f"the input {name} is assigned"


def protected_access(c: library.Class) -> Iterator[str]:
    parts = library.components(c)
    for ref in sorted({r for e in c.tree.equations for r in references(e) if "." in r}):
        head, tail, *_ = ref.split(".")
        of = head in parts and library.find(str(parts[head].type), c.name)
        inner = library.components(of).get(tail) if of else None
        if inner is not None and inner.visibility.name != "PUBLIC":
            yield f"{ref} is protected"
        if of and inner is None:
            yield f"{ref} does not exist"


def unlike_units(c: library.Class) -> Iterator[str]:
    for e in c.tree.equations:
        if isinstance(e, ast.ConnectClause):
            units = [_unit_of(str(end), c) for end in (e.left, e.right)]
            if all(units) and units[0] != units[1]:
                yield f"connect({e.left}, {e.right}) joins {units[0]} and {units[1]}"


def equal_reals(c: library.Class) -> Iterator[str]:
    """Modelica allows == and <> between Reals in functions only."""
    if c.tree.type == "function":
        return
    parts = library.components(c)
    places = [*c.tree.equations, *c.tree.initial_equations]
    places += [e for s in c.tree.symbols.values() for e in library.modifiers(s.class_modification).values()]
    for e in places:
        for comparison in _comparisons(e):
            for side in comparison.operands:
                name = re.sub(r"\[.*", "", str(side)) if isinstance(side, ast.ComponentRef) else ""
                if (
                    name in parts
                    and str(parts[name].type) not in ("Integer", "Boolean")
                    and not _is_choice(parts[name], c)
                ):
                    yield f"{name} is a Real and compared with {comparison.operator}"


def _comparisons(e: Any) -> Iterator[ast.Expression]:
    if isinstance(e, ast.Expression) and str(e.operator) in ("==", "<>"):
        yield e
    for inner in inside(e):
        yield from _comparisons(inner)


def _is_choice(s: ast.Symbol, c: library.Class) -> bool:
    typed = library.find(str(s.type), c.name)
    return bool(typed and typed.tree.symbols)


def _unit_of(end: str, c: library.Class) -> str:
    head, *tail = end.split(".")
    symbol = library.components(c).get(head)
    if symbol is None:
        return ""
    if not tail:
        return library.unit(symbol, c.name)
    of = library.find(str(symbol.type), c.name)
    return _unit_of(".".join(tail), of) if of else ""


def connected_twice(c: library.Class) -> Iterator[str]:
    """The same two ends joined twice are one connection set: no error, but a sign of a wrong end."""
    pairs = [frozenset((_end(e.left), _end(e.right))) for e in c.tree.equations if isinstance(e, ast.ConnectClause)]
    for pair in sorted({p for p in pairs if pairs.count(p) > 1}, key=sorted):
        yield f"{' and '.join(sorted(pair))} are connected twice"


def without_start(c: library.Class) -> Iterator[str]:
    """What `pre` reads at the first event has a start value that is written down."""
    texts = "".join(map(text_of, with_bases(c)))
    for name in sorted({plain(r) for e in c.tree.equations for p in calls(e, "pre") for r in references(p)}):
        declared = re.search(rf"\b{name}\b(?:\[[^;]*?\])?\s*\([^;]*?\bstart\s*=[^;]*?\bfixed\s*=", texts)
        if not declared:
            yield f"pre({name}) is read, and {name} has no start value that is fixed"


def own_value(c: library.Class) -> Iterator[str]:
    """In a when-equation the old value of a variable is pre(z); z itself is the new one, computed from itself."""
    for w in c.tree.equations:
        for e in plain_equations(w) if isinstance(w, ast.WhenEquation) else ():
            left = {plain(r) for r in references(e.left)}
            for name in sorted(left & {plain(r) for r in _without(e.right, "pre")}):
                yield f"{name} is computed from itself; its old value is pre({name})"


def event_storm(c: library.Class) -> Iterator[str]:
    """A relation in the equation of a derivative is an event at each of its zeros: hundreds in one loop."""
    fixed = {n for n, s in library.components(c).items() if {"parameter", "constant"} & set(s.prefixes)}
    for e in c.tree.equations:
        branches = isinstance(e, ast.IfEquation) and any(calls(i, "der") for i in plain_equations(e))
        for i in plain_equations(e):
            of = [*calls(i.left, "der"), *calls(i.right, "der")]
            if not of:
                continue
            places = [i.left, i.right, *(e.conditions if branches else [])]
            relations = [r for p in places for r in _relations(p)]
            if any({plain(n) for n in references(r)} - fixed for r in relations):
                yield f"der({', '.join(references(of[0]))}) depends on a relation that is an event; use noEvent"


RULES = (
    outside_when, assigned_input, protected_access, unlike_units, equal_reals, connected_twice, without_start,
    own_value, event_storm,
)  # fmt: skip


def _relations(e: Any) -> Iterator[ast.Expression]:
    """Relations that are events: those outside noEvent and smooth."""
    if isinstance(e, ast.Expression) and str(e.operator) in ("noEvent", "smooth"):
        return
    if isinstance(e, ast.Expression) and str(e.operator) in RELATIONS:
        yield e
    for i in inside(e):
        yield from _relations(i)


def _without(e: Any, function: str) -> Iterator[str]:
    """Component references outside the calls of a built-in function."""
    if isinstance(e, ast.ComponentRef):
        yield str(e)
    elif not (isinstance(e, ast.Expression) and str(e.operator) == function):
        for i in inside(e):
            yield from _without(i, function)


def _end(ref: ast.ComponentRef) -> str:
    """A reference with its indices, which str() leaves out."""
    indices = ", ".join(str(i) for row in ref.indices for i in row if i is not None)
    return ".".join([ref.name + (f"[{indices}]" if indices else ""), *map(_end, ref.child)])

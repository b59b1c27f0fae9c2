"""What rumoca does not notice in a class: one generator of complaints per rule."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import library
import numpy as np
import pymoca.ast as ast

KIND = r"(?:package|function|block|model|record|type|connector)"
ARRAY_CALLS = {"fill", "zeros", "ones", "linspace", "cat"}


def complaints(c: library.Class) -> Iterator[str]:
    """Every rule on one class; a message begins with the name of the rule."""
    rules = (undocumented, missing_each, outside_when, assigned_input, protected_access, below_min, unlike_units)
    for rule in (*rules, equal_reals, dead_link, without_icon):
        for message in rule(c):
            yield f"{rule.__name__}: {c.name}: {message}"


def undocumented(c: library.Class) -> Iterator[str]:
    if c.tree.type == "package" and not c.tree.annotation:
        return  # the parser's view of an enclosing package
    if not c.tree.comment:
        yield "has no description"
    body = _text_of(c)
    if "Documentation(info" not in body:
        yield "has no documentation"
    if c.tree.type == "function" or (c.tree.type == "block" and not c.tree.partial):
        if c.name.startswith("HystFMU.Icons"):
            return
        for heading in (
            "Equation",
            "Source",
            "Limitation",
            *(("Example", "See also") if c.tree.type == "block" else ()),
        ):
            if f"<b>{heading}" not in body:
                yield f"its documentation has no {heading}"


def missing_each(c: library.Class) -> Iterator[str]:
    names = library.components(c)
    for name, s in c.tree.symbols.items():
        if not _is_array(s):
            continue
        for attribute, e in library.modifiers(s.class_modification).items():
            whole = isinstance(e, ast.Array) or (isinstance(e, ast.Expression) and str(e.operator) in ARRAY_CALLS)
            whole |= isinstance(e, ast.ComponentRef) and str(e) in names and _is_array(names[str(e)])
            declared = re.search(rf"\b{name}\[[^;]*?\beach\s+{attribute}\b[^;]*;", _text_of(c))
            if attribute != "value" and not whole and not declared:
                yield f"{name}[...]({attribute} = ...) needs 'each'"
            if attribute == "value" and isinstance(e, ast.Primary):
                yield f"the array {name} has a scalar value"


def outside_when(c: library.Class) -> Iterator[str]:
    inside = {n for e in c.tree.equations if isinstance(e, ast.WhenEquation) for n in _assigned(e)}
    outside = {n for e in c.tree.equations if not isinstance(e, ast.WhenEquation) for n in _assigned(e)}
    discrete = {n for n, s in library.components(c).items() if "discrete" in s.prefixes}
    for name in sorted((inside | discrete) & outside):
        yield f"{name} is discrete and assigned outside 'when'"
    for name in sorted(discrete - inside - outside):
        yield f"{name} is discrete and never assigned"


def assigned_input(c: library.Class) -> Iterator[str]:
    inputs = set(library.ports(c, "RealInput"))
    for name in sorted({n for e in c.tree.equations for n in _assigned(e)} & inputs):
        yield f"the input {name} is assigned"


def protected_access(c: library.Class) -> Iterator[str]:
    parts = library.components(c)
    for ref in sorted({r for e in c.tree.equations for r in _references(e) if "." in r}):
        head, tail, *_ = ref.split(".")
        of = head in parts and library.find(str(parts[head].type), c.name)
        inner = library.components(of).get(tail) if of else None
        if inner is not None and inner.visibility.name != "PUBLIC":
            yield f"{ref} is protected"
        if of and inner is None:
            yield f"{ref} does not exist"


def below_min(c: library.Class) -> Iterator[str]:
    if c.tree.type not in ("block", "model", "record"):
        return
    values = library.parameters(c)
    for name, s in library.components(c).items():
        limits = library.modifiers(s.class_modification)
        for limit, sign in (("min", 1), ("max", -1)):
            if name in values and limit in limits:
                bound = library.evaluate(limits[limit], values)
                if np.any(sign * (np.asarray(values[name]) - bound) < 0):
                    yield f"{name} = {values[name]} is beyond its {limit} {bound}"


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


def dead_link(c: library.Class) -> Iterator[str]:
    for target in re.findall(r"modelica://([\w.]+)", _text_of(c)):
        if target not in library.classes():
            yield f"its documentation links to {target}, which does not exist"


def without_icon(c: library.Class) -> Iterator[str]:
    """A class has graphics of its own, or inherits them; a short type has none in Modelica."""
    if c.tree.type in ("type", "__function") or (not c.tree.annotation and c.tree.type == "package"):
        return
    if not _has_icon(c):
        yield "has no icon"


def _has_icon(c: library.Class) -> bool:
    bases = [library.find(str(e.component), c.name) for e in c.tree.extends]
    short = re.search(r"=\s*(?:input|output)?\s*Real|enumeration", _text_of(c).split("annotation")[0])
    return "Icon(" in _text_of(c) or bool(short) or any(b and _has_icon(b) for b in bases)


def _comparisons(e: Any) -> Iterator[ast.Expression]:
    if isinstance(e, ast.Expression) and str(e.operator) in ("==", "<>"):
        yield e
    for inner in _inside(e):
        yield from _comparisons(inner)


def _is_choice(s: ast.Symbol, c: library.Class) -> bool:
    typed = library.find(str(s.type), c.name)
    return bool(typed and typed.tree.symbols)


def _unit_of(end: str, c: library.Class) -> str:
    head, *tail = end.split(".")
    symbol = library.components(c)[head]
    if not tail:
        return library.unit(symbol, c.name)
    of = library.find(str(symbol.type), c.name)
    return _unit_of(".".join(tail), of) if of else ""


def _text_of(c: library.Class) -> str:
    """The source of one class: from its declaration to its end, without the classes below it."""
    body = library.text(c.file)
    start = re.search(rf"\b{KIND} {c.short_name}\b", body)
    assert start, f"{c.name}: not found in {c.file.name}"
    end = re.search(rf"\bend {c.short_name};", body[start.start() :])
    stop = start.start() + end.end() if end else body.index(";", body.index("annotation", start.start()))
    body = body[start.start() : stop]
    for inner in c.tree.classes:
        long, short = rf"\b{KIND} {inner} \".*?\bend {inner};", rf"\b{KIND} {inner} =.*?Documentation\(info.*?\)\);"
        body = re.sub(f"{long}|{short}", "", body, flags=re.S)
    return body


def _is_array(s: ast.Symbol) -> bool:
    return any(not (isinstance(d, ast.Primary) and d.value is None) for row in s.dimensions for d in row)


def _assigned(e: Any) -> Iterator[str]:
    """Plain names on the left of an equation and of all equations in it."""
    if isinstance(e, ast.Equation):
        if isinstance(e.left, ast.ComponentRef) and "." not in str(e.left):
            yield str(e.left)
        return
    for block in getattr(e, "blocks", []) or [getattr(e, "equations", [])]:
        for inner in block:
            yield from _assigned(inner)


def _references(e: Any) -> Iterator[str]:
    """Every component reference in an equation or expression."""
    if isinstance(e, ast.ComponentRef):
        yield str(e)
        return
    for inner in _inside(e):
        yield from _references(inner)


def _inside(e: Any) -> Iterator[Any]:
    """The parts of a node of the tree."""
    if isinstance(e, list | tuple):
        yield from e
    elif isinstance(e, ast.Node):
        yield from (v for k, v in vars(e).items() if k not in ("parent", "scope"))

"""Rules of the lint on units of measure: what has a dimension says its unit, and units fit."""

import re
from collections.abc import Iterator
from typing import Any

import library
import measures
import pymoca.ast as ast
from lint_variability import differentiated
from syntax_tree import plain, plain_equations, with_bases


def unit_clash(c: library.Class) -> Iterator[str]:
    """Both sides of an equation, and the terms of a sum, have one unit."""
    for left, right, text in _pairs(c):
        try:
            one, other = (measures.of(e, lambda n: _unit(c, n)) for e in (left, right))
        except measures.ClashError as e:
            yield f"{text}: {e}"
            continue
        if isinstance(one, tuple) and isinstance(other, tuple) and one != other:
            yield f"{text}: {measures.written(one)} = {measures.written(other)}"


def without_unit(c: library.Class) -> Iterator[str]:
    """A Real to which an equation gives a dimension has a unit or a type that has one."""
    for left, right, text in _pairs(c):
        for target, e in ((left, right), (right, left)):
            power = 0
            if isinstance(target, ast.Expression) and str(target.operator) == "der":
                target, power = target.operands[0], 1
            name = plain(str(target)) if isinstance(target, ast.ComponentRef) else ""
            s = library.components(c).get(name)
            if s is None or str(s.type) != "Real" or _unit(c, name) is not None or name not in c.tree.symbols:
                continue
            try:
                found = measures.of(e, lambda n: _unit(c, n))
            except measures.ClashError:
                continue
            if isinstance(found, tuple) and (found or power):
                what = dict(found)
                what["s"] = what.get("s", 0) + power
                dimension = tuple(sorted((b, p) for b, p in what.items() if p))
                if dimension:
                    yield f"{name} has the dimension {measures.written(dimension)} by {text}, and no unit"


def without_nominal(c: library.Class) -> Iterator[str]:
    """A state with a unit says how large it is: solvers scale their errors by it."""
    for name in differentiated(c):
        s = library.components(c).get(name)
        unit = _unit(c, name) if s is not None else None
        if s is None or not unit or unit == (("s", 1),):
            continue
        typed = library.find(str(s.type), c.name)
        own = "nominal" in library.modifiers(s.class_modification) or _inherited_nominal(c, name)
        if not own and not (typed and _type_has_nominal(typed)):
            yield f"the state {name} in {measures.written(unit)} has no nominal value"


def other_nominal(c: library.Class) -> Iterator[str]:
    """Two names of one variable have one nominal value: a tool keeps one name of them, and may take either value."""
    for left, right, _ in _pairs(c):
        ends = [left, *(_terms(right))] if _is_ref(left) and len(_terms(right)) == 1 else []
        values = {str(e): nominal(c, str(e)) for e in ends}
        if len(ends) == 2 and None not in values.values() and len(set(values.values())) > 1:
            yield " and ".join(f"{name} of nominal {value:g}" for name, value in values.items()) + " are one variable"


RULES = (unit_clash, without_unit, without_nominal, other_nominal)


def nominal(c: library.Class, name: str) -> float | None:
    """The nominal value of a component reference in a class: its own, else that of its type; None: not stated."""
    head, _, tail = name.partition(".")
    s = library.components(c).get(plain(head))
    if s is None or {"parameter", "constant"} & set(s.prefixes):
        return None
    of = library.find(str(s.type), c.name) or next(
        (b for k in with_bases(c) if (b := library.find(str(s.type), k.name))), None
    )
    if tail:
        return nominal(of, tail) if of else None
    own = library.modifiers(s.class_modification).get("nominal")
    if own is not None:
        return float(own.value) if isinstance(own, ast.Primary) else None
    declared = library.text(of.file).partition(f"type {of.short_name} ")[2].partition(";")[0] if of else ""
    found = re.search(r"\bnominal = ([-+.\de]+)", declared)
    return float(found[1]) if found else None


def _terms(e: Any) -> list[Any]:
    """The reference that an expression is, also with a minus before it; else nothing."""
    if isinstance(e, ast.Expression) and str(e.operator) == "-" and len(e.operands) == 1:
        return _terms(e.operands[0])
    return [e] if _is_ref(e) else []


def _inherited_nominal(c: library.Class, name: str) -> bool:
    """Does the class modify a component of its base class so?"""
    given = [library.modifiers(e.class_modification).get(name) for e in c.tree.extends]
    return any(isinstance(g, ast.ClassModification) and "nominal" in library.modifiers(g) for g in given)


def _type_has_nominal(c: library.Class) -> bool:
    declared = library.text(c.file).partition(f"type {c.short_name} ")[2].partition(";")[0]
    return "nominal" in declared


def _unit(c: library.Class, name: str) -> measures.Unit | None:
    """The unit of a component reference in a class; None: not stated."""
    head, _, tail = plain(name).partition(".") if "." not in name else name.partition(".")
    s = library.components(c).get(plain(head))
    if s is None:
        return None
    if not tail:
        if str(s.type) in ("Integer", "Boolean"):
            return measures.NUMBER
        return measures.parsed(library.unit(s, c.name))
    of = library.find(str(s.type), c.name)
    return _unit(of, tail) if of else None


def _pairs(c: library.Class) -> Iterator[tuple[Any, Any, str]]:
    """Both sides of each equation, those in branches included, and each declaration with its value."""
    if c.tree.type not in ("block", "model", "record") or c.name.startswith("HystFMU.Validation"):
        return  # a Validation model drives its component with plain numbers
    for e in [*c.tree.equations, *c.tree.initial_equations]:
        for i in plain_equations(e):
            yield i.left, i.right, f"the equation of {plain(str(i.left)) if _is_ref(i.left) else 'a sum'}"
    for name, s in c.tree.symbols.items():
        given = library.modifiers(s.class_modification).get("value")
        if given is not None and (str(s.type) == "Real" or str(s.type).startswith("Types.")):
            yield ast.ComponentRef(name=name), given, f"the declaration of {name}"


def _is_ref(e: Any) -> bool:
    return isinstance(e, ast.ComponentRef)

"""Rules of the lint on what changes when: parameters, derivatives, old values, words of the language."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from source import declared
from syntax_tree import assigned, calls, plain, references

from hystfmu.modelica.literals import RESERVED

DISCRETE = ("Boolean", "Integer", "String")


def without_value(c: library.Class) -> Iterator[str]:
    """A parameter of a class that can be used has a value: a user sees a default, and nothing starts at 0 unsaid."""
    if c.tree.partial or c.tree.type not in ("model", "block", "record"):
        return
    for name, s in c.tree.symbols.items():
        given = library.modifiers(s.class_modification)
        of = library.find(str(s.type), c.name)
        whole = of is not None and of.tree.type == "record"  # its own parameters have values
        if "parameter" in s.prefixes and "value" not in given and not whole:
            yield f"the parameter {name} has no value"


def der_of_discrete(c: library.Class) -> Iterator[str]:
    """Only a continuous Real has a derivative."""
    events = _at_events(c)
    parts = library.components(c)
    for name in differentiated(c):
        head = parts.get(name)
        fixed = head is not None and {"parameter", "constant", "discrete"} & set(head.prefixes)
        if name in events or fixed or (head is not None and str(head.type) in DISCRETE):
            yield f"der({name}): {name} changes at events only"


def der_of_input(c: library.Class) -> Iterator[str]:
    """Nothing differentiates an input or the output of a component: it may jump at an event of what drives it."""
    ports = library.ports(c, "RealInput")
    for name in differentiated(c):
        if name in ports or "." in name:
            yield f"der({name}): what drives {name} may jump at an event"


def pre_of_continuous(c: library.Class) -> Iterator[str]:
    """pre, edge and change are of discrete variables, outside `when` in any case."""
    events = _at_events(c)
    parts = library.components(c)
    for e in [*c.tree.equations, *c.tree.initial_equations]:
        for call in [x for f in ("pre", "edge", "change") for x in calls(e, f)]:
            for name in {plain(r) for r in references(call)} & set(parts):
                s = parts[name]
                if name not in events and "discrete" not in s.prefixes and str(s.type) not in DISCRETE:
                    yield f"{call.operator}({name}): {name} is continuous"


def undeclared_discrete(c: library.Class) -> Iterator[str]:
    """A Real of a class itself that `when` assigns says that it is discrete; a port says it by its equation."""
    ports = library.ports(c, "RealOutput")
    for name in sorted(_at_events(c) & set(c.tree.symbols)):
        s = c.tree.symbols[name]
        if "discrete" not in s.prefixes and str(s.type) not in DISCRETE and name not in ports:
            yield f"{name} is assigned in a when-equation and not declared discrete"


def keyword(c: library.Class) -> Iterator[str]:
    """No component and no class has the name of a word of the language or of a built-in function."""
    for name in [*c.tree.symbols, *c.tree.classes]:
        if name in RESERVED:
            yield f"{name} is a word of the language"


def twice(c: library.Class) -> Iterator[str]:
    """No element has the name of an inherited one."""
    inherited = {n for e in c.tree.extends if (b := library.find(str(e.component), c.name)) for n in _members(b)}
    redeclared = {n for n, e in declared(c).items() if re.match(r"\s*redeclare\b", e.text)}
    for name in sorted((set(c.tree.symbols) - redeclared) & inherited):
        yield f"{name} is declared in a base class too"


RULES = (
    without_value, der_of_discrete, der_of_input, pre_of_continuous, undeclared_discrete, keyword, twice,
)  # fmt: skip


def _at_events(c: library.Class) -> set[str]:
    """What the when-equations of a class and of its base classes assign."""
    found = {n for e in c.tree.equations if isinstance(e, ast.WhenEquation) for n in assigned(e)}
    bases = [library.find(str(e.component), c.name) for e in c.tree.extends]
    return found.union(*(_at_events(b) for b in bases if b))


def differentiated(c: library.Class) -> list[str]:
    """Names that the class differentiates."""
    found: list[Any] = [x for e in [*c.tree.equations, *c.tree.initial_equations] for x in calls(e, "der")]
    bindings = [e for s in c.tree.symbols.values() for e in library.modifiers(s.class_modification).values()]
    found += [x for e in bindings for x in calls(e, "der")]
    return sorted({plain(r) for x in found for r in references(x.operands)})


def _members(c: library.Class) -> set[str]:
    return set(library.components(c))

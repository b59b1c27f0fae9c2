"""Rules of the lint on what changes when: parameters, derivatives, old values, starts, words of the language."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from source import declared
from syntax_tree import assigned, calls, plain, references, text_of, with_bases

from hystfmu.modelica.literals import RESERVED

DISCRETE = ("Boolean", "Integer", "String")
RELATIONS = ("<", ">", "<=", ">=")


def without_value(c: library.Class) -> Iterator[str]:
    """A parameter of a class that can be used has a value: a user sees a default, and nothing starts at 0 unsaid."""
    if c.tree.partial or c.tree.type not in ("model", "block", "record"):
        return
    for name, s in c.tree.symbols.items():
        given = library.modifiers(s.class_modification)
        of = library.find(str(s.type), c.name)
        whole = of is not None and of.tree.type == "record"  # its own parameters have values
        solved = not getattr(given.get("fixed"), "value", True)  # an initial equation has it
        if "parameter" in s.prefixes and "value" not in given and not whole and not solved:
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


def reinit_at_start(c: library.Class) -> Iterator[str]:
    """No reinit at initial(): tools take the assignments of such a when into the initial equations, and drop it."""
    for e in _whens(c.tree.equations):
        for condition, block in zip(e.conditions, e.blocks, strict=False):
            if calls(condition, "initial"):
                for i in block:
                    if str(getattr(i, "name", "")) == "reinit":
                        yield f"reinit({i.arguments[0]}) at initial(): use an initial equation"


def fixed_start_time(c: library.Class) -> Iterator[str]:
    """A simulation may start at any time: samples begin there, and no relation tells the first one by the time."""
    if c.name.startswith("HystFMU.Validation"):
        return  # its inputs are functions of the time from 0
    of_samples = [x for k in with_bases(c) for e in k.tree.equations for x in calls(e, "sample") if len(x.operands) > 1]
    periods = {"Ts", *(r for x in of_samples for r in references(x.operands[1]))}
    for x in of_samples:
        if not list(references(x.operands[0])):
            yield f"samples begin at time {getattr(x.operands[0], 'value', '')}: a simulation may start later or before"
    places = [*c.tree.equations, *(e for s in c.tree.symbols.values() for e in _values(s))]
    for relation in [x for f in RELATIONS for e in places for x in calls(e, f)]:
        read = set(references(relation))
        if "time" in read and read & periods:
            yield f"time is compared with {', '.join(sorted(read & periods))}: a simulation may start at any time"


def open_start(c: library.Class) -> Iterator[str]:
    """What a sample assigns has a value before it: else the initial conditions are not fully specified."""
    texts = "".join(text_of(k) for k in with_bases(c))
    for e in _whens(c.tree.equations):
        if any(calls(condition, "sample") for condition in e.conditions):
            for name in sorted(set(assigned(e))):
                if not re.search(rf"\b{name}\b(?:\[[^;]*?\])?\s*\([^;]*?\bstart\s*=[^;]*?\bfixed\s*=", texts):
                    yield f"a sample assigns {name}, which has no start value that is fixed"


RULES = (
    without_value, der_of_discrete, der_of_input, pre_of_continuous, undeclared_discrete, keyword, twice,
    reinit_at_start, fixed_start_time, open_start,
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


def _whens(found: list[Any]) -> Iterator[ast.WhenEquation]:
    """When-equations, those in branches and loops included."""
    for e in found:
        if isinstance(e, ast.WhenEquation):
            yield e
        for block in getattr(e, "blocks", None) or [getattr(e, "equations", [])]:
            yield from _whens(block)


def _values(s: ast.Symbol) -> list[Any]:
    return [v for k, v in library.modifiers(s.class_modification).items() if k == "value"]

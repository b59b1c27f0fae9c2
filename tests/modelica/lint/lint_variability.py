"""Rules of the lint on what changes when: parameters, derivatives, old values, starts, words of the language."""

import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from source import declared
from syntax_tree import assigned, calls, class_of, inside, nested, plain, references, text_of, with_bases

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


def der_of_input(c: library.Class) -> Iterator[str]:
    """Nothing differentiates an input or the output of a component: it may jump at an event of what drives it."""
    ports = library.ports(c, "RealInput")
    for name in differentiated(c):
        if name in ports or "." in name:
            yield f"der({name}): what drives {name} may jump at an event"


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
    for e in (e for e in nested(c.tree.equations) if isinstance(e, ast.WhenEquation)):
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
    for e in (e for e in nested(c.tree.equations) if isinstance(e, ast.WhenEquation)):
        if any(calls(condition, "sample") for condition in e.conditions):
            for name in sorted(set(assigned(e))):
                if not re.search(rf"\b{name}\b(?:\[[^;]*?\])?\s*\([^;]*?\bstart\s*=[^;]*?\bfixed\s*=", texts):
                    yield f"a sample assigns {name}, which has no start value that is fixed"


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


def _values(s: ast.Symbol) -> list[Any]:
    return [v for k, v in library.modifiers(s.class_modification).items() if k == "value"]


# ---- Rules of the lint on types and variability of expressions: what is whole, what is a text, what may change
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
    for loop in nested([*c.tree.equations, *c.tree.initial_equations, *c.tree.statements]):
        for i in loop.indices if isinstance(loop, ast.ForEquation | ast.ForStatement) else ():
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


def start_unfixed(c: library.Class) -> Iterator[str]:
    """A state that has a start value says whether the solver must keep it."""
    for name in differentiated(c):
        s = c.tree.symbols.get(name)
        given = library.modifiers(s.class_modification) if s is not None else {}
        if "start" in given and "fixed" not in given:
            yield f"the state {name} has a start value, and does not say whether it is fixed"


def kind(e: Any, c: library.Class) -> str | None:
    """Integer, Real, Boolean or String; None where that is not known."""
    if isinstance(e, ast.Primary):
        return {bool: "Boolean", int: "Integer", float: "Real", str: "String"}.get(type(e.value))
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


RULES = (
    without_value, der_of_input, undeclared_discrete, keyword, twice, reinit_at_start, fixed_start_time, open_start,
    real_as_integer, string_sum, higher_variability, start_unfixed,
)  # fmt: skip

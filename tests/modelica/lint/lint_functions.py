"""Rules of the lint on functions: pure, every output assigned, nothing read before it is set, smoothness said."""

import functools
import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from source import own_annotation
from syntax_tree import calls, inside, is_array, nested, plain, references

EVENTS = ("der", "pre", "edge", "change", "sample", "initial", "terminal", "reinit", "delay", "Clock")


def equation_in_function(c: library.Class) -> Iterator[str]:
    """A function has one algorithm and no equation."""
    if c.tree.type == "function" and (c.tree.equations or c.tree.initial_equations):
        yield "is a function and has equations"


def unassigned_output(c: library.Class) -> Iterator[str]:
    """Every output of a function that is not partial gets a value."""
    if c.tree.type != "function" or c.tree.partial or not c.tree.statements:
        return
    given = _targets(c.tree.statements)
    for name, s in library.components(c).items():
        if "output" in s.prefixes and name not in given and "value" not in library.modifiers(s.class_modification):
            yield f"its output {name} is never assigned"


def assigned_argument(c: library.Class) -> Iterator[str]:
    """The inputs of a function are not assigned."""
    if c.tree.type == "function":
        inputs = {n for n, s in library.components(c).items() if "input" in s.prefixes}
        for name in sorted(inputs & _targets(c.tree.statements)):
            yield f"its input {name} is assigned"


def event_in_function(c: library.Class) -> Iterator[str]:
    """Nothing in a function depends on time: no der, pre, sample, initial."""
    if c.tree.type == "function":
        for name in EVENTS:
            if any(calls(s, name) for s in c.tree.statements):
                yield f"calls {name}()"


def used_unset(c: library.Class) -> Iterator[str]:
    """A protected variable of a function is set before it is read."""
    if c.tree.type != "function":
        return
    unset = {
        n
        for n, s in c.tree.symbols.items()
        if "input" not in s.prefixes and "value" not in library.modifiers(s.class_modification)
    }
    for read, written in _order(c.tree.statements):
        for name in sorted(unset & read):
            yield f"{name} is read before it is set"
        unset -= read | written


def without_smoothness(c: library.Class) -> Iterator[str]:
    """A function that a continuous equation calls says how smooth it is; a memory is continuous, no more."""
    if c.tree.type != "function" or not c.name.startswith("HystFMU.Functions."):
        return
    annotation = own_annotation(c)
    said = re.search(r"\b(?:smoothOrder|derivative)\s*[(=]|<b>Smoothness:</b>", annotation)
    if not said and c.short_name in _continuous():
        yield "a continuous equation calls it, and it says neither smoothOrder nor derivative nor what jumps"


def false_inverse(c: library.Class) -> Iterator[str]:
    """The inverse that a function names exists, and takes its output."""
    for argument, of, given in re.findall(r"\binverse\s*\(\s*(\w+)\s*=\s*([\w.]+)\(([^)]*)\)", own_annotation(c)):
        found = library.find(of, c.name)
        outputs = {n for n, s in c.tree.symbols.items() if "output" in s.prefixes}
        if found is None or found.tree.type != "function":
            yield f"its inverse {of} does not exist"
        elif argument not in c.tree.symbols or not outputs & {g.strip() for g in given.split(",")}:
            yield f"its inverse {of} does not give {argument} for its output"


@functools.cache
def _continuous() -> set[str]:
    """Functions that equations outside `when`, or the functions called there, use."""
    called: set[str] = set()
    for c in library.classes().values():
        if c.tree.type in ("block", "model") and not c.name.startswith("HystFMU.Validation"):
            for e in c.tree.equations:
                if not isinstance(e, ast.WhenEquation | ast.ConnectClause) and not _is_assertion(e):
                    called |= set(_functions(e))
    return called


def _is_assertion(e: Any) -> bool:
    return isinstance(e, ast.Function) and str(e.name) == "assert"


def _functions(e: Any) -> Iterator[str]:
    """Short names of the functions of the library that an expression calls."""
    if isinstance(e, ast.Expression) and "Functions." in str(e.operator):
        yield str(e.operator).rsplit(".", 1)[-1]
    for inner in inside(e):
        yield from _functions(inner)


def _assigned(statements: list[Any]) -> Iterator[Any]:
    """References that statements assign, in their order."""
    for s in nested(statements):
        if isinstance(s, ast.AssignmentStatement):
            yield from s.left


def _targets(statements: list[Any]) -> set[str]:
    return {plain(str(left)) for left in _assigned(statements)}


def _order(statements: list[Any]) -> Iterator[tuple[set[str], set[str]]]:
    """What each statement reads and sets, in the order of the text; branches count as set."""
    for s in nested(statements):
        if isinstance(s, ast.AssignmentStatement):
            yield {plain(r) for r in references(s.right)}, {plain(str(left)) for left in s.left}
        else:
            yield {plain(r) for r in references(getattr(s, "conditions", []))}, set()


# ---- Rules of the lint on legal Modelica that rumoca 0.10.2 silently simulates wrongly
def lost_elements(c: library.Class) -> Iterator[str]:
    """Elements of a protected array, set within an if of a function, are lost unless it has a value as a whole."""
    if c.tree.type != "function":
        return
    arrays = {n for n, s in c.tree.symbols.items() if is_array(s) and not {"input", "output"} & set(s.prefixes)}
    arrays -= {n for n in arrays if "value" in library.modifiers(c.tree.symbols[n].class_modification)}
    for left in _assigned(c.tree.statements):
        if left.name in arrays:
            arrays.discard(left.name)
            if any(i is not None for row in left.indices for i in row):
                yield f"the elements of {left.name} are set before {left.name} as a whole"


def redeclared_function(c: library.Class) -> Iterator[str]:
    """The redeclaration of a function in a component or base class is ignored where another function calls it."""
    changed = [(n, s.class_modification) for n, s in c.tree.symbols.items()]
    changed += [(str(e.component), e.class_modification) for e in c.tree.extends]
    for name, modification in changed:
        for a in modification.arguments if modification else []:
            if isinstance(a.value, ast.ShortClassDefinition) and a.value.type == "function":
                yield f"{name} redeclares the function {a.value.name}"


RULES = (
    equation_in_function, unassigned_output, assigned_argument, event_in_function, used_unset, without_smoothness,
    false_inverse, lost_elements, redeclared_function,
)  # fmt: skip

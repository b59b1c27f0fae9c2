"""Rules of the lint on legal Modelica that rumoca 0.10.2 silently simulates wrongly."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from syntax_tree import is_array


def lost_elements(c: library.Class) -> Iterator[str]:
    """Elements of a protected array, set within an if of a function, are lost unless it has a value as a whole."""
    if c.tree.type != "function":
        return
    arrays = {n for n, s in c.tree.symbols.items() if is_array(s) and not {"input", "output"} & set(s.prefixes)}
    arrays -= {n for n in arrays if "value" in library.modifiers(c.tree.symbols[n].class_modification)}
    for left in _targets(c.tree.statements):
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


def _targets(statements: list[Any]) -> Iterator[Any]:
    """What statements assign, in their order."""
    for s in statements:
        if isinstance(s, ast.AssignmentStatement):
            yield from s.left
        for block in getattr(s, "blocks", None) or [getattr(s, "statements", [])]:
            yield from _targets(block)


RULES = (lost_elements, redeclared_function)

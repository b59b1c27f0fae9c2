"""Rules of the lint on if and when: where they stand, and that their branches define the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from lint_values import changes
from syntax_tree import plain, references

WHEN = (ast.WhenEquation, ast.WhenStatement)
ADJUSTABLE = {"constant", "parameter"}


def misplaced_when(c: library.Class) -> Iterator[str]:
    """No when in a when, in an initial section or in a function."""
    if any(isinstance(e, WHEN) for e in _all([*c.tree.initial_equations, *c.tree.initial_statements])):
        yield "has a when in an initial section"
    if c.tree.type == "function" and any(isinstance(s, WHEN) for s in _all(c.tree.statements)):
        yield "is a function and has a when-statement"
    for e in _all([*c.tree.equations, *c.tree.statements]):
        if isinstance(e, WHEN) and any(isinstance(i, WHEN) for block in e.blocks for i in _all(block)):
            yield "has a when in a when"


def when_branches(c: library.Class) -> Iterator[str]:
    """Each branch of a when-equation, and of an if in it, defines the same variables."""
    for e in _all(c.tree.equations):
        if isinstance(e, ast.WhenEquation):
            yield from _unlike(e)
            for i in _all([x for block in e.blocks for x in block]):
                if isinstance(i, ast.IfEquation) and not _adjustable(i, c):
                    yield from _unlike(i)


def if_branches(c: library.Class) -> Iterator[str]:
    """An if-equation that switches in a run has as many equations in each branch, an else included."""
    for e in c.tree.equations:
        if isinstance(e, ast.IfEquation) and not _adjustable(e, c):
            counts = [sum(isinstance(i, ast.Equation) for i in block) for block in e.blocks]
            counts += [0] * (len(e.conditions) + 1 - len(e.blocks) if not _has_else(e) else 0)
            if len(set(counts)) > 1:
                yield f"the branches of an if-equation have {', '.join(map(str, counts))} equations"


def misplaced_connect(c: library.Class) -> Iterator[str]:
    """A connection stands in no when, and in no if that switches in a run."""
    for e in _all(c.tree.equations):
        switching = isinstance(e, ast.WhenEquation) or (isinstance(e, ast.IfEquation) and not _adjustable(e, c))
        if switching and any(isinstance(i, ast.ConnectClause) for block in e.blocks for i in _all(block)):
            yield "has a connection that begins or ends in a run"


RULES = (misplaced_when, when_branches, if_branches, misplaced_connect)


def _all(found: list[Any]) -> Iterator[Any]:
    """Equations or statements with those in branches and loops."""
    for e in found:
        yield e
        for block in getattr(e, "blocks", None) or [getattr(e, "equations", []) or getattr(e, "statements", [])]:
            yield from _all(block)


def _adjustable(e: ast.IfEquation, c: library.Class) -> bool:
    """Do all conditions follow from parameters?"""
    return not any(changes(r, c, ADJUSTABLE) for r in references(e.conditions))


def _has_else(e: Any) -> bool:
    """The second parser has True as the condition of else."""
    last = e.conditions[-1] if e.conditions else None
    return len(e.blocks) > len(e.conditions) or last is True or getattr(last, "value", None) is True


def _unlike(e: Any) -> Iterator[str]:
    sets = [
        {plain(r) for i in _all(block) if isinstance(i, ast.Equation) for r in references(i.left)} for block in e.blocks
    ]
    if any(s != sets[0] for s in sets):
        yield f"branches define {' or '.join(', '.join(sorted(s)) or 'nothing' for s in sets)}"

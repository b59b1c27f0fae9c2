"""Rules of the lint on numbers of unknowns and equations: each class is balanced, each connector too."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import prod
from typing import Any

import library
import pymoca.ast as ast
from shapes import (
    Scope,
    UnknownSizeError,
    class_of,
    direction,
    is_causal,
    modified,
    present,
    scope_of,
    shape,
    size_of,
    value_of,
)
from syntax_tree import plain


def flow_balance(c: library.Class) -> Iterator[str]:
    """A connector has as many flow variables as potentials."""
    if c.tree.type != "connector":
        return
    flows = [n for n, s in c.tree.symbols.items() if "flow" in s.prefixes]
    potentials = [
        n for n, s in c.tree.symbols.items() if not {"flow", "input", "output", "parameter", "stream"} & set(s.prefixes)
    ]
    if len(flows) != len(potentials):
        yield f"{len(flows)} flow variables and {len(potentials)} potentials"


def unbalanced(c: library.Class) -> Iterator[str]:
    """As many equations as unknowns in a block or model itself; its components are balanced by the same rule."""
    if c.tree.type not in ("block", "model") or c.tree.partial:
        return
    try:
        unknowns, equations = count(c)
    except (UnknownSizeError, NotImplementedError) as e:
        yield f"its equations are not counted: {' '.join(str(e).split())[:80]}"
        return
    if unknowns != equations:
        yield f"{equations} equations for {unknowns} unknowns"


RULES = (flow_balance, unbalanced)


def count(c: library.Class) -> tuple[int, int]:
    """Unknowns and equations of a class, for the defaults of its parameters; inputs and flows count as given.

    Raises
    ------
    UnknownSizeError
        A size does not follow from them.
    """
    scope = scope_of(c)
    unknowns = equations = 0
    links = Links()
    for name, s in present(c, scope).items():
        if {"parameter", "constant"} & set(s.prefixes):
            continue
        n = prod(shape(s, scope))
        of = class_of(s, c)
        outside = s.visibility.name == "PUBLIC"
        value = library.modifiers(s.class_modification).get("value")
        if of is None or of.tree.type in ("type", "record") or is_causal(of):
            given = direction(s, of) == "input" and outside
            unknowns += n if of is None or of.tree.type != "record" else 0
            equations += n if given or value is not None else 0
        elif of.tree.type == "connector":
            flows = sum("flow" in v.prefixes for v in of.tree.symbols.values())
            unknowns += n * len(of.tree.symbols)
            equations += n * flows if outside else 0
        else:  # a component: its inputs and flows are unknown, the rest of it is balanced
            inner = scope_of(of) | modified(s, scope)
            for port, p in present(of, inner).items():
                kind = class_of(p, of)
                if p.visibility.name != "PUBLIC" or kind is None or kind.tree.type != "connector":
                    continue
                size = n * prod(shape(p, inner))
                if is_causal(kind) and direction(p, kind) == "input":
                    unknowns += size
                elif kind.tree.type == "connector" and not is_causal(kind):
                    unknowns += size * sum("flow" in v.prefixes for v in kind.tree.symbols.values())
                    links.inside(f"{name}.{port}")
    for e in _all_equations(c):
        equations += _equations(e, c, scope, links)
    return unknowns, equations + links.equations()


class Links:
    """Sets of physical connectors that are joined; each has two variables, a potential and a flow."""

    def __init__(self) -> None:
        self.sets: list[set[str]] = []
        self.own: set[str] = set()

    def inside(self, end: str) -> None:
        """A connector of a component: alone, its flow is 0."""
        self.sets.append({end})
        self.own.add(end)

    def join(self, a: str, b: str) -> None:
        """A connection."""
        joined = [s for s in self.sets if {a, b} & s]
        self.sets = [s for s in self.sets if s not in joined] + [{a, b}.union(*joined)]

    def equations(self) -> int:
        """Equal potentials and the sum of flows of every set."""
        return sum(len(s) - 1 + 1 for s in self.sets)


def _equations(e: Any, c: library.Class, scope: Scope, links: Links) -> int:
    """Number of scalar equations in an equation."""
    if isinstance(e, ast.ConnectClause):
        return _connection(e, c, scope, links)
    if isinstance(e, ast.WhenEquation):
        return sum(_equations(i, c, scope, links) for i in e.blocks[0])
    if isinstance(e, ast.IfEquation):
        return sum(_equations(i, c, scope, links) for i in e.blocks[0])
    if isinstance(e, ast.ForEquation):
        total, indices = 0, e.indices
        first, last = (value_of(x, scope) for x in (indices[0].expression.start, indices[0].expression.stop))
        for i in range(int(first), int(last) + 1):
            total += sum(_equations(x, c, scope | {indices[0].name: i}, links) for x in e.equations)
        return total
    if not isinstance(e, ast.Equation):
        return 0  # assert, terminate
    left, right = size_of(e.left, c, scope), size_of(e.right, c, scope)
    if left is None:
        left = right
    if left is None:
        raise UnknownSizeError(str(e))
    return left if right is None else max(left, right)


def _connection(e: ast.ConnectClause, c: library.Class, scope: Scope, links: Links) -> int:
    ends = [re.sub(r"\s", "", str(x)) for x in (e.left, e.right)]
    kinds = [_port(x, c, scope) for x in ends]
    if None in kinds:
        return 0  # to a conditional component that is not there
    if not is_causal(kinds[0]):  # type: ignore[arg-type]
        links.join(*ends)
        return 0
    size = size_of(e.left, c, scope)
    if size is None:
        raise UnknownSizeError(str(e))
    return size


def _port(end: str, c: library.Class, scope: Scope) -> library.Class | None:
    head, _, tail = end.partition(".")
    s = present(c, scope).get(plain(head))
    of = class_of(s, c) if s is not None else None
    if s is None or of is None:
        return None
    return _port(tail, of, scope_of(of) | modified(s, scope)) if tail else of


def _all_equations(c: library.Class) -> Iterator[Any]:
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None:
            yield from _all_equations(base)
    yield from c.tree.equations

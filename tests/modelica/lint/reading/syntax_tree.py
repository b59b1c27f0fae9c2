"""Looking into the tree of a class: its own text, what its equations assign and refer to."""

import functools
import re
from collections.abc import Iterable, Iterator
from typing import Any

import library
import pymoca.ast as ast

KIND = r"(?:package|function|block|model|record|type|connector)"


def text_of(c: library.Class) -> str:
    """The source of one class: from its declaration to its end, without the classes below it."""
    return _text_of(library.text(c.file), c.short_name, tuple(c.tree.classes), c.name)


@functools.cache  # every rule of the lint asks for it
def _text_of(body: str, short_name: str, below: tuple[str, ...], name: str) -> str:
    start = re.search(rf"\b{KIND} (?:extends )?{short_name}\b", body)
    assert start, f"{name}: not found in its file"
    end = re.search(rf"\bend {short_name};", body[start.start() :])
    stop = start.start() + end.end() if end else body.index(";", body.index("annotation", start.start()))
    body = body[start.start() : stop]
    for inner in below:
        long, short = (
            rf"\b{KIND} (?:extends )?{inner} \".*?\bend {inner};",
            rf"\b(?<!replaceable ){KIND} {inner} =.*?Documentation\(info.*?\)\);",
        )
        body = re.sub(f"{long}|{short}", "", body, flags=re.S)
    return body


def with_bases(c: library.Class) -> Iterator[library.Class]:
    """A class, and those that it extends."""
    yield c
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None:
            yield from with_bases(base)


def is_array(s: ast.Symbol) -> bool:
    return any(not (isinstance(d, ast.Primary) and d.value is None) for row in s.dimensions for d in row)


def assigned(e: Any) -> Iterator[str]:
    """Plain names on the left of an equation and of all equations in it."""
    if isinstance(e, ast.Equation):
        if isinstance(e.left, ast.ComponentRef) and "." not in str(e.left):
            yield str(e.left)
        return
    for block in getattr(e, "blocks", []) or [getattr(e, "equations", [])]:
        for inner in block:
            yield from assigned(inner)


def nested(found: Iterable[Any]) -> Iterator[Any]:
    """Equations or statements with those in branches and loops."""
    for e in found:
        yield e
        for block in getattr(e, "blocks", None) or [getattr(e, "equations", []) or getattr(e, "statements", [])]:
            yield from nested(block)


def plain_equations(e: Any) -> list[ast.Equation]:
    """The plain equations in an equation, those in branches and loops included."""
    return [i for i in nested([e]) if isinstance(i, ast.Equation)]


def references(e: Any) -> Iterator[str]:
    """Every component reference in an equation or expression."""
    if isinstance(e, ast.ComponentRef):
        yield str(e)
        return
    for inner in inside(e):
        yield from references(inner)


def inside(e: Any) -> Iterator[Any]:
    """The parts of a node of the tree."""
    if isinstance(e, list | tuple):
        yield from e
    elif isinstance(e, ast.Node):
        yield from (v for k, v in vars(e).items() if k not in ("parent", "scope", "operator"))


def calls(e: Any, function: str) -> list[Any]:
    """Every call of a built-in function in an expression."""
    if isinstance(e, ast.Expression) and str(e.operator) == function:
        return [e]
    return [c for i in inside(e) for c in calls(i, function)]


def plain(reference: str) -> str:
    """A reference without its indices."""
    return re.sub(r"\[.*", "", reference)


# ---- Sizes in a class for the defaults of its parameters: which components there are, and how many scalars they have
PRIMITIVE = ("Real", "Integer", "Boolean")


def lineage(c: library.Class) -> Iterator[library.Class]:
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None:
            yield from lineage(base)
    yield c


def class_of(s: ast.Symbol, c: library.Class) -> library.Class | None:
    """The class of a component, by its name as written where it is declared; None for a built-in type."""
    if str(s.type) in PRIMITIVE:
        return None
    where = next((k for k in lineage(c) if k.tree.symbols.get(s.name) is s), c)
    return library.find(str(s.type), where.name)


def is_causal(c: library.Class) -> bool:
    return c.tree.type == "connector" and not c.tree.symbols

"""The Modelica library as text and as pymoca sees it: classes, their parameters and ports, values of expressions."""

import contextlib
import functools
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pymoca.ast as ast
import pymoca.parser

Symbol = ast.Symbol
ROOT = Path(__file__).resolve().parents[2] / "modelica" / "HystFMU"
BUILT_IN = {"Real", "Integer", "Boolean", "String", "StateSelect", "Clock"}


@dataclass(frozen=True)
class Class:
    """One class of the library: its qualified name, the file it stands in, the tree below it."""

    name: str
    file: Path
    tree: ast.Class

    @property
    def short_name(self) -> str:
        return self.name.rsplit(".", 1)[-1]


def files() -> list[Path]:
    return sorted(ROOT.rglob("*.mo"))


@functools.cache
def text(file: Path) -> str:
    return file.read_text()


@functools.cache
def classes() -> dict[str, Class]:
    """Every class by its qualified name, as the second parser reads it and keeps it for other processes."""
    # of two test processes one starts at the end, so that each parses half of the files and finds the others parsed
    backwards = os.environ.get("PYTEST_XDIST_WORKER") == "gw1"
    found = {file: list(read(file)) for file in (reversed(files()) if backwards else files())}
    return {c.name: c for file in files() for c in found[file]}


def read(file: Path) -> Iterator[Class]:
    """The classes of one file."""
    tree = pymoca.parser.parse(text(file))
    assert tree is not None, f"{file.name}: pymoca finds a syntax error"
    within = _within(file)
    for name in within.split(".") if within else []:
        tree = tree.classes[name]
    yield from _below(tree, within, file)


@contextlib.contextmanager
def beside(package: Path) -> Iterator[list[Class]]:
    """For the time of a with-statement, the classes of another package are found too."""
    more = {c.name: c for file in sorted(package.glob("*.mo")) for c in read(file)}
    classes().update(more)
    try:
        yield list(more.values())
    finally:
        for name in more:
            del classes()[name]
        text.cache_clear()


def _within(file: Path) -> str:
    m = re.search(r"^within ([\w.]+);", text(file), re.M)
    return m[1] if m else ""


def _below(tree: ast.Class, prefix: str, file: Path) -> Iterator[Class]:
    for name, c in tree.classes.items():
        if name not in BUILT_IN:
            qualified = f"{prefix}.{name}" if prefix else name
            yield Class(qualified, file, c)
            yield from _below(c, qualified, file)


def find(name: str, scope: str) -> Class | None:
    """A class by a name as written inside `scope`; None for a built-in type."""
    packages = scope.split(".")
    for k in range(len(packages), -1, -1):
        qualified = ".".join([*packages[:k], name])
        if qualified == scope:  # redeclare function extends f: the f that its package inherits
            enclosing = ".".join(packages[:k])
            bases = [find(str(e.component), enclosing) for e in classes()[enclosing].tree.extends]
            return next((classes()[f"{b.name}.{name}"] for b in bases if b and f"{b.name}.{name}" in classes()), None)
        if qualified in classes():
            return classes()[qualified]
    return None


def components(c: Class) -> dict[str, ast.Symbol]:
    """The components of a class, those of its base classes first."""
    found: dict[str, ast.Symbol] = {}
    for e in c.tree.extends:
        base = find(str(e.component), c.name)
        if base is not None:
            found |= components(base)
    return found | dict(c.tree.symbols)


def modifiers(arguments: ast.ClassModification | None) -> dict[str, Any]:
    """Name of the attribute or component -> expression; the binding has the name `value`."""
    if arguments is None:
        return {}
    values = [a.value for a in arguments.arguments if getattr(a.value, "modifications", None)]  # not a redeclaration
    return {str(v.component): v.modifications[0] for v in values}


def unit(symbol: ast.Symbol, scope: str) -> str:
    """The unit of a component: its own, else that of its type; "" if neither has one."""
    own = modifiers(symbol.class_modification).get("unit")
    if own is not None:
        return str(own.value)
    typed = find(str(symbol.type), scope)
    m = typed and re.search(rf'type {typed.short_name} = Real\([^)]*unit = "([^"]*)"', text(typed.file))
    return m[1] if m else ""


def evaluate(e: Any, scope: Mapping[str, Any]) -> Any:
    """The value of a parameter expression: numbers, words of enumerations, arrays."""
    if isinstance(e, ast.Primary):
        return e.value
    if isinstance(e, ast.Array):
        return np.array([evaluate(v, scope) for v in e.values])
    if isinstance(e, ast.ComponentRef):
        name = str(e)
        return scope[name] if name in scope else name.rsplit(".", 1)[-1]
    if isinstance(e, ast.IfExpression):
        taken = [x for c, x in zip(e.conditions, e.expressions, strict=False) if evaluate(c, scope)]
        return evaluate(taken[0] if taken else e.expressions[-1], scope)
    args = [evaluate(v, scope) for v in e.operands]
    match str(e.operator), args:
        case "-", [a]:
            return -a
        case "+", [a, b]:
            return a + b
        case "-", [a, b]:
            return a - b
        case "*", [a, b]:
            return a * b
        case "/", [a, b]:
            return a / b
        case "max", [a]:
            return np.max(a)
        case "max", [a, b]:
            return max(a, b)
        case "min", [a, b]:
            return min(a, b)
        case "size", [a, k]:
            return np.shape(a)[k - 1]
        case "div", [a, b]:
            return int(a // b)
        case "^", [a, b]:
            return a**b
        case "sqrt", [a]:
            return np.sqrt(a)
        case "==", [a, b]:
            return a == b
        case "identity", [n]:
            return np.eye(n)
        case "fill", [a, *shape]:
            return np.full(shape, a)
        case ("zeros" | "ones") as f, shape:
            return np.full(shape, float(f == "ones"))
        case "linspace", [a, b, n]:
            return np.linspace(a, b, n)
    raise NotImplementedError(f"parameter expression {e}")


def parameters(c: Class) -> dict[str, Any]:
    """Public parameters of a class with their default values, in the order of declaration."""
    scope: dict[str, Any] = {}
    fields: dict[str, Any] = {}  # of records among the components
    for name, s in components(c).items():
        typed = find(str(s.type), c.name)
        if typed is not None and typed.tree.type == "record":
            fields |= {f"{name}.{k}": v for k, v in parameters(typed).items()}
    for name, s in components(c).items():
        binding = modifiers(s.class_modification).get("value")
        if binding is not None and "parameter" in s.prefixes and s.visibility.name == "PUBLIC":
            scope[name] = evaluate(binding, fields | scope)
    return scope


def ports(c: Class, kind: str) -> dict[str, ast.Symbol]:
    """The public components of a class that are connectors RealInput or RealOutput."""
    parts = components(c).items()
    return {n: s for n, s in parts if str(s.type) == f"Interfaces.{kind}" and s.visibility.name == "PUBLIC"}


def experiment(c: Class) -> dict[str, float]:
    """StopTime, Interval and Tolerance of a model that can be simulated."""
    return experiment_of(text(c.file))


def experiment_of(body: str) -> dict[str, float]:
    """The same from the text of a file."""
    m = re.search(r"experiment\(([^)]*)\)", body)
    assert m, "no experiment annotation"
    return {k.strip(): float(v) for k, v in (item.split("=") for item in m[1].split(","))}

"""Rules of the lint on base classes, modifiers and redeclarations: what may be changed from outside, and by what."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import library
import pymoca.ast as ast
from shapes import class_of, is_causal, lineage
from source import declared, elements
from syntax_tree import KIND, text_of

_BASES = {
    "package": {"package"},
    "function": {"function"},
    "record": {"record"},
    "type": {"type"},
    "connector": {"connector", "record", "type"},
    "block": {"block", "record"},
    "model": {"model", "block", "record"},
}  # of the Modelica Language Specification 3.6, section 7.1.3
_FINAL = re.compile(r"\bfinal (\w+)\s*[=(]")


def final_modified(c: library.Class) -> Iterator[str]:
    """What a class declares as final, or a base class gives it as final, is not modified."""
    for where, of, name in _modified(c):
        if name in _finals(of):
            yield f"{where} modifies {name}, which is final in {of.name}"


def protected_modified(c: library.Class) -> Iterator[str]:
    """A protected element is modified by a derived class only."""
    for where, of, name in _modified(c):
        s = library.components(of).get(name)
        if where != "extends" and s is not None and s.visibility.name != "PUBLIC":
            yield f"{where} modifies {name}, which is protected in {of.name}"


def kind_of_base(c: library.Class) -> Iterator[str]:
    """A block extends no model, a function no block."""
    for e in c.tree.extends:
        base = library.find(str(e.component), c.name)
        if base is not None and base.tree.type not in _BASES.get(c.tree.type, {base.tree.type}):
            yield f"is a {c.tree.type} and extends the {base.tree.type} {base.name}"


def partial_component(c: library.Class) -> Iterator[str]:
    """A partial class stands for a component only where another one replaces it."""
    for name, s in c.tree.symbols.items():
        of = class_of(s, c)
        if of is not None and of.tree.partial and not s.replaceable and not c.tree.partial:
            yield f"{name} is of the partial class {of.name}"


def missing_inner(c: library.Class) -> Iterator[str]:
    """An outer element has an inner one in some class around it."""
    for name, s in c.tree.symbols.items():
        if s.outer and not any(k.tree.symbols[name].inner for k in _all() if name in k.tree.symbols):
            yield f"{name} is outer, and no class has an inner {name}"


def declared_twice(c: library.Class) -> Iterator[str]:
    """Two classes of a package have two names; of two components of one name, the second parser complains."""
    body = library.text(c.file)
    for name in c.tree.classes:
        indents = re.findall(rf"(?:^|;)(\s*)(?:[a-z]+ )*{KIND} {name}\b", body, re.M)
        if any(indents.count(i) > 1 for i in indents):
            yield f"{name} is declared twice"


def public_in_function(c: library.Class) -> Iterator[str]:
    """A public component of a function is an input or an output."""
    if c.tree.type == "function":
        for name, s in c.tree.symbols.items():
            if s.visibility.name == "PUBLIC" and not {"input", "output"} & set(s.prefixes):
                yield f"{name} is public, and neither input nor output"


def block_connector(c: library.Class) -> Iterator[str]:
    """A public connector of a block is an input or an output; flows belong to a model."""
    if c.tree.type == "block":
        for name, s in c.tree.symbols.items():
            of = class_of(s, c)
            physical = of is not None and of.tree.type == "connector" and not is_causal(of)
            if physical and s.visibility.name == "PUBLIC" and not {"input", "output"} & set(s.prefixes):
                yield f"is a block, and its connector {name} is neither input nor output"


def not_replaceable(c: library.Class) -> Iterator[str]:
    """Only what is replaceable is redeclared."""
    for where, of, name, _ in _redeclared(c):
        found = _element(of, name)
        if found is not None and not found.replaceable:
            yield f"{where} redeclares {name}, which is not replaceable in {of.name}"


def not_compatible(c: library.Class) -> Iterator[str]:
    """A redeclared class has all public elements of its constraining class."""
    for where, of, name, given in _redeclared(c):
        new = library.find(given, c.name)
        limit = next((m[1] for k in lineage(of) if (m := _constraint(k, name))), None)
        old = library.find(limit, of.name) if limit else None
        if new is not None and old is not None:
            for lost in sorted(_interface(old) - _interface(new)):
                yield f"{where} redeclares {name} as {new.name}, which has no {lost} of {old.name}"


RULES = (
    final_modified, protected_modified, kind_of_base, partial_component, missing_inner, declared_twice,
    public_in_function, block_connector, not_replaceable, not_compatible,
)  # fmt: skip


def _all() -> list[library.Class]:
    return list(library.classes().values())


def _parts(c: library.Class) -> Iterator[tuple[str, library.Class | None, Any]]:
    """The base classes and the components of a class: how a message calls them, their class, their modifiers."""
    for e in c.tree.extends:
        yield "extends", library.find(str(e.component), c.name), e.class_modification
    for name, s in c.tree.symbols.items():
        yield name, class_of(s, c), s.class_modification


def _modified(c: library.Class) -> Iterator[tuple[str, library.Class, str]]:
    for where, of, modification in _parts(c):
        for name in library.modifiers(modification) if of else ():
            if of is not None and name != "value":
                yield where, of, name


def _redeclared(c: library.Class) -> Iterator[tuple[str, library.Class, str, str]]:
    """Where, the class that has the element, its name, and what replaces it."""
    for where, of, modification in _parts(c):
        for a in modification.arguments if of and modification else []:
            assert of is not None
            if isinstance(a.value, ast.ShortClassDefinition):
                yield where, of, a.value.name, str(a.value.component)
            elif isinstance(a.value, ast.ComponentClause):
                for s in a.value.symbol_list:
                    yield where, of, s.name, str(a.value.type)


def _finals(c: library.Class) -> set[str]:
    """Elements that a class and its base classes make final; for a type, its attributes."""
    if c.tree.type == "type":
        return set(_FINAL.findall(text_of(c)))
    found = {n for k in lineage(c) for n, s in k.tree.symbols.items() if s.final}
    heads = [e.text for k in lineage(c) for e in elements(k) if e.text.strip().startswith("extends")]
    return found.union(*(_FINAL.findall(h) for h in heads))


def _element(c: library.Class, name: str) -> Any:
    """A component or class that a class has or inherits."""
    for k in lineage(c):
        if name in k.tree.classes:
            return k.tree.classes[name]
        if name in k.tree.symbols:
            return k.tree.symbols[name]
    return None


def _constraint(c: library.Class, name: str) -> re.Match[str] | None:
    text = declared(c)[name].text if name in declared(c) else library.text(c.file)
    return re.search(rf"\breplaceable [^;]*?\b{name}\b[^;]*?\bconstrainedby ([\w.]+)", text)


def _interface(c: library.Class) -> set[str]:
    """Public elements of a class with those that it inherits."""
    parts = {n for k in lineage(c) for n, s in k.tree.symbols.items() if s.visibility.name == "PUBLIC"}
    return parts.union(*(k.tree.classes for k in lineage(c)))

"""Rules of the lint on base classes, modifiers and redeclarations: what may be changed from outside, and by what."""

import re
from collections.abc import Iterator
from typing import Any

import library
from syntax_tree import KIND, class_of, is_causal

_BASES = {
    "package": {"package"},
    "function": {"function"},
    "record": {"record"},
    "type": {"type"},
    "connector": {"connector", "record", "type"},
    "block": {"block", "record"},
    "model": {"model", "block", "record"},
}  # of the Modelica Language Specification 3.6, section 7.1.3


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


RULES = (
    protected_modified, kind_of_base, declared_twice, public_in_function, block_connector, flow_balance,
)  # fmt: skip


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

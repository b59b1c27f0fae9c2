"""What rumoca does not notice in a class: one generator of complaints per rule."""

import html
import re
from collections.abc import Callable, Iterator

import library
import lint_annotations
import lint_equations
import lint_functions
import lint_graphics
import lint_inheritance
import lint_units
import lint_variability
import numpy as np
import pymoca.ast as ast
from syntax_tree import is_array, text_of

Rule = Callable[[library.Class], Iterator[str]]
PARTS = (
    lint_equations, lint_graphics, lint_variability, lint_functions, lint_units, lint_inheritance, lint_annotations,
)  # fmt: skip
ARRAY_CALLS = {"fill", "zeros", "ones", "linspace", "cat"}


def complaints(c: library.Class) -> Iterator[str]:
    """Every rule on one class; a message begins with the name of the rule."""
    for rule in rules():
        for message in rule(c):
            yield f"{rule.__name__}: {c.name}: {message}"


def rules() -> list[Rule]:
    """Every rule on a class, each with a row in modelica/rules.toml."""
    own = (undocumented, dead_link, stale_example, without_icon, missing_each, below_min, other_choice)
    return [*own, *(rule for part in PARTS for rule in part.RULES)]


def undocumented(c: library.Class) -> Iterator[str]:
    if c.tree.type == "package" and not c.tree.annotation:
        return  # the parser's view of an enclosing package
    if not c.tree.comment:
        yield "has no description"
    body = text_of(c)
    if "Documentation(info" not in body:
        yield "has no documentation"
    if c.tree.type == "function" or (c.tree.type == "block" and not c.tree.partial):
        if c.name.startswith("HystFMU.Icons"):
            return
        # the functions of a package that stands for a model are explained with it
        whole = c.tree.type == "block" or ".Functions." in c.name
        base = _documented_base(c)
        for heading in ("Equation", "Source", "Limitation", *(("Example", "See also") if whole else ())):
            if f"<b>{heading}" not in body and (heading == "Limitation" or f"<b>{heading}" not in base):
                yield f"its documentation has no {heading}"


def _documented_base(c: library.Class) -> str:
    """Text of the base class of the same name that the documentation links to: it has what the classes share."""
    bases = [library.find(str(e.component), c.name) for e in c.tree.extends]
    own = [b for b in bases if b and b.short_name == c.short_name and f"modelica://{b.name}" in text_of(c)]
    return text_of(own[0]) if own else ""


def missing_each(c: library.Class) -> Iterator[str]:
    names = library.components(c)
    for name, s in c.tree.symbols.items():
        if not is_array(s):
            continue
        for attribute, e in library.modifiers(s.class_modification).items():
            whole = isinstance(e, ast.Array) or (isinstance(e, ast.Expression) and str(e.operator) in ARRAY_CALLS)
            whole |= isinstance(e, ast.ComponentRef) and str(e) in names and is_array(names[str(e)])
            declared = re.search(rf"\b{name}\[[^;]*?\beach\s+{attribute}\b[^;]*;", text_of(c))
            if attribute != "value" and not whole and not declared:
                yield f"{name}[...]({attribute} = ...) needs 'each'"
            if attribute == "value" and isinstance(e, ast.Primary):
                yield f"the array {name} has a scalar value"


def below_min(c: library.Class) -> Iterator[str]:
    if c.tree.type not in ("block", "model", "record"):
        return
    values = library.parameters(c)
    for name, s in library.components(c).items():
        limits = library.modifiers(s.class_modification)
        for limit, sign in (("min", 1), ("max", -1)):
            if name in values and limit in limits:
                bound = library.evaluate(limits[limit], values)
                if np.any(sign * (np.asarray(values[name]) - bound) < 0):
                    yield f"{name} = {values[name]} is beyond its {limit} {bound}"


def dead_link(c: library.Class) -> Iterator[str]:
    for target in re.findall(r"modelica://([\w.]+)", text_of(c)):
        if target not in library.classes():
            yield f"its documentation links to {target}, which does not exist"
    for picture in re.findall(r"modelica://HystFMU/([\w./]+)", text_of(c)):
        if not (library.ROOT / picture).is_file():
            yield f"its documentation shows {picture}, which does not exist"


def stale_example(c: library.Class) -> Iterator[str]:
    """The call that a function shows as its example stands in the class that it names."""
    for call, where in re.findall(r"<b>Example:</b> <code>(.*?)</code> in <a href=\\\"modelica://([\w.]+)", text_of(c)):
        found = library.classes().get(where)
        if found and html.unescape(call) not in " ".join(library.text(found.file).split()):
            yield f"its example {html.unescape(call)} does not stand in {where}"


FRAMES = ("HystFMU.Icons.Frame", "HystFMU.Icons.Component")  # with the name alone, a rectangle that says nothing


def without_icon(c: library.Class) -> Iterator[str]:
    """A class has graphics of its own, or inherits them; a short type has none in Modelica."""
    if c.tree.type in ("type", "__function") or (not c.tree.annotation and c.tree.type == "package"):
        return
    if not _has_icon(c):
        yield "has no icon"


def _has_icon(c: library.Class) -> bool:
    bases = [library.find(str(e.component), c.name) for e in c.tree.extends]
    short = re.search(r"=\s*(?:input|output)?\s*Real|enumeration", text_of(c).split("annotation")[0])
    return "Icon(" in text_of(c) or bool(short) or any(b and b.name not in FRAMES and _has_icon(b) for b in bases)


def other_choice(c: library.Class) -> Iterator[str]:
    """A word of one enumeration where another one is wanted."""
    for name, s in c.tree.symbols.items():
        of = library.find(str(s.type), c.name)
        inner = library.components(of) if of else {}
        for key, e in library.modifiers(s.class_modification).items():
            wanted = s if key == "value" else inner.get(key)
            given = (
                re.fullmatch(r"(?:HystFMU\.)?(Types\.\w+)\.\w+", str(e)) if isinstance(e, ast.ComponentRef) else None
            )
            if given and wanted is not None and str(wanted.type) != given[1]:
                yield f"{name}: {key} is {e}, not of {wanted.type}"

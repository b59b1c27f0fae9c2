"""Rules of the lint on what a user sees: lines, places, dialogs, labels, choices."""

import re
from collections.abc import Iterator
from itertools import combinations

import library
from source import Element, declared, elements, extents, has, overlap, own_annotation

SHOWN = ("model", "block", "record", "connector")  # classes of components with a place in the diagram


def without_line(c: library.Class) -> Iterator[str]:
    """A connection is drawn: at least two points."""
    for e in elements(c):
        for ends in re.findall(r"\bconnect\s*\(([^;]*)\)\s*$", e.text.strip()):
            points = re.search(r"\bLine\(points=\{((?:\{[^{}]*\},?)+)\}", re.sub(r"\s", "", e.annotation))
            if points is None or points[1].count("{") < 2:
                yield f"connect({ends}) has no line"


def without_place(c: library.Class) -> Iterator[str]:
    """A component with an icon stands somewhere."""
    for name, e in declared(c).items():
        if _is_shown(c, name) and not extents(e.annotation, "transformation"):
            yield f"{name} has no placement"


def overlapping(c: library.Class) -> Iterator[str]:
    """Two components in one place hide each other."""
    places = {n: at[0] for n, e in declared(c).items() if (at := extents(e.annotation, "transformation"))}
    for (a, one), (b, other) in combinations(places.items(), 2):
        if overlap(one, other):
            yield f"{a} and {b} stand in one place"


def without_dialog(c: library.Class) -> Iterator[str]:
    """A parameter stands in a named group of the dialog."""
    for name, e in _parameters(c).items():
        if not re.search(r"\bDialog\([^)]*\b(?:group|tab|enable)\s*=", e.annotation):
            yield f"the parameter {name} has no group in the dialog"


def labels(c: library.Class) -> Iterator[str]:
    """The name of a component stands in its icon once, and no two labels on top of each other."""
    found = [(c.name, text) for text in _icon_texts(c)]
    names = [where for where, text in found if "%name" in text]
    if len(names) > 1:
        yield "its icon has %name twice"
    for (_, a), (_, b) in combinations(found, 2):
        one, other = (extents(f"Text({t}", "Text") for t in (a, b))
        if one and other and overlap(one[0], other[0]):
            yield f"two labels of its icon overlap at {one[0]}"


def without_constraint(c: library.Class) -> Iterator[str]:
    """What may be replaced says by what."""
    for name, e in declared(c).items():
        if re.match(r"\s*replaceable\b", e.text):
            if "constrainedby" not in e.text:
                yield f"{name} is replaceable without constrainedby"
            if not re.search(r"choicesAllMatching\s*=\s*true", e.annotation):
                yield f"{name} is replaceable without choicesAllMatching"


def without_experiment(c: library.Class) -> Iterator[str]:
    """What is to be simulated says for how long, at which interval and how accurately."""
    example = any("Icons.Example" in str(x.component) for x in c.tree.extends)
    text = own_annotation(c)
    if c.tree.type == "model" and not c.tree.partial and example:
        for key in ("StopTime", "Interval", "Tolerance"):
            if not re.search(rf"\bexperiment\([^)]*\b{key}\s*=", text):
                yield f"its experiment has no {key}"


def vendor(c: library.Class) -> Iterator[str]:
    """No annotation of one vendor."""
    for e in elements(c):
        for name in re.findall(r"\b(__\w+)\s*[(=]", e.annotation):
            yield f"{name} is an annotation of one vendor"


RULES = (
    without_line, without_place, overlapping, without_dialog, labels, without_constraint, without_experiment, vendor,
)  # fmt: skip


def _parameters(c: library.Class) -> dict[str, Element]:
    """Public parameters that a dialog shows."""
    if c.tree.type not in ("model", "block", "record"):
        return {}
    return {
        n: e
        for n, e in declared(c).items()
        if e.section == "public" and re.match(r"\s*(?:replaceable\s+)?parameter\b", e.text)
    }


def _is_shown(c: library.Class, name: str) -> bool:
    of = library.find(str(c.tree.symbols[name].type), c.name)
    if of is None or c.tree.type in ("function", "record", "connector"):
        return False
    return of.tree.type in SHOWN and not has(of.tree.type, "enumeration")


def _icon_texts(c: library.Class) -> list[str]:
    """Arguments of every Text in the icon of a class and of its base classes."""
    bases = [library.find(str(x.component), c.name) for x in c.tree.extends]
    own = own_annotation(c)
    icon = own.partition("Icon(")[2].partition("Documentation(")[0].partition("Diagram(")[0]
    return [t for b in bases if b for t in _icon_texts(b)] + re.findall(r"\bText\(([^;]*?textString[^)]*)\)", icon)

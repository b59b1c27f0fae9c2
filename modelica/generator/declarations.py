"""Modelica text from rows of a C table: declarations of parameters and ports, and equations as HTML."""

import math
import re
import sys

from generator.shelf import Shelf
from hystfmu.base import InputError, escape
from hystfmu.core.library import BlockType, Dim, Var
from hystfmu.graph.listing import group
from hystfmu.modelica.classes import DEPTH, enumeration
from hystfmu.modelica.layout import placed, port_placed
from hystfmu.modelica.literals import link, sentence

_CALL = re.compile(r"(\w+)\(")
_PRODUCT = re.compile(r"(\w+)\*(\w+)\Z")
_QUOTIENT = re.compile(r"(.+?)\s*/\s*(\w+)\Z")
_MONOMIALS = re.compile(r"monomials\((.+), (\w+)\)\Z")


def size(v: Var) -> str:
    """Return the number of elements of a variable as a Modelica expression.

    For example, ``n*(n + 1) / 2`` becomes ``div(n*(n + 1), 2)``. If the number is a product of two sizes, the
    variable is a matrix with the first size as number of rows.

    Raises
    ------
    InputError
        The expression calls a C function that this module cannot translate.
    """
    text = re.sub(r"\s*\*\s*", "*", v.size)
    if m := _MONOMIALS.match(text):
        return _monomials(m[1], m[2])
    if m := _CALL.match(text):
        raise InputError(f"the size {v.size!r} of {v.name!r}: write {m[1]} in modelica/generator/declarations.py")
    if m := _PRODUCT.match(text):
        return f"{m[1]}, {m[2]}"
    if m := _QUOTIENT.match(text):
        return f"div({m[1]}, {m[2]})"
    return text


def _monomials(p: str, q: str) -> str:
    """Return the number of monomials up to degree q <= 3 in p variables as an expression.

    The expression calls no function, because rumoca 0.10.2 does not accept a function call in a size.
    """
    one, two, three = (f"({p} + {k})" for k in (1, 2, 3))
    return f"if {q} == 1 then {p} + 1 elseif {q} == 2 then div({one}*{two}, 2) else div({one}*{two}*{three}, 6)"


def number(x: float) -> str:
    """Return a literal that represents exactly the double `x`. A whole number has no decimal point."""
    short = f"{x:g}"
    return (short if float(short) == x else repr(x)).replace("e+", "e")


def dim(d: Dim) -> str:
    """Return the declaration of a size parameter."""
    place = "Memory" if d.name == "depth" else "Sizes"
    start = min(d.start, DEPTH) if d.name == "depth" else d.start
    return f"parameter Integer {d.name}(min = {d.lo}) = {start} {sentence(d.text)}{_dialog(place)};"


def parameter(block: BlockType, v: Var, shelf: Shelf) -> str:
    """Return the declaration of a parameter of a block."""
    place = group(block, v)
    if v.choices:
        kind = enumeration(block, v)
        return f"parameter {kind} {v.name} = {kind}.{v.choices[int(v.start)]} {sentence(v.text)}{_dialog(place)};"
    many = v.size != "1"
    positive = v.lo == sys.float_info.min  # this limit means v > 0; the attribute min includes its value
    kind, attributes = _kind(v, shelf)
    bound = (lambda x: str(int(x))) if v.type == "int" else number
    limits = (("min", 0.0 if positive else v.lo), ("max", v.hi))
    attributes += [f"{'each ' if many else ''}{k} = {bound(x)}" for k, x in limits if math.isfinite(x)]
    shape = size(v) if many else ""
    start = number(v.start)
    value = f"fill({float(v.start)!r}, {shape})" if many else start
    text = v.text if not positive or "greater than 0" in v.text else f"{v.text}; greater than 0"
    given = f"({', '.join(attributes)})" if attributes else ""
    declared = f"{v.name}[{shape}]{given}" if many else f"{v.name}{given}"
    return f"parameter {kind} {declared} = {value} {sentence(text)}{_dialog(place)};"


def _kind(v: Var, shelf: Shelf) -> tuple[str, list[str]]:
    """Return the type of a parameter, and the attribute for its unit if the library has no type with this unit."""
    if v.type == "int":
        return "Integer", []
    if v.unit == "1":
        return "Real", []
    if v.unit in shelf.types:
        return shelf.types[v.unit], []
    return "Real", [f'{"each " if v.size != "1" else ""}unit = "{v.unit}"']


def _dialog(place: str) -> str:
    return f' annotation (Dialog(group = "{place}"))'


def ports(block: BlockType, kind: str, lacks: frozenset[str], inherited: frozenset[str]) -> list[str]:
    """Return the declarations of the inputs or the outputs (`kind`) of a block, without the ports `lacks`.

    `inherited` ports are not declared, but they take a position at the edge of the icon.
    """
    rows = [v for v in block.of(kind) if v.name not in lacks]
    found = []
    for i, v in enumerate(rows):
        if v.name in inherited:
            continue
        shape = f"[{size(v)}]" if v.size != "1" else ""
        unit = f'({"each " if shape else ""}unit = "{v.unit}")' if v.unit != "1" else ""
        where = port_placed(kind == "input", i, len(rows))
        declared = f"Interfaces.Real{kind.capitalize()} {v.name}{shape}{unit} {sentence(_plain(v.text))}"
        found.append(f"{declared} annotation ({where});")
    return found


def rate_port(v: Var) -> str:
    """Return the declaration of the conditional input for the time derivative of the input `v`."""
    text = sentence(f"rate of {v.name}; Sampled has no such input")
    where = f"annotation ({placed(-110, -70)})"
    return f'Interfaces.RealInput d{v.name}(unit = "1/s") if usesRate {text} {where};'


def _plain(text: str) -> str:
    return text.replace("`", "")


_POWER = re.compile(r"\^(?:\(([^()]*)\)|([+-]?\w+))")


def equation(text: str) -> str:
    """Return an equation of a C table as HTML. Powers become superscripts."""
    return _POWER.sub(lambda m: f"<sup>{m[1] or m[2]}</sup>", escape(text, quote=False))


def linked(name: str) -> str:
    """Return a link to the class `name` inside HystFMU."""
    return link(f"HystFMU.{name}", name)

"""Modelica literals: exact numbers, escaped strings, and valid names."""

import re
from collections.abc import Iterable

from hystfmu.base import Array

# the keywords of Modelica 3.6, the variable time, and the types without a package
_WORDS = """
algorithm and annotation assert block break class connect connector constant constrainedby der discrete each else elseif
elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import
impure in initial inner input loop model not operator or outer output package parameter partial protected public pure
record redeclare replaceable return stream then true type when while within
time Real Integer Boolean String Complex Clock StateSelect ExternalObject AssertionLevel
"""
RESERVED = frozenset(_WORDS.split())
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")


def number(x: float) -> str:
    """Return the shortest Real literal that represents exactly the double `x`."""
    return repr(float(x))


def array(values: Array) -> str:
    """Return the array constructor of a vector (n,) or a matrix (n, m)."""
    if values.ndim == 2:
        return "[" + "; ".join(", ".join(map(number, row)) for row in values) + "]"
    return "{" + ", ".join(map(number, values)) + "}"


def string(text: str) -> str:
    """Return a string literal on one line."""
    one_line = " ".join(text.split())
    return '"' + one_line.replace("\\", "\\\\").replace('"', '\\"') + '"'


def sentence(text: str) -> str:
    """Return a description as a string literal that begins with a capital letter."""
    return string(text[:1].upper() + text[1:])


def information(*paragraphs: str) -> str:
    """Return paragraphs of HTML as the string literal of ``Documentation(info = ...)``."""
    body = "\n".join(f"<p>{p}</p>" for p in paragraphs).replace('"', '\\"')
    return f'"<html>\n{body}\n</html>"'


def link(name: str, shown: str = "") -> str:
    """Return a link of HTML to a class with the full name `name`. The text of the link is `shown`, or this name."""
    return f'<a href="modelica://{name}">{shown or name}</a>'


def class_text(head: str, text: str, lines: Iterable[str], info: str, within: str = "", before: str = "") -> str:
    """Return the text of the Modelica file of a class, without its first line (the mark of a generated file).

    Parameters
    ----------
    head : str
        Kind and name of the class, such as ``partial block Ports``.
    text : str
        Description of the class.
    lines : iterable of str
        Lines between the description and the annotation.
    info : str
        String literal of the documentation.
    within : str
        Package of the class; "" for a package at the top.
    before : str
        Annotations before the documentation, such as the experiment of an example.
    """
    first = [f"within {within};"] if within else []
    last = [f"  annotation ({before}Documentation(info = {info}));", f"end {head.split()[-1]};\n"]
    return "\n".join([*first, f"{head} {sentence(text)}", *lines, *last])


def class_name(text: str) -> str:
    """Return a valid class name from any text, for example ``BacklashIdentifiedV2`` from ``backlash_identified.v2``."""
    words = [w for w in re.split(r"[^A-Za-z0-9]+", text) if w]
    name = "".join(w[0].upper() + w[1:] for w in words)
    return name if NAME.match(name) else f"Model{name}"


def unique(names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Return a valid and unique Modelica name for each name: the name itself, or the name followed by ``_``.

    Parameters
    ----------
    names : iterable of str
        Different names of letters, digits and ``_`` that begin with a letter.
    taken : iterable of str
        Names that the same class already contains.
    """
    used = RESERVED | set(taken)
    found: dict[str, str] = {}
    for name in names:
        legal = name
        while legal in used:
            legal += "_"
        found[name] = legal
        used |= {legal}
    return found

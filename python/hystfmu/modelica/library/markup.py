"""Equations of the C tables as HTML: powers are raised, an absolute value is abs."""

from __future__ import annotations

import re

from hystfmu.base.printable import escape

_POWER = re.compile(r"\^(?:\(([^()]*)\)|([+-]?\w+))")


def equation(text: str) -> str:
    """An equation of a C table, in a paragraph of a documentation."""
    return _POWER.sub(lambda m: f"<sup>{m[1] or m[2]}</sup>", escape(text, quote=False))


def link(name: str) -> str:
    """A link to the class `name` below HystFMU."""
    return f'<a href="modelica://HystFMU.{name}">{name}</a>'


def information(*paragraphs: str) -> str:
    """The value of ``Documentation(info = ...)``."""
    body = "\n".join(f"<p>{p}</p>" for p in paragraphs).replace('"', '\\"')
    return f'"<html>\n{body}\n</html>"'

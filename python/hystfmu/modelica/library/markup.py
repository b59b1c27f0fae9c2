"""Equations of the C tables as HTML: powers become superscripts, and an absolute value becomes abs."""

from __future__ import annotations

import re

from hystfmu.base.printable import escape

_POWER = re.compile(r"\^(?:\(([^()]*)\)|([+-]?\w+))")


def equation(text: str) -> str:
    """Return an equation of a C table for a paragraph of a documentation."""
    return _POWER.sub(lambda m: f"<sup>{m[1] or m[2]}</sup>", escape(text, quote=False))


def link(name: str) -> str:
    """Return a link to the class `name` below HystFMU."""
    return f'<a href="modelica://HystFMU.{name}">{name}</a>'


def information(*paragraphs: str) -> str:
    """Return the value of ``Documentation(info = ...)``."""
    body = "\n".join(f"<p>{p}</p>" for p in paragraphs).replace('"', '\\"')
    return f'"<html>\n{body}\n</html>"'

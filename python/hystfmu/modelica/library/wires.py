"""Lines for connections without a line in a class: `make generate` draws lines between the ports."""

from __future__ import annotations

import re
from collections.abc import Mapping

from hystfmu.modelica.layout import Point, line, on_component

_CONNECT = re.compile(r"^(?P<head> *connect\((?P<a>[\w.\[\]]+), (?P<b>[\w.\[\]]+)\));$", re.M)
_EXTENT = r"extent = \{\{(-?[\d.]+), (-?[\d.]+)\}, \{(-?[\d.]+), (-?[\d.]+)\}\}"
_PREFIX = r"(?:(?:replaceable|protected|public|inner|outer|final|parameter) )*"
_COLORS = {"Pin": "{0, 0, 255}", "Flange": "{0, 127, 0}"}


def nested(texts: Mapping[str, str]) -> dict[str, str]:
    """Return the files by name, with the classes within files of one package, such as ``Interfaces.Sampled``."""
    found = dict(texts)
    for name, text in texts.items():
        for m in re.finditer(r"^  (?:partial )?(?:block|model) (\w+) .*?^  end \1;", text, re.M | re.S):
            found[f"{name}.{m[1]}"] = m[0]
    return found


def drawn(text: str, name: str, texts: Mapping[str, str]) -> str:
    """Return the file `text` of the class `name` with a line for each connection whose ends have positions.

    Parameters
    ----------
    text, name : str
    texts : mapping of str to str
        Every file of the library by the name of its class below HystFMU.
    """

    def with_line(m: re.Match[str]) -> str:
        a, b = (_place(text, name, m[k], texts) for k in ("a", "b"))
        if a is None or b is None:
            return m[0]
        return f"{m['head']} {line(a[0], b[0], _COLORS.get(a[1], '{0, 0, 127}'))};"

    return _CONNECT.sub(with_line, text)


def _place(text: str, name: str, end: str, texts: Mapping[str, str]) -> tuple[Point, str] | None:
    """Return the position of an end of a connection in the diagram of a class, and the class of the connector."""
    head, _, port = re.sub(r"\[[^\]]*\]", "", end).partition(".")
    found = _component(text, name, head, texts)
    if found is None:
        return None
    kind, (x1, y1, x2, y2), where = found
    centre, half = ((x1 + x2) / 2, (y1 + y2) / 2), abs(x2 - x1) / 2
    if not port:
        return centre, kind.rsplit(".", 1)[-1]
    inner = _resolved(kind, where, texts)
    of = _component(texts[inner], inner, port, texts) if inner else None
    if of is None:
        return None
    x1, y1, x2, y2 = of[1]
    return on_component(((x1 + x2) / 2, (y1 + y2) / 2), centre, half), of[0].rsplit(".", 1)[-1]


def _component(
    text: str, name: str, component: str, texts: Mapping[str, str]
) -> tuple[str, tuple[float, float, float, float], str] | None:
    """Return type and extent of a component of a class or its base classes, and the declaring class."""
    for piece in text.split(";\n"):
        m = re.search(rf"^ *{_PREFIX}([A-Z][\w.]*) {component}\b", piece, re.M)
        extent = re.search(_EXTENT, piece.rpartition("transformation(")[2])
        if m and extent:
            x1, y1, x2, y2 = map(float, extent.groups())
            return m[1], (x1, y1, x2, y2), name
    for base in re.findall(r"^ *extends ([\w.]+)", text, re.M):
        inner = _resolved(base, name, texts)
        if inner and (found := _component(texts[inner], inner, component, texts)):
            return found
    return None


def _resolved(kind: str, name: str, texts: Mapping[str, str]) -> str | None:
    """Return the file of a class from its name in the text of the class `name`."""
    packages = name.split(".")[:-1]
    kind = kind.removeprefix("HystFMU.")
    for k in range(len(packages), -1, -1):
        full = ".".join([*packages[:k], kind])
        if full in texts:
            return full
    return None

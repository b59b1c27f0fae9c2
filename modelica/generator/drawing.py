"""Graphics of the library: lines of connections in the diagrams, and pictures of the user's guide."""

import re
from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from hystfmu.base import Array
from hystfmu.graph import Graph, Node
from hystfmu.modelica.layout import Point, line, on_component

_CONNECT = re.compile(r"^(?P<head> *connect\((?P<a>[\w.\[\]]+), (?P<b>[\w.\[\]]+)\));$", re.M)
_EXTENT = r"extent = \{\{(-?[\d.]+), (-?[\d.]+)\}, \{(-?[\d.]+), (-?[\d.]+)\}\}"
_PREFIX = r"(?:(?:replaceable|protected|public|inner|outer|final|parameter) )*"
_COLORS = {"Pin": "{0, 0, 255}", "Flange": "{0, 127, 0}"}


def nested(texts: Mapping[str, str]) -> dict[str, str]:
    """Return the text of all classes by name, including classes inside a file, such as ``Interfaces.Sampled``."""
    found = dict(texts)
    for name, text in texts.items():
        for m in re.finditer(r"^  (?:partial )?(?:block|model) (\w+) .*?^  end \1;", text, re.M | re.S):
            found[f"{name}.{m[1]}"] = m[0]
    return found


def drawn(text: str, name: str, texts: Mapping[str, str]) -> str:
    """Return the text of a class after adding a line to each connection whose two ends have positions in the diagram.

    Parameters
    ----------
    text, name : str
    texts : mapping of str to str
        Every file of the library by the name of its class inside HystFMU.
    """

    def with_line(m: re.Match[str]) -> str:
        a, b = (_place(text, name, m[k], texts) for k in ("a", "b"))
        if a is None or b is None:
            return m[0]
        return f"{m['head']} {line(a[0], b[0], _COLORS.get(a[1], '{0, 0, 127}'))};"

    return _CONNECT.sub(with_line, text)


def _place(text: str, name: str, end: str, texts: Mapping[str, str]) -> tuple[Point, str] | None:
    """Return the position in the diagram and the connector class of one end of a connection; None if unknown."""
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
    """Return type and extent of a component, and the class that declares it.

    The component is searched in the class and its base classes. The result is None if there is no such component.
    """
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
    """Return the full name of the class that the text of the class `name` calls `kind`; None if unknown."""
    packages = name.split(".")[:-1]
    kind = kind.removeprefix("HystFMU.")
    for k in range(len(packages), -1, -1):
        full = ".".join([*packages[:k], kind])
        if full in texts:
            return full
    return None


_FOLDER = PurePath("Resources", "Images")
_WIDTH, _HEIGHT, _EDGE = 480, 320, 40
_PART = re.compile(rf"^  (?:replaceable )?([A-Z][\w.]*) (\w+)\b[^\n]*?Placement\(transformation\({_EXTENT}", re.M)
_WIRE = re.compile(r"Line\(points = \{(.*?)\}, color = \{(\d+), (\d+), (\d+)\}\)")
_SHOWN = ("Examples.StackMovesMass", "Loops.Tracking")  # classes whose diagrams are shown in the guide


def pictures(texts: Mapping[str, str]) -> dict[PurePath, str]:
    """Return the SVG text of every picture, by its path relative to the folder of the library.

    Parameters
    ----------
    texts : mapping of str to str
        Every file of the library by the name of its class inside HystFMU.
    """
    found = {"MinorLoops": _minor_loops(), "Realisations": _realisations()}
    found |= {name.rpartition(".")[2]: _diagram(texts[name]) for name in _SHOWN if name in texts}
    return {_FOLDER / f"{name}.svg": text for name, text in found.items()}


def _plays(u: Array) -> Array:
    """Return the output (n,) of the operator of Examples.MinorLoops for an input (n,)."""
    r, w = np.linspace(0.05, 0.5, 10), np.full(10, 0.1)
    plays = Node("plays", "prandtl_ishlinskii", {"n": 10}, {"w0": 0.3, "r": r, "w": w})
    return Graph.single(plays).run(u).ravel()


def _tones(t: Array) -> Array:
    return 0.7 * np.sin(6 * np.pi * t) + 0.4 * np.sin(34 * np.pi * t)


def _minor_loops() -> str:
    u = _tones(np.linspace(0, 1, 1201))
    return _plot("input u", "output y", [(u, _plays(u), "#00007f")])


def _realisations() -> str:
    t, ts = np.linspace(0, 0.12, 961), 0.006
    u = _tones(t)
    sampled = np.arange(0, 0.12 + ts / 2, ts)
    y = _plays(_tones(sampled))
    return _plot(
        "time, s", "y", [(np.repeat(sampled, 2)[1:], np.repeat(y, 2)[:-1], "#d943b4"), (t, _plays(u), "#00007f")]
    )


def _plot(below: str, beside: str, curves: list[tuple[Array, Array, str]]) -> str:
    """Return an SVG plot of curves, each given by x values, y values and colour, with labels for both axes."""
    x = np.concatenate([c[0] for c in curves])
    y = np.concatenate([c[1] for c in curves])
    across = (_WIDTH - 2 * _EDGE) / np.ptp(x)
    up = (_HEIGHT - 2 * _EDGE) / np.ptp(y)
    lines = [f'<rect x="{_EDGE}" y="{_EDGE}" width="{_WIDTH - 2 * _EDGE}" height="{_HEIGHT - 2 * _EDGE}" fill="none" '
             'stroke="#888"/>']  # fmt: skip
    for a, b, color in curves:
        points = " ".join(
            f"{_EDGE + across * (p - x.min()):.1f},{_HEIGHT - _EDGE - up * (q - y.min()):.1f}"
            for p, q in zip(a, b, strict=True)
        )
        lines.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="1.5"/>')
    lines.append(_text(_WIDTH / 2, _HEIGHT - _EDGE / 3, below))
    lines.append(_text(_EDGE, _EDGE * 0.7, beside))
    return _svg(_WIDTH, _HEIGHT, lines)


def _diagram(text: str) -> str:
    """Return an SVG diagram with the components and lines of a class, in the style of a Modelica tool."""
    lines = []
    for m in _WIRE.finditer(text):
        points = " ".join(f"{x},{-float(y):g}" for x, y in re.findall(r"\{(-?[\d.]+), (-?[\d.]+)\}", m[1] + "}"))
        color = "#{:02x}{:02x}{:02x}".format(*map(int, m.groups()[1:]))
        lines.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="0.6"/>')
    corners = []
    for kind, name, *extent in _PART.findall(text):
        x1, y1, x2, y2 = map(float, extent)
        corners.append((x1, y1, x2, y2))
        lines.append(
            f'<rect x="{x1:g}" y="{-y2:g}" width="{x2 - x1:g}" height="{y2 - y1:g}" fill="white" stroke="#00007f" '
            f'stroke-width="0.6"><title>{kind}</title></rect>'
        )
        lines.append(_text((x1 + x2) / 2, -y1 + 5, name, 5))
    x1, y1 = (min(c[k] for c in corners) - 10 for k in (0, 1))
    x2, y2 = (max(c[k] for c in corners) + 10 for k in (2, 3))
    return _svg(x2 - x1, y2 - y1, lines, f"{x1:g} {-y2:g} {x2 - x1:g} {y2 - y1:g}", 3)


def _text(x: float, y: float, text: str, size: float = 13) -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size:g}" font-family="sans-serif" text-anchor="middle">{text}</text>'


def _svg(width: float, height: float, lines: list[str], box: str = "", scale: float = 1) -> str:
    inside = "\n".join(lines)
    view = box or f"0 0 {width:g} {height:g}"
    size = f'width="{scale * width:g}" height="{scale * height:g}" viewBox="{view}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n{inside}\n</svg>\n'

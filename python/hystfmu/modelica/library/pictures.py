"""Pictures of the guide in Resources/Images: loops and responses from the C core, diagrams from the classes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph, Node

_FOLDER = PurePath("Resources", "Images")
_WIDTH, _HEIGHT, _EDGE = 480, 320, 40
_EXTENT = r"extent = \{\{(-?[\d.]+), (-?[\d.]+)\}, \{(-?[\d.]+), (-?[\d.]+)\}\}"
_PART = re.compile(rf"^  (?:replaceable )?([A-Z][\w.]*) (\w+)\b[^\n]*?Placement\(transformation\({_EXTENT}", re.M)
_WIRE = re.compile(r"Line\(points = \{(.*?)\}, color = \{(\d+), (\d+), (\d+)\}\)")
_SHOWN = ("Examples.StackMovesMass", "Loops.Tracking")  # whose diagrams the guide has


def pictures(texts: Mapping[str, str]) -> dict[PurePath, str]:
    """Return every picture by its path relative to the folder of the library.

    Parameters
    ----------
    texts : mapping of str to str
        Every file of the library by the name of its class below HystFMU.
    """
    found = {"MinorLoops": _minor_loops(), "Realisations": _realisations()}
    found |= {name.rpartition(".")[2]: _diagram(texts[name]) for name in _SHOWN if name in texts}
    return {_FOLDER / f"{name}.svg": text for name, text in found.items()}


def _plays(u: Array) -> Array:
    """Run the operator of Examples.MinorLoops on an input (n,)."""
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
    """Draw curves in a frame, each with its colour."""
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
    """Draw components and lines of a class in the style of a Modelica tool."""
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

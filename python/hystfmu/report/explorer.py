"""A part of a page in which a reader changes the input of models. The C core runs in the page.

The part contains the core as WebAssembly, compressed by deflate, and the block files of the models. It makes no network
requests.
"""

from __future__ import annotations

import base64
import functools
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hystfmu.base.arrays import Array

CORE = Path(__file__).with_name("core_page.txt")
HEAD = 2  # lines of it that say what it is
MOST_MEASURED = 3000  # points


@dataclass(frozen=True)
class Slider:
    """Values that a reader may change: name with unit of measure, first value reference, number of values, and range.

    A covariate ranges from `lo` to `hi`. For a parameter, `lo` and `hi` are None, and the range is from 0 to twice the
    values of the block file.
    """

    name: str
    reference: int
    size: int = 1
    lo: float | None = None
    hi: float | None = None


@dataclass(frozen=True)
class Memory:
    """States of the node `block` that represent its memory: turning points, plays, or other states with `names`.

    `node` and `place` are the index of the node, and of the first number among its states. `widths` and `size` are the
    first value reference and the number of the half-widths of plays. `core/memory/turning_points.h` has the list of
    turns.
    """

    block: str
    kind: Literal["turns", "plays", "states"]
    node: int
    place: int
    widths: int = 0
    size: int = 0
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Driven:
    """A graph for the simulation: its block file, and the value references of input and output."""

    file: bytes
    u: int
    y: int


@dataclass(frozen=True)
class Explored:
    """A model in the explorer.

    It has a name, a graph, an inverse if there is one, a step (s), a range of the input, sliders, and displayed
    memories.
    """

    name: str
    graph: Driven
    inverse: Driven | None
    h: float
    lo: float
    hi: float
    sliders: Sequence[Slider] = ()
    memory: Memory | None = None


@dataclass(frozen=True)
class Explorer:
    """Models on common axes, with the measured points (u, y), each of shape (n,), if there are any."""

    models: Sequence[Explored]
    u_label: str
    y_label: str
    measured: tuple[Array, Array] | None = None

    def html(self) -> str:
        """Return the explorer as HTML."""
        data = {
            "core": packed_core(),
            "models": [_plain(asdict(m)) for m in self.models],
            "labels": [self.u_label, self.y_label],
            "measured": _thinned(self.measured),
        }
        text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
        return (
            '<div class="explorer"><noscript>The explorer needs JavaScript.</noscript>'
            f'<script type="application/json">{text}</script></div>'
        )


@functools.cache
def packed_core() -> str:
    """Return the core as a raw deflate stream in base64."""
    return "".join(CORE.read_text(encoding="ascii").splitlines()[HEAD:])


def _plain(v: Any) -> Any:
    """Convert to JSON types; bytes become base64."""
    if isinstance(v, bytes):
        return base64.b64encode(v).decode()
    if isinstance(v, dict):
        return {k: _plain(x) for k, x in v.items()}
    return [_plain(x) for x in v] if isinstance(v, list | tuple) else v


def _thinned(measured: tuple[Array, Array] | None) -> list[list[float]]:
    """Return the points of the drawing, rounded to the resolution of a screen."""
    if measured is None:
        return []
    picked = np.unique(np.linspace(0, len(measured[0]) - 1, MOST_MEASURED).round().astype(int))
    return [[float(f"{x:.5g}") for x in v[picked].tolist()] for v in measured]

"""The explorer, a part of a page in which a reader changes the input of models. The C core runs in the page.

The explorer contains the compressed C core as WebAssembly, and the block files of the models. It makes no network
requests.
"""

import base64
import functools
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hystfmu.base import Array

CORE = Path(__file__).with_name("core_page.txt")
HEAD = 2  # number of lines with the description at the beginning of the file
MOST_MEASURED = 3000  # maximum number of measured points in the drawing


@dataclass(frozen=True)
class Slider:
    """A slider with which a reader changes the values of a covariate or of a parameter.

    `name` contains the unit of measure, `reference` is the first value reference, and `size` is the number of values. A
    covariate has the range from `lo` to `hi`. For a parameter, `lo` and `hi` are None, and the range is from 0 to twice
    the values of the block file.
    """

    name: str
    reference: int
    size: int = 1
    lo: float | None = None
    hi: float | None = None


@dataclass(frozen=True)
class Memory:
    """States of the node `block` that contain its memory: turning points, states of plays, or states with `names`.

    `node` is the index of the node, and `place` is the index of the first number of the memory among its states.
    For plays, `widths` is the first value reference of the half-widths, and `size` is the number of half-widths.
    `core/memory/turning_points.h` defines the form of the turning points.
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
    """A graph that the page simulates, as its block file and the value references of input and output."""

    file: bytes
    u: int
    y: int


@dataclass(frozen=True)
class Explored:
    """A model in the explorer.

    It has a name, a graph, optionally an inverse, a step `h` (s), a range of the input, sliders, and optionally a
    memory that the explorer displays.
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
    """An explorer of models with common axes. `measured` contains measured points u and y, each of shape (n,)."""

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
    """Return the compressed C core for pages, as a raw deflate stream in base64."""
    return "".join(CORE.read_text(encoding="ascii").splitlines()[HEAD:])


def _plain(v: Any) -> Any:
    """Return a value with types that JSON supports. Bytes are converted to base64."""
    if isinstance(v, bytes):
        return base64.b64encode(v).decode()
    if isinstance(v, dict):
        return {k: _plain(x) for k, x in v.items()}
    return [_plain(x) for x in v] if isinstance(v, list | tuple) else v


def _thinned(measured: tuple[Array, Array] | None) -> list[list[float]]:
    """Return the measured points for the drawing, reduced in number and rounded to the resolution of a screen."""
    if measured is None:
        return []
    picked = np.unique(np.linspace(0, len(measured[0]) - 1, MOST_MEASURED).round().astype(int))
    return [[float(f"{x:.5g}") for x in v[picked].tolist()] for v in measured]

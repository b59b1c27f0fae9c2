"""A part of a page in which a reader moves the input of models by hand: the C core runs in the page.

The part holds the core as WebAssembly, packed by deflate, and the block files of the models; it requests nothing.
"""

from __future__ import annotations

import base64
import functools
import json
import zlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from hystfmu.base import PACKAGE
from hystfmu.base.arrays import Array

CORE = PACKAGE / "_platforms" / "core.wasm"
MOST_MEASURED = 3000  # points
NO_CORE = "The explorer is left out: the core for pages is not installed ('make platforms' builds it)."


@dataclass(frozen=True)
class Slider:
    """Values that a reader may move: their value references, name with unit of measure, and range.

    `values` are those of the file, shape (size,); a covariate moves from `lo` to `hi`, a parameter (both None) from 0
    to twice its values.
    """

    name: str
    reference: int
    values: tuple[float, ...]
    lo: float | None = None
    hi: float | None = None


@dataclass(frozen=True)
class Memory:
    """States of a block that show its memory.

    Attributes
    ----------
    block : str
        Name of the node.
    kind : {"turns", "plays", "states"}
        A list of turning points (`fmu_build/core/memory/turning_points.h`), plays, or other states.
    node, place : int
        Index of the node, and of the first number among its states.
    values : tuple
        Half-widths of the plays.
    names : tuple of str
        Of other states.
    """

    block: str
    kind: Literal["turns", "plays", "states"]
    node: int
    place: int
    values: tuple[float, ...] = ()
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Driven:
    """A graph to run: its block file, and the value references of its input and output."""

    file: bytes
    u: int
    y: int


@dataclass(frozen=True)
class Explored:
    """A model: name, graph, inverse if it has one, step (s), range of the input, what to move, what to look at."""

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
    """Models on the same axes, over the measured points (u, y), each of shape (n,), if there are any."""

    models: Sequence[Explored]
    u_label: str
    y_label: str
    measured: tuple[Array, Array] | None = None

    def html(self) -> str:
        """The part as HTML; a sentence if the core for pages is not installed."""
        core = packed_core()
        if core is None:
            return f'<p class="lead">{NO_CORE}</p>'
        data = {
            "core": core,
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
def packed_core() -> str | None:
    """Return the core as base64 of a raw deflate stream; None if it is not installed."""
    if not CORE.exists():
        return None
    return base64.b64encode(zlib.compress(CORE.read_bytes(), 9)[2:-4]).decode()


def _plain(v: Any) -> Any:
    """Convert to JSON types; bytes become base64."""
    if isinstance(v, bytes):
        return base64.b64encode(v).decode()
    if isinstance(v, dict):
        return {k: _plain(x) for k, x in v.items()}
    return [_plain(x) for x in v] if isinstance(v, list | tuple) else v


def _thinned(measured: tuple[Array, Array] | None) -> list[list[float]]:
    """Return the points to draw, rounded to what a screen shows."""
    if measured is None:
        return []
    picked = np.unique(np.linspace(0, len(measured[0]) - 1, MOST_MEASURED).round().astype(int))
    return [[float(f"{x:.5g}") for x in v[picked].tolist()] for v in measured]

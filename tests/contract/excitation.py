"""Inputs and parameter sets that bring every block to life: what all contract tests run."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hystfmu.core import BlockType, block_types
from hystfmu.errors import InputError
from hystfmu.graph import Graph, Node

Array = NDArray[np.float64]

BLOCKS = sorted(block_types())
STEP = 0.05

# Values without which a parameter can have no effect, each with its reason.
NEEDED: dict[str, list[dict[str, Any]]] = {
    "disturbance": [{"step": 1.0, "t_step": 1.0}],  # a step of height 0 has no time
}


def rows(block: BlockType, dims: dict[str, int], n: int = 160, seed: int = 1, amplitude: float = 1.3) -> Array:
    """Nested reversals in every input, not zero at the first row."""
    rng = np.random.default_rng(seed)
    sizes = block.sizes(dims)
    columns = sum(sizes[v.name] for v in block.of("input"))
    levels = rng.uniform(-amplitude, amplitude, (n // 8 + 2, columns))
    levels[0] = np.where(levels[0] < 0, levels[0] - 0.2, levels[0] + 0.2)
    at = np.arange(n) / 8
    return np.column_stack([np.interp(at, np.arange(len(levels)), c) for c in levels.T] or [np.zeros((n, 0))])


def configurations(block: BlockType) -> list[dict[str, Any]]:
    """Every combination of the choices of enumerations and switches, with the defaults and with what is needed."""
    words = {v.name: v.choices or (0, 1) for v in block.parameters if v.choices or v.type == "bool"}
    chosen = [dict(zip(words, c, strict=True)) for c in itertools.product(*words.values())]
    return [{**c, **extra} for extra in [{}, *NEEDED.get(block.name, [])] for c in chosen]


def node(block: BlockType, values: dict[str, Any]) -> Node | None:
    """A node with these values, or None where the parameters do not fit together."""
    try:
        made = Node("b", block.name, {}, values)
        Graph.single(made).executor()
    except InputError:
        return None
    return made

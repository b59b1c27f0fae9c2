"""Inputs and parameter sets that excite every block, used by all contract tests."""

import itertools
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hystfmu import Graph, InputError, Node
from hystfmu.core.library import BlockType, Var, block_types

Array = NDArray[np.float64]

BLOCKS = sorted(block_types())
STEP = 0.05
every_block = pytest.mark.parametrize("name", BLOCKS)

# Values without which a parameter can have no effect, each with its reason.
NEEDED: dict[str, list[dict[str, Any]]] = {
    "dead_zones": [{"r": [-0.5, -0.2, 0.0, 0.1, 0.4, 0.9]}],  # a zone at 0 is the whole input
    "disturbance": [{"step": 1.0, "t_step": 1.0}],  # a step of height 0 has no step time
    "duhem_oscillator": [{"f": [9e4, 7e4, 5e4, 3e4, 1e4], "z_max": 0.7}],  # equal stiffnesses make a spring
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


def default(name: str) -> Graph:
    return Graph.single(Node(name, name))


def some(block: BlockType) -> list[Node]:
    """All legal configurations as nodes."""
    nodes = [n for n in (node(block, c) for c in configurations(block)) if n]
    assert nodes, "no configuration of the block can be built"
    return nodes


def run(n: Node, u: np.ndarray, h: float = STEP) -> np.ndarray:
    return Graph.single(n).run(u, h).reshape(len(u), -1)


def candidates(v: Var, flat: np.ndarray) -> list[np.ndarray]:
    """Other legal values of a parameter, gentle ones first."""
    up = np.linspace(1.0, 2.0, flat.size) if flat.size > 1 else np.array([1.5])
    tried = [flat * up + 0.1, flat * up, flat * 0.5, flat - 0.4, flat * 0 + 0.3 * up, flat * 0 - 0.3 * up, flat + 1.0]
    if v.type == "int":
        tried = [flat + 1, flat - 1, flat + 2]
    return [t for t in tried if (t >= v.lo).all() and (t <= v.hi).all() and not np.array_equal(t, flat)]


def plain(flat: np.ndarray) -> Any:
    return [float(f) for f in flat] if flat.size > 1 else float(flat[0])


def perturbed(n: Node, names: set[str]) -> Node:
    """The node with all these parameters changed as far as they fit together."""
    left = [v for v in n.block.parameters if v.name in names]
    for v in (*left, *left):  # the first may need one that comes later
        if v not in left:
            continue
        for value in candidates(v, n.value(v.name)):
            made = node(n.block, {**n.values, v.name: plain(value)})
            if made and made.dims == n.dims:
                n = made
                left.remove(v)
                break
    return n

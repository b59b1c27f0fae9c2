"""The C block that is compared with a class of the library: its node for a Validation model, its ports as columns."""

import library
import numpy as np
import simulate
from numpy.typing import NDArray

from hystfmu.core.library import BlockType, block_types
from hystfmu.graph import Graph, Node
from hystfmu.modelica import classes

Array = NDArray[np.float64]
# classes that are one shape of the block `reference`
SHAPES = {classes.camel(k): k for k in classes.SHAPES}
TWINS = {t.class_name: t for t in block_types().values()}
TWINS |= dict.fromkeys(SHAPES, TWINS["Reference"])


def twin_of(block: str) -> BlockType:
    """The C block of a class; a stop is what a play leaves of its input."""
    return TWINS["PlayBank" if block == "StopBank" else block]


def tested(model: library.Class) -> tuple[str, Node, float]:
    """Class of the component `tested` of a Validation model, its C node, its step."""
    symbol = model.tree.symbols["tested"]
    block = str(symbol.type).rsplit(".", 1)[-1]
    kind = twin_of(block)
    values = {k: library.evaluate(e, {}) for k, e in library.modifiers(symbol.class_modification).items()}
    step = values.pop("Ts", library.experiment(model)["Interval"])
    dims = {d.name: values.pop(d.name) for d in kind.dims if d.name in values}
    if block in SHAPES:
        values["shape"] = SHAPES[block]
    return block, Node("tested", kind.name, dims, values), float(step)


def columns(values: dict[str, Array], node: Node, role: str) -> Array:
    """The inputs or outputs of the component `tested`, one column for each element."""
    blocks = [simulate.port(values, "tested", v.name, node.sizes[v.name]) for v in node.block.of(role)]
    return np.hstack(blocks) if blocks else np.zeros((len(values["time"]), 0))


def run(node: Node, u: Array, h: float) -> Array:
    """Outputs of the block for the rows of u."""
    size = sum(node.sizes[v.name] for v in node.block.of("output"))
    return np.asarray(Graph.single(node).executor().run(u, size, h))

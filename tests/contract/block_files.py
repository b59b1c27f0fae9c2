"""Block files that the writer does not write: damaged, with refused values, with ports in another order."""

import itertools
import struct
import zlib

import numpy as np

from hystfmu.graph import Graph, Input, Node, Output


def sealed(file: bytes) -> bytes:
    """With the right length and checksum."""
    return file[:12] + struct.pack("<II", len(file), zlib.crc32(file[20:])) + file[20:]


def patched(file: bytes, at: int, new: bytes) -> bytes:
    at %= len(file)
    return sealed(file[:at] + new + file[at + len(new) :])


def raw_bytes(node: Node) -> bytes:
    """Make the file of a graph with parameters that the writer refuses."""
    good = Node(node.name, node.type)
    file = Graph.single(good).to_bytes()
    for name, value in node.values.items():
        old = b"".join(struct.pack("<d", v) for v in good.value(name))
        at = file.index(old) if file.count(old) == 1 else -1
        if at < 0:  # the same number stands elsewhere: count to the parameter
            before = sum(
                good.sizes[v.name] for v in good.block.parameters[: [v.name for v in good.block.parameters].index(name)]
            )
            at = 68 + 4 + 4 + len(node.name) + 4 + len(node.type) + 4 + 4 * len(good.dims) + 4 + 8 * before
        file = patched(file, at, struct.pack("<d", float(np.ravel(value)[0])))
    return file


def input_between_outputs() -> tuple[bytes, Graph]:
    """The order of ports is free in a file: the writer has its own."""
    graph = Graph(
        [Node("a", "scaling", {"n": 1}, {"gain": [2.0]}), Node("b", "scaling", {"n": 1}, {"gain": [3.0]})],
        [],
        [Input("u", ("a.u", "b.u"))],
        [Output("ya", "a.y"), Output("yb", "b.y")],
    )
    file = graph.to_bytes()
    sizes = [4 + len(p.name) + 20 for p in graph.ports]
    begins = np.cumsum([len(file) - sum(sizes), *sizes])
    records = [file[i:j] for i, j in itertools.pairwise(begins)]
    order = [k for k, p in enumerate(graph.ports) if p.kind not in ("input", "output")]
    ins, outs = ([k for k, p in enumerate(graph.ports) if p.kind == kind] for kind in ("input", "output"))
    return sealed(file[: begins[0]] + b"".join(records[k] for k in [*order, outs[0], *ins, outs[1]])), graph

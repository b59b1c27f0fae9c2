"""Block files as one C source, so that programs for any platform need not open files.

The files hold every block in every configuration of the contract tests, and graphs with wires, loops and an implicit
inverse.
"""

import functools
from pathlib import Path
from typing import Any

import numpy as np
import test_sanitizers
from excitation import STEP, configurations, node
from fmu_master import loop, mixed, single

from hystfmu.core.library import block_types
from hystfmu.graph import Graph, Input, Node, Output


def lively(n: Node) -> Node:
    """Return the node with arrays of different elements: equal weights or radii would hide errors."""
    spread: dict[str, Any] = {}
    for v in n.block.parameters:
        if v.type == "real" and v.size != "1" and v.name not in n.values:
            k = np.arange(n.sizes[v.name])
            spread[v.name] = np.clip(n.value(v.name) + 0.3 * np.sin(1.7 * k + len(v.name)), v.lo, v.hi)
            if v.name == "r":
                spread[v.name] = np.sort(np.abs(spread[v.name]))
    return node(n.block, {**n.values, **spread}) or n


def sampled_implicit() -> Graph:
    """Return an implicit inverse with a sampled block: Event Mode steps the inverse without samples."""
    nodes = [
        Node("inverse", "implicit_inverse", {}, {"lo": -5.0, "hi": 5.0}),
        Node("model", "prandtl_ishlinskii", {"n": 2}, {"w0": 1.5, "r": [0.1, 0.4], "w": [0.5, 0.3]}),
        Node("rate", "differentiator"),
    ]
    wires = [("inverse.u", "model.u"), ("inverse.u", "rate.u"), ("model.y", "inverse.h")]
    return Graph(
        nodes, wires, [Input("y", ("inverse.y",))], [Output("u", "inverse.u"), Output("du", "rate.du")], step=STEP
    )


@functools.cache
def graphs() -> dict[str, Graph]:
    """Return the graphs by name; sampled blocks have a step."""
    made = {}
    for name, block in block_types().items():
        for i, values in enumerate(configurations(block)):
            if n := node(block, values):
                made[f"{name}-{i}"] = Graph.single(lively(n)).with_step(STEP)
        made[f"{name}-moving"] = single(name)
    return made | {
        "loop": loop(), "mixed": mixed(), "two-loops": test_sanitizers.loop().with_step(STEP),
        "sampled-implicit": sampled_implicit(), "implicit": test_sanitizers.implicit().with_step(STEP),
    }  # fmt: skip


def write_source(target: Path) -> Path:
    """Write the graphs as `embedded_files[]` of embedded.h."""
    lines = ['#include "embedded.h"']
    for i, (name, graph) in enumerate(graphs().items()):
        lines.append(f"static const unsigned char file{i}[] = {{{','.join(map(str, graph.to_bytes()))}}}; /* {name} */")
    rows = [f'{{"{name}", file{i}, sizeof file{i}}},' for i, name in enumerate(graphs())]
    target.write_text("\n".join([*lines, "const embedded_file embedded_files[] = {", *rows, "{0, 0, 0}};", ""]))
    return target


def write_corpus(folder: Path) -> Path:
    """Write the graphs as files into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, graph in graphs().items():
        (folder / f"{name}.bin").write_bytes(graph.to_bytes())
    return folder

"""Blocks one behind the other, as a graph."""

from itertools import pairwise

from hystfmu.graph import Graph, Input, Node, Output


def series(*nodes: Node, step: float = 0.0, units: tuple[str, str] = ("", ""), start: float = 0.0) -> Graph:
    """u -> first block -> ... -> y, by the first input and output of each; units of measure of u and y."""

    def port(node: Node, kind: str) -> str:
        return f"{node.name}.{node.block.of(kind)[0].name}"

    wires = [(port(a, "output"), port(b, "input")) for a, b in pairwise(nodes)]
    inputs = [Input("u", (port(nodes[0], "input"),), units[0], start)]
    return Graph(nodes, wires, inputs, [Output("y", port(nodes[-1], "output"), units[1])], sort=False, step=step)

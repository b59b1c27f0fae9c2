"""Rate classes of the blocks of a graph, as their tables state them."""

from __future__ import annotations

from hystfmu.graph.graph import Graph


def is_hysteretic(graph: Graph) -> bool:
    """Return whether a block updates its memory at every completed step of a solver."""
    return any(n.block.rate == "hysteretic" for n in graph.nodes)


def is_sampled(graph: Graph) -> bool:
    """Return whether a block advances at sample times only."""
    return any(n.block.rate == "sampled" for n in graph.nodes)

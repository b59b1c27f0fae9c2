"""In which way the blocks of a graph advance in time: the rate classes that their tables state."""

from __future__ import annotations

from hystfmu.graph.graph import Graph


def is_hysteretic(graph: Graph) -> bool:
    """Whether a memory takes its input at every completed step of a solver."""
    return any(n.block.rate == "hysteretic" for n in graph.nodes)


def is_sampled(graph: Graph) -> bool:
    """Whether a block advances in samples only."""
    return any(n.block.rate == "sampled" for n in graph.nodes)

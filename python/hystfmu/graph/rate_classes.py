"""Rate classes of the blocks of a graph, as their tables state them."""

from __future__ import annotations

from hystfmu.graph.graph import Graph


def is_hysteretic(graph: Graph) -> bool:
    """Return whether a block updates its memory at every completed step of a solver."""
    return any(n.block.rate == "hysteretic" for n in graph.nodes)


def is_sampled(graph: Graph) -> bool:
    """Return whether a block advances at sample times only."""
    return any(n.block.rate == "sampled" for n in graph.nodes)


def needs_step(graph: Graph) -> bool:
    """Return whether the model depends on the length of its steps.

    It does if it has a sampled block, or a memory whose source changes only at steps because the graph depends on time
    or reads outputs of the last step in a loop.
    """
    timed = any(n.block.of("time") for n in graph.nodes)
    looped = any(source >= to and place != graph.nodes[to].block.trial - 1 for to, place, source, *_ in graph.links)
    return is_sampled(graph) or ((timed or looped) and any(n.block.rate != "function" for n in graph.nodes))

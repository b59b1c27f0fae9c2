"""Fingerprints of the states of units at the end of a run: equal in every engine, or something forgot or invented."""

from __future__ import annotations

import hashlib

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph


def n_memory(graph: Graph) -> int:
    """How many states the blocks of a graph have."""
    return sum(n.sizes[v.name] for n in graph.nodes for v in n.block.of("cstate", "state"))


def n_state(graph: Graph) -> int:
    """How many values a saved state of the core has: the last step, all memories, and what else a run changes."""
    return len(graph.executor().state)


def mark(graph: Graph, state: Array, skip: int = 0) -> str:
    """Fingerprint of the memory of a graph in a `state` (n,) of the core; `skip` states of other blocks come before."""
    return hashlib.sha256(state[1 + skip : 1 + skip + n_memory(graph)].tobytes()).hexdigest()[:16]

"""Hashes of the final unit states; all engines must agree."""

from __future__ import annotations

import hashlib

from hystfmu.base.arrays import Array
from hystfmu.graph import Graph


def n_states(graph: Graph) -> int:
    """Return the number of states of the blocks of a graph."""
    return sum(n.sizes[v.name] for n in graph.nodes for v in n.block.of("cstate", "state"))


def n_saved(graph: Graph) -> int:
    """Return the number of values of a saved state of the core: last step, states, and other values that a run
    changes."""
    return len(graph.executor().state)


def state_hash(graph: Graph, saved: Array, skip: int = 0) -> str:
    """Return the hash of the states of a graph in a `saved` state (n,) of the core, after `skip` states of other
    graphs."""
    return hashlib.sha256(saved[1 + skip : 1 + skip + n_states(graph)].tobytes()).hexdigest()[:16]

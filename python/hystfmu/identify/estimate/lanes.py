"""Copies of a graph with shared parts, so that one pass over the rows runs all of them.

A lane differs from the base in the values of some nodes.  Only these nodes and what lies downstream of them are copied;
everything else is run once.  An estimator asks for two sets of lanes: one lane for each parameter that enters the
output linearly, which gives the columns of a regression, and one for each searched coordinate, which gives the
derivatives by differences.  Sensitivities that the core computes may replace the second.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from hystfmu.base.arrays import Array
from hystfmu.core.executor import Executor
from hystfmu.graph import Graph, Input, Node, Output

MOST_NODES = 900  # of a graph with its lanes; the core takes 1000
Values = Mapping[str, ArrayLike]
"""Values of parameters by name, ``node.parameter``; each a number or an array with all elements."""


class Lanes:
    """A graph with one output and its lanes, loaded into the core.

    Parameters
    ----------
    graph : Graph
        The base, lane 0.
    touched : sequence of collection of str
        For each further lane the nodes whose values differ from the base.
    """

    def __init__(self, graph: Graph, touched: Sequence[Collection[str]] = ()) -> None:
        copied = [{n.name for n in graph.nodes}, *(_downstream(graph, names) for names in touched)]
        place = {n.name: i for i, n in enumerate(graph.nodes)}
        self.names: dict[tuple[int, str], str] = {
            (lane, name): f"n{place[name]}_{lane}" for lane, names in enumerate(copied) for name in names
        }
        nodes = [
            Node(self.names[lane, n.name], n.type, n.dims, n.values)
            for n in graph.nodes
            for lane in range(len(copied))
            if n.name in copied[lane]
        ]
        lanes = range(len(copied))
        wires = [
            (self._end(lane, a), self._end(lane, b))
            for a, b in graph.wires
            for lane in lanes
            if b.partition(".")[0] in copied[lane]
        ]
        inputs = [
            Input(f"u{k}", tuple(self._end(i, b) for b in port.to for i in lanes if b.partition(".")[0] in copied[i]))
            for k, port in enumerate(graph.inputs)
        ]
        outputs = [Output(f"y{lane}", self._end(lane, graph.outputs[0].source)) for lane in lanes]
        made = Graph(nodes, wires, inputs, outputs, sort=False, step=graph.step)
        self.n = len(copied)
        self._executor = Executor(made.to_bytes())
        self._references = {
            (made.nodes[p.node].name, p.var.name): (p.reference, p.size) for p in made.ports if p.is_parameter
        }
        self._last: dict[tuple[str, str], Array] = {}

    def _end(self, lane: int, end: str) -> str:
        node, dot, rest = end.partition(".")
        return self.names.get((lane, node), self.names[0, node]) + dot + rest

    def put(self, lane: int, values: Values) -> None:
        """Set values of a lane; those of nodes that the lane shares with the base are left out.

        Raises
        ------
        InputError
            A value is out of range.
        """
        for name, given in values.items():
            node, _, parameter = name.partition(".")
            own = self.names.get((lane, node))
            if own is None or np.array_equal(given, self._last.get((own, parameter), ())):
                continue
            reference, size = self._references[own, parameter]
            for k, value in enumerate(np.broadcast_to(np.ravel(given), (size,)).tolist(), reference):
                self._executor.set(k, value)
            self._last[own, parameter] = np.array(given)

    def run(self, rows: Array, h: float) -> Array:
        """Run all lanes over the input rows (n, n_inputs) from a fresh start; shape (n, lanes).

        Raises
        ------
        InputError
            The core refuses the values.
        """
        return self._executor.run(rows, self.n, h)


def batches(graph: Graph, touched: Sequence[Collection[str]]) -> list[tuple[range, Lanes]]:
    """Return the lanes of `touched` in sets that the core takes, each with the places of its lanes after the base."""
    copies = max((len(_downstream(graph, names)) for names in touched), default=1)
    size = max(1, (MOST_NODES - len(graph.nodes)) // copies)
    parts = [range(k, min(k + size, len(touched))) for k in range(0, len(touched), size)] or [range(0)]
    return [(part, Lanes(graph, touched[part.start : part.stop])) for part in parts]


def _downstream(graph: Graph, names: Collection[str]) -> set[str]:
    """Return the nodes `names` and all that read them, directly or not."""
    found, new = set(names), set(names)
    while new:
        new = {b.partition(".")[0] for a, b in graph.wires if a.partition(".")[0] in new} - found
        found |= new
    return found

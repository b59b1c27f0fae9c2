"""Order of evaluation, and direct feed-through: dependencies of outputs and derivatives (FMI ModelStructure).

Between blocks, the wires and `feedthrough()` define the dependencies. Within a block with continuous states, the
equations define them. The equations are evaluated once per state with NaN as the value of this state; every value that
becomes NaN depends on this state. 0 times NaN is also a dependency, because a coefficient of 0 may be set to another
value. A block that only holds its output between samples has direct feed-through, because its output depends on the
input at a sample.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.graph.node import Node, Port

Link = tuple[int, int, int, int, int]
"""A wire: node, place, source or -1, place, size."""


def evaluation_order(nodes: Sequence[Node], links: Sequence[Link]) -> list[int]:
    """Order blocks so that each source precedes its readers. In a loop, blocks that read held values come first.

    An order that is already valid is kept. `links` are the wires as `Graph.links` holds them. Returns indices.

    Raises
    ------
    InputError
        The blocks form an algebraic loop; the message names these blocks.
    """
    through = [n.feeds_through() for n in nodes]
    # the input that a block tries its output for waits for no source
    edges = {(s, d) for d, place, s, _, _ in links if s >= 0 and place != nodes[d].block.trial - 1}
    edges |= {(s, i) for i, n in enumerate(nodes) if n.block.trial for s in _held(i, n.block.trial - 1, through, links)}
    order, left = _sorted(len(nodes), edges)
    if not left:
        return order
    edges = {(s, d) for s, d in edges if through[d]}
    order, left = _sorted(len(nodes), edges)
    if not left:
        # in a loop, a block without direct feed-through reads held values, so it goes before its sources are updated
        return sorted(order, key=lambda i: through[i])
    path = [left[0]]
    while path.count(path[-1]) < 2:
        path.append(next(s for s, d in sorted(edges) if d == path[-1] and s in left))
    loop = " <- ".join(nodes[i].name for i in path[path.index(path[-1]) :])
    raise InputError(
        f"The wires must not form an algebraic loop: {loop}. Insert a delay or a strictly proper transfer_function."
    )


def _held(i: int, model: int, through: Sequence[bool], links: Sequence[Link]) -> set[int]:
    """Return the blocks before an implicit inverse that its model, at its input `model`, reads.

    These blocks have no direct feed-through and precede the inverse, so that their outputs are constant during the
    search.
    """
    held: set[int] = set()
    seen = {i, -1}
    new = {s for d, place, s, _, _ in links if d == i and place == model} - seen
    while new:
        seen |= new
        first = {s for s in new if s < i and not through[s]}
        held |= first
        new = {s for d, _, s, _, _ in links if d in new - first} - seen
    return held


def _sorted(n: int, edges: set[tuple[int, int]]) -> tuple[list[int], list[int]]:
    """Sort topologically; return the sorted indices, and the indices that remain in cycles."""
    order: list[int] = []
    left = list(range(n))
    while left:
        free = [i for i in left if not any(s in left for s, d in edges if d == i)]
        if not free:
            break
        # take only the first free block each time, so that a valid order is kept
        order.append(free[0])
        left.remove(free[0])
    return order, left


@dataclass(frozen=True)
class Knowns:
    """A set of knowns: names of input ports, indices of continuous states, and whether time is a known."""

    inputs: frozenset[str] = frozenset()
    states: frozenset[int] = frozenset()
    time: bool = False

    def __or__(self, other: Knowns) -> Knowns:
        return Knowns(self.inputs | other.inputs, self.states | other.states, self.time or other.time)


def _pointer(a: Array) -> C._Pointer[C.c_double]:
    return a.ctypes.data_as(C.POINTER(C.c_double))


class _Equations:
    """Outputs and derivatives of one node, evaluated with NaN to find their dependencies."""

    def __init__(self, node: Node) -> None:
        sizes, kind = node.sizes, node.block

        def count(*kinds: str) -> int:
            return sum(sizes[v.name] for v in kind.of(*kinds))

        self.raw, self.n_c = kind.raw, count("cstate")
        self.dims, self.p = node.raw_arguments()
        self.x, self.u = np.zeros(count("cstate", "state")), np.zeros(count("input", "time"))
        self.y, self.dx = np.zeros(count("output")), np.zeros(self.n_c)

    def _nan(self, x: Array, u: Array) -> tuple[list[int], list[int]]:
        """Return the indices of the outputs and of the derivatives that become NaN."""
        given = [_pointer(self.p), _pointer(x), _pointer(u)]
        self.raw.output(self.dims, *given, _pointer(self.y))
        self.raw.deriv(self.dims, *given, _pointer(self.dx))
        return np.flatnonzero(np.isnan(self.y)).tolist(), np.flatnonzero(np.isnan(self.dx)).tolist()

    def of_state(self, k: int) -> tuple[list[int], list[int]]:
        """Return the outputs and derivatives that depend on the continuous state `k`."""
        x = self.x.copy()
        x[k] = np.nan
        return self._nan(x, self.u)

    def of_inputs(self) -> list[int]:
        """Return the derivatives that depend on any input."""
        return self._nan(self.x, np.full_like(self.u, np.nan))[1]


def dependencies(
    nodes: Sequence[Node], links: Sequence[Link], ports: Sequence[Port]
) -> tuple[dict[str, Knowns], list[Knowns]]:
    """Find the knowns of every output port and of the derivative of every continuous state.

    Returns the knowns by port name, for an array port the union over its elements; and the knowns of the derivatives,
    in the order of the continuous states of the graph.
    """
    names = [p.name for p in ports if p.kind == "input" for _ in range(p.size)]
    # per node, through its own states: one entry for all outputs, or one per output if the block has states
    reach = [[Knowns(time=bool(n.block.of("time")))] for n in nodes]
    derivatives: list[Knowns] = []
    reading: list[tuple[int, int]] = []  # derivatives that read the inputs of a node
    for i, n in enumerate(nodes):
        if not n.block.of("cstate"):
            continue
        equations, first = _Equations(n), len(derivatives)
        reach[i] = reach[i] * len(equations.y)
        derivatives += [Knowns()] * equations.n_c
        for k in range(equations.n_c):
            known = Knowns(states=frozenset({first + k}))
            at_outputs, at_derivatives = equations.of_state(k)
            for j in at_outputs:
                reach[i][j] |= known
            for j in at_derivatives:
                derivatives[first + j] |= known
        reading += [(first + j, i) for j in equations.of_inputs()]

    def of_outputs(node: int, place: int, size: int) -> list[Knowns]:
        return reach[node][place : place + size] if len(reach[node]) > 1 else reach[node]

    def inflow(i: int) -> Knowns:
        """Return the union of the knowns of all inputs of a node."""
        flow = Knowns()
        for d, _, s, place, size in links:
            if d != i:
                continue
            if s < 0:
                flow |= Knowns(frozenset(names[place : place + size]))
            else:
                for known in of_outputs(s, place, size):
                    flow |= known
        return flow

    through = [i for i, n in enumerate(nodes) if n.feeds_through()]
    changed = True
    while changed:
        changed = False
        for i in through:
            flow = inflow(i)
            new = [known | flow for known in reach[i]]
            changed, reach[i] = changed or new != reach[i], new
    for k, i in reading:
        derivatives[k] |= inflow(i)
    outputs: dict[str, Knowns] = {}
    for p in ports:
        if p.kind != "output":
            continue
        node = nodes[p.node]
        rows = node.block.of("output")
        place = p.place + sum(node.sizes[v.name] for v in rows[: rows.index(p.var)])
        outputs[p.name] = Knowns()
        for known in of_outputs(p.node, place, p.size):
            outputs[p.name] |= known
    return outputs, derivatives

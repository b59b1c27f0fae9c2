"""Order of evaluation of the blocks, and dependencies of outputs and derivatives (ModelStructure of FMI).

Between blocks, the dependencies follow from the wires and from the direct feed-through of the blocks. Within a block
with continuous states, they follow from the equations. The equations are evaluated once per state with NaN as the value
of this state. Every result that becomes NaN depends on this state. A product of 0 and NaN also counts as a dependency,
because the coefficient 0 may later be set to another value. A sampled block that holds its output between samples has
direct feed-through, because its output at a sample depends on the input at this sample.
"""

import ctypes as C
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hystfmu.base import Array, InputError
from hystfmu.graph.node import Node, Port

Link = tuple[int, int, int, int, int]
"""A wire: node and index of its input, source node (-1: the graph) and index of its output, number of elements."""


def evaluation_order(nodes: Sequence[Node], links: Sequence[Link]) -> list[int]:
    """Return an order of the blocks in which each block follows the blocks that it depends on.

    In a loop, a block without direct feed-through comes first, because it uses the values of the last step.

    If the order of `nodes` is already valid, it does not change. `links` are the wires in the form of `Graph.links`.
    The result contains the indices of the blocks.

    Raises
    ------
    InputError
        Blocks form an algebraic loop; the message names these blocks.
    """
    through = [n.feeds_through() for n in nodes]
    # the executor searches the value of the trial input, so the block need not follow the source of this input
    edges = {(s, d) for d, place, s, _, _ in links if s >= 0 and place != nodes[d].block.trial - 1}
    edges |= {(s, i) for i, n in enumerate(nodes) if n.block.trial for s in _held(i, n.block.trial - 1, through, links)}
    order, left = _sorted(len(nodes), edges)
    if not left:
        return order
    edges = {(s, d) for s, d in edges if through[d]}
    order, left = _sorted(len(nodes), edges)
    if not left:
        # in a loop, a block without direct feed-through uses values of the last step, so it precedes its sources
        return sorted(order, key=lambda i: through[i])
    path = [left[0]]
    while path.count(path[-1]) < 2:
        path.append(next(s for s, d in sorted(edges) if d == path[-1] and s in left))
    loop = " <- ".join(nodes[i].name for i in path[path.index(path[-1]) :])
    raise InputError(
        f"The wires must not form an algebraic loop: {loop}. Insert a delay or a strictly proper transfer_function."
    )


def _held(i: int, model: int, through: Sequence[bool], links: Sequence[Link]) -> set[int]:
    """Return the blocks whose outputs must stay constant while an implicit inverse searches its output.

    The model of the inverse is connected to its input `model`. The result contains the blocks without direct
    feed-through whose outputs this model uses. They must precede the inverse `i` in the order of evaluation.
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
    """Sort n nodes topologically; return the sorted indices, and the indices that remain because of cycles."""
    order: list[int] = []
    left = list(range(n))
    while left:
        free = [i for i in left if not any(s in left for s, d in edges if d == i)]
        if not free:
            break
        # each pass takes only the first possible block, so that a valid order does not change
        order.append(free[0])
        left.remove(free[0])
    return order, left


@dataclass(frozen=True)
class Knowns:
    """Known variables on which a result depends: input ports by name, continuous states by index, and time."""

    inputs: frozenset[str] = frozenset()
    states: frozenset[int] = frozenset()
    time: bool = False

    def __or__(self, other: "Knowns") -> "Knowns":
        return Knowns(self.inputs | other.inputs, self.states | other.states, self.time or other.time)


def _pointer(a: Array) -> "C._Pointer[C.c_double]":
    return a.ctypes.data_as(C.POINTER(C.c_double))


class _Equations:
    """Equations of one node, which are evaluated with NaN to find the dependencies of outputs and derivatives."""

    def __init__(self, node: Node) -> None:
        sizes, kind = node.sizes, node.block

        def count(*kinds: str) -> int:
            return sum(sizes[v.name] for v in kind.of(*kinds))

        self.raw, self.n_c = kind.raw, count("cstate")
        self.dims, self.p = node.raw_arguments()
        self.x, self.u = np.zeros(count("cstate", "state")), np.zeros(count("input", "time"))
        self.y, self.dx = np.zeros(count("output")), np.zeros(self.n_c)

    def _nan(self, x: Array, u: Array) -> tuple[list[int], list[int]]:
        """Return the indices of the outputs and of the derivatives that become NaN for states x and inputs u."""
        given = [_pointer(self.p), _pointer(x), _pointer(u)]
        self.raw.output(self.dims, *given, _pointer(self.y))
        self.raw.deriv(self.dims, *given, _pointer(self.dx))
        return np.flatnonzero(np.isnan(self.y)).tolist(), np.flatnonzero(np.isnan(self.dx)).tolist()

    def of_state(self, k: int) -> tuple[list[int], list[int]]:
        """Return the indices of the outputs and of the derivatives that depend on the continuous state `k`."""
        x = self.x.copy()
        x[k] = np.nan
        return self._nan(x, self.u)

    def of_inputs(self) -> list[int]:
        """Return the indices of the derivatives that depend on an input."""
        return self._nan(self.x, np.full_like(self.u, np.nan))[1]


def dependencies(
    nodes: Sequence[Node], links: Sequence[Link], ports: Sequence[Port]
) -> tuple[dict[str, Knowns], list[Knowns]]:
    """Return the known variables on which each output port and each derivative of a continuous state depends.

    Returns the known variables of each output port by port name, and those of each derivative in the order of the
    continuous states. For an array port, they are the union over its elements.
    """
    names = [p.name for p in ports if p.kind == "input" for _ in range(p.size)]
    # for each node, dependencies through its own states: one entry per output, or one for all outputs without states
    reach = [[Knowns(time=bool(n.block.of("time")))] for n in nodes]
    derivatives: list[Knowns] = []
    reading: list[tuple[int, int]] = []  # derivatives that depend on the inputs of a node
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
        """Return the union of the known variables of all inputs of node `i`."""
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

"""Controllers with a memory of one period (learning and repetitive control), separated from a graph and described by
filters.

A memory of n steps is a ring buffer; as a state space it would have n states. Its law is w_k = Q w_(k-n) + L e_(k-n)
with non-causal filters, so it enters a loop by its frequency response. From period to period the corrections are
multiplied by Q - L T, where T is the response from w to y with the rest of the loop closed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.frequency import Complex
from hystfmu.design.repetitive import taps_at
from hystfmu.graph import Graph, Input, Node, Output


@dataclass(frozen=True)
class PeriodMemory:
    """Law of a memory of one period, w = z^-n (Q w + L e).

    Attributes
    ----------
    n : int
        Steps in a period.
    q, l : array, shapes (2 n_q + 1,), (2 n_l + 1,)
        Taps of Q and L, from the oldest step to the same number of steps ahead.
    lifted : bool
        The memory changes at the end of a period only: within one there is no feedback through it.
    """

    n: int
    q: Array
    l: Array  # noqa: E741
    lifted: bool

    def factor(self, angles: Array, error: Complex) -> Complex:
        """Return Q + L E, the factor of the corrections from period to period.

        Parameters
        ----------
        angles : array, shape (m,)
            omega h.
        error : array, shape (m,)
            Response E = -T from w to e.
        """
        z = np.exp(1j * angles)
        return np.asarray(taps_at(self.q, z) + taps_at(self.l, z) * error)

    def response(self, angles: Array) -> Complex:
        """Return the response from e to w; 0 if the lifted form is used."""
        if self.lifted:
            return np.zeros(len(angles), complex)
        z = np.exp(1j * angles)
        late = z**-self.n
        return np.asarray(late * taps_at(self.l, z) / (1 - late * taps_at(self.q, z)))


def iterative_learning(node: Node) -> PeriodMemory:
    """Return the law of the block: w <- Q (w + gain e), e of `lead` steps later."""
    gain, lead, smooth = (float(node.value(name)[0]) for name in ("gain", "lead", "smooth"))
    n = node.dims["n"]
    q = np.array([smooth, 1 - 2 * smooth, smooth])
    ahead = round(lead) % n
    learnt = np.zeros(2 * (ahead + 1) + 1)
    learnt[2 * ahead : 2 * ahead + 3] = gain * q
    return PeriodMemory(n, q, learnt, lifted=True)


def repetitive(node: Node) -> PeriodMemory:
    """Return the law of the block."""
    q = node.value("q")
    return PeriodMemory(node.dims["n"], np.concatenate([q[:0:-1], q]), node.value("l"), lifted=False)


LAWS: dict[str, tuple[Callable[[Node], PeriodMemory], str, str]] = {
    "iterative_learning": (iterative_learning, "u_ff", "u"),
    "repetitive": (repetitive, "y_d", "r"),
}
"""Block: its law, the input to which it adds its corrections, and the output with them."""


def cut_memories(graph: Graph) -> tuple[Graph, tuple[PeriodMemory, ...]]:
    """Cut the memories of a period out of a graph, which keeps the order of its blocks.

    Returns
    -------
    graph : Graph
        Its last inputs are the corrections w, its last outputs the errors e = y_d - y of the memories.
    memories : tuple of PeriodMemory
    """
    found = [n for n in graph.nodes if n.type in LAWS]
    if not found:
        return graph, ()
    blocks: list[Node] = []
    to: dict[str, list[str]] = {}
    source: dict[str, str] = {}
    for n in graph.nodes:
        if n.type not in LAWS:
            blocks.append(n)
            continue
        _, base, corrected = LAWS[n.type]
        added, error = f"{n.name}_added", f"{n.name}_error"
        blocks.append(Node(added, "sum", {"n": 2}, {"k": [1.0, 1.0]}))
        blocks.append(Node(error, "sum", {"n": 2}, {"k": [1.0, -1.0]}))
        to |= {f"{n.name}.{v.name}": [] for v in n.block.of("input")}
        to[f"{n.name}.{base}"].append(f"{added}.u[1]")
        to[f"{n.name}.y_d"].append(f"{error}.u[1]")
        to[f"{n.name}.y"].append(f"{error}.u[2]")
        source[f"{n.name}.{corrected}"] = f"{added}.y"
    wires = [(source.get(a, a), end) for a, b in graph.wires for end in to.get(b, [b])]
    inputs = [Input(i.name, tuple(e for end in i.to for e in to.get(end, [end]))) for i in graph.inputs]
    outputs = [Output(o.name, source.get(o.source, o.source)) for o in graph.outputs]
    inputs = [i for i in inputs if i.to] + [Input(f"{n.name}_w", (f"{n.name}_added.u[2]",)) for n in found]
    outputs = outputs + [Output(f"{n.name}_e", f"{n.name}_error.y") for n in found]
    if any(o.source.partition(".")[0] in {n.name for n in found} for o in outputs):
        raise InputError("The output of a memory of a period must be its corrected signal. Got another one.")
    laws = tuple(LAWS[n.type][0](n) for n in found)
    return Graph(blocks, wires, inputs, outputs, sort=False), laws

"""The repetitive part of a loop, whose memory has a state for each step of the period, by its frequency response."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.design.repetitive import taps_at, zero_phase_at
from hystfmu.graph import Graph, Input, Node, Output

BLOCK = "repetitive"
CORRECTION, ERROR = "w", "e"  # input and output of an opened graph
PER_HARMONIC = 16  # frequencies between two harmonics of the period


@dataclass(frozen=True)
class Periodic:
    """Correction w = R(z) e, R = z^-n F / (1 - z^-n Q), with F the learning filter.

    Attributes
    ----------
    n : int
        Steps in a period.
    q, l : array, shapes (n_q + 1,), (2 n_l + 1,)
        Taps as the block takes them.
    """

    n: int
    q: Array
    l: Array  # noqa: E741 - the letter of the block

    def correction(self, z: Any) -> Any:
        """Return R(z)."""
        late = z**-self.n
        return late * taps_at(self.l, z) / (1 - late * zero_phase_at(self.q, z))

    def closed(self, K: Any, z: Any) -> Any:
        """Return the first response of an opened graph, shape (m, 2, 2), with the part connected."""
        R = self.correction(z)
        return K[:, 0, 0] + K[:, 0, 1] * R * K[:, 1, 0] / (1 - K[:, 1, 1] * R)

    def left(self, z: Any, H: Any) -> Any:
        """Return Q + F H, with e = H w around the part: from one period to the next, this is left of an error."""
        return zero_phase_at(self.q, z) + taps_at(self.l, z) * H

    def frequencies(self, h: float) -> Array:
        """Return frequencies (rad/s) up to half the sampling frequency that resolve the harmonics beside them."""
        count = PER_HARMONIC * self.n // 2
        return np.asarray((np.arange(count) + 0.5) / count * np.pi / h)


def opened(graph: Graph) -> tuple[Graph, Periodic | None]:
    """Open a graph at its repetitive block, if it has one: input `w` brings its correction, output `e` its error.

    Raises
    ------
    InputError
        More than one such block.
    """
    found = [n for n in graph.nodes if n.type == BLOCK]
    if not found:
        return graph, None
    if len(found) > 1:
        raise InputError(f"A loop must have at most one {BLOCK} block to have margins. Got {len(found)}.")
    (node,) = found
    error = Node(f"{node.name}_error", "sum", {"n": 2}, {"k": [1.0, -1.0]})
    to = {
        f"{node.name}.y_d": (f"{node.name}.u[1]", f"{error.name}.u[1]"),
        f"{node.name}.y": (f"{error.name}.u[2]",),
        f"{node.name}.active": (),
    }
    nodes = [m for n in graph.nodes for m in ((error, Node(n.name, "sum", {"n": 2})) if n is node else (n,))]
    wires = [(f"{node.name}.y" if a == f"{node.name}.r" else a, end) for a, b in graph.wires for end in to.get(b, (b,))]
    inputs = [replace(i, to=tuple(e for end in i.to for e in to.get(end, (end,)))) for i in graph.inputs]
    inputs = [*(i for i in inputs if i.to), Input(CORRECTION, (f"{node.name}.u[2]",))]
    outputs = [replace(o, source=f"{node.name}.y") if o.source == f"{node.name}.r" else o for o in graph.outputs]
    outputs.append(Output(ERROR, f"{error.name}.y"))
    part = Periodic(node.dims["n"], node.value("q"), node.value("l"))
    return Graph(nodes, wires, inputs, outputs, sort=False, step=graph.step), part

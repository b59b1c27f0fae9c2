"""A play in front of a model that hides the reversals which noise makes; `hystfmu.data.reversals` measures the noise.

A model without return-point memory (Bouc-Wen, Duhem) adds up every reversal that noise makes: 0.25 % noise of the input
range costs 2.2 % of the output.  A play of half-width 2 sigma before it, in the model itself so that an FMU has it too,
leaves 0.5 %; wider ones cost more in lag than they save.  Operators with return-point memory wipe such reversals out
the moment the input moves on, and are no better with a dead band: they have none.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Input, Node
from hystfmu.identify.features.plays import plays
from hystfmu.identify.options import Option

MOST = 0.05  # of the range: more is the excitation itself
WIDTH = 2.0  # half-width of the play in sigma
OPTION = Option(
    "dead_band",
    None,
    0.0,
    1e300,
    text="half-width of a play before the model, in units of u; default: 2 sigma of noise",
)


def half_width(u: Array) -> float:
    """The dead band for a measured input u (n,), in its unit; 0 without noise, or where the input itself is random."""
    sigma = noise(u)
    return WIDTH * sigma if sigma < MOST * float(np.ptp(u)) else 0.0


def behind(data: Dataset, band: float) -> Dataset:
    """What a model behind a play of that half-width sees as its input."""
    return data if band == 0 else replace(data, u=plays(data.u, np.array([band]), float(data.u[0]))[:, 0])


def in_front(graph: Graph, band: float) -> Graph:
    """The model's graph with a play of that half-width before its input; none for 0."""
    if band == 0:
        return graph
    (port,) = graph.inputs
    node = Node("dead_band", "play_bank", {"n": 1}, {"r": band, "z0": port.start})
    wires = [*((f"{node.name}.z", end) for end in port.to), *graph.wires]
    entry = Input(port.name, (f"{node.name}.u",), port.unit, port.start, port.text)
    return Graph([node, *graph.nodes], wires, [entry], graph.outputs)

"""Reversals under noise: how much noise a measured signal holds, and a play in front of the model that hides it.

Difference-based estimate (Gasser, Sroka & Jennen-Steinmetz, Biometrika 73 (1986) 625-633; Hall, Kay & Titterington,
Biometrika 77 (1990) 521-528): a k-th difference shrinks a smooth path by its step to the power k and lets white noise
grow to sigma sqrt(C(2k, k)).  White noise shows itself in that its k-th differences change sign in a share
arccos(-k / (k + 1)) / pi of the rows; the first order that comes near it gives sigma from the median, which is blind to
kinks.  Trap: without the sign test, a coarsely sampled sine counts as noise.

A model without return-point memory (Bouc-Wen, Duhem) adds up every reversal that noise makes: 0.25 % noise of the input
range costs 2.2 % of the output.  A play of half-width 2 sigma before it, in the model itself so that an FMU has it too,
leaves 0.5 %; wider ones cost more in lag than they save.  Operators with return-point memory wipe such reversals out
the moment the input moves on, and are no better with a dead band: they have none.
"""

from __future__ import annotations

from dataclasses import replace
from math import acos, comb, pi

import numpy as np

from hystfmu.core import Array
from hystfmu.data import Dataset
from hystfmu.graph import Graph, Input, Node
from hystfmu.identify.options import Option
from hystfmu.identify.plays import plays

ORDERS = range(2, 9)
NEAR = 0.9  # share of the sign changes of white noise
LEAST, MOST = 1e-9, 0.05  # of the range: less is rounding, more is the excitation itself
WIDTH = 2.0  # half-width of the play in sigma
OPTION = Option(
    "dead_band",
    None,
    0.0,
    1e300,
    text="half-width of a play before the model, in units of u; default: 2 sigma of noise",
)


def noise(v: Array) -> float:
    """RMS sigma of white noise in a sampled path.

    Parameters
    ----------
    v : array, shape (n,)
        Evenly sampled.

    Returns
    -------
    float
        In the unit of v; 0 where none is seen: a smooth path, or one that is held for most rows.
    """
    width = float(np.ptp(v)) if len(v) else 0.0
    for k in ORDERS:
        d = np.diff(v, k)
        if len(d) < 10:
            break
        if np.mean(d[1:] * d[:-1] < 0) >= NEAR * acos(-k / (k + 1)) / pi:
            sigma = float(np.median(np.abs(d))) / 0.6745 / comb(2 * k, k) ** 0.5
            return sigma if sigma > LEAST * width else 0.0
    return 0.0


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

"""Play operators as columns of a regression, run by the C core; options that operators share; a dead band.

A dead band is a play before a model; it suppresses the reversals of input noise. A model without return-point memory
(Bouc-Wen, Duhem) accumulates every reversal of the noise. Noise of 0.25 % of the input range causes an error of 2.2 %
of the output. A play of half-width 2 sigma reduces this error to 0.5 %. With a wider play the lag of the play causes a
larger error. The play is part of the model, so an exported FMU contains the play. Operators with return-point memory
wipe out the reversals of noise when the input moves on, so they need no dead band. `hystfmu.data.reversals` estimates
the noise.
"""

from __future__ import annotations

import numpy as np

from hystfmu.base.arrays import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Input, Node
from hystfmu.identify.catalogue import Option, Options

LEAST_TRAVEL = 0.02
RANGE = Option("range", None, 1e-6, 1e6, text="range to which the input is scaled before the operator; default: chosen")
MOST = 0.05  # of the range: a larger sigma is the excitation itself
WIDTH = 2.0  # half-width of the play, in sigma
DEAD_BAND_TEXT = "half-width of a play before the model, in the unit of measure of u; default: 2 sigma of noise"
DEAD_BAND = Option("dead_band", None, 0.0, 1e300, text=DEAD_BAND_TEXT)


def thresholds(u: Array, n: int) -> Array:
    """Return half-widths, shape (n,), in equal steps from 0 (excluded) to 98 % of half the range of u.

    A play wider than half the range never moves back: its column is constant after the first loading. Shen & Ma 2017
    spread the half-widths over the whole range, so half of their columns are constant. A play that moves less than 2 %
    of the range is hardly excited: its weight would fit the noise at the peaks and cause errors for every larger input.
    """
    return np.asarray((1 - LEAST_TRAVEL) * np.ptp(u) / 2 * np.arange(1, n + 1) / n)


def plays(u: Array, r: Array, u0: float) -> Array:
    """Run plays of half-widths `r` (n,) from rest at `u0` over the rows of `u`; shape (rows, n)."""
    bank = Graph.single(Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": u0}))
    return bank.run(u).reshape(len(u), len(r))


def u0_option(what: str) -> Option:
    """Return the option for the initial memory; `what` describes the state, e.g. "every play rests"."""
    return Option("u0", None, -1e300, 1e300, text=f"initial memory: {what} at this input; default the first input")


def branch_option(of: str = "") -> Option:
    """Return the option for the memory of an operator with a branch function; `of` is its name."""
    what = f"a branch of {of}" if of else "a branch"
    return Option(
        "memory",
        "dominant",
        choices=("dominant", "last"),
        text=f"extremum at which {what} starts; last: as printed in the paper",
    )


def u0_of(data: Dataset, options: Options) -> float:
    """Return the value of the option, in the unit of measure of u."""
    return float(data.u[0]) if options["u0"] is None else float(options["u0"])


def dead_band(u: Array) -> float:
    """Return the dead band for a measured input u (n,): 0 if it has no noise, or if the input is random."""
    sigma = noise(u)
    return WIDTH * sigma if sigma < MOST * float(np.ptp(u)) else 0.0


def behind_dead_band(data: Dataset, band: float) -> Dataset:
    """Return the data with the input after a play of this half-width."""
    if band == 0:
        return data
    r, u0 = np.array([band]), float(data.u[0])
    return data.with_input(data.along(lambda u: plays(u, r, u0)[:, 0]))


def with_dead_band(graph: Graph, band: float) -> Graph:
    """Return the graph with a play of this half-width before its first input; unchanged if the half-width is 0."""
    if band == 0:
        return graph
    port, *others = graph.inputs
    node = Node("dead_band", "play_bank", {"n": 1}, {"r": band, "z0": port.start})
    wires = [*((f"{node.name}.z", end) for end in port.to), *graph.wires]
    entry = Input(port.name, (f"{node.name}.u",), port.unit, port.start, port.text)
    return Graph([node, *graph.nodes], wires, [entry, *others], graph.outputs)

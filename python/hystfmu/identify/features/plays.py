"""Play operators as regressors, options that several kinds have in common, and the dead band for noisy inputs.

A dead band is a play before a model, which suppresses reversals that are only noise of the input. In a model without
return-point memory (Bouc-Wen, Duhem), the effect of each noise reversal remains. For example, noise of 0.25 % of the
input range causes an error of 2.2 % of the output. A play with a half-width of twice the standard deviation sigma of
the noise reduces this error to 0.5 %. A wider play causes a larger error, because it delays the input. The play is part
of the model and of an exported FMU. An operator with return-point memory needs no dead band, because the next larger
loop wipes out noise reversals. The function `hystfmu.data.reversals.noise` estimates sigma.
"""

import numpy as np

from hystfmu.base import Array
from hystfmu.data import Dataset
from hystfmu.data.reversals import noise
from hystfmu.graph import Graph, Input, Node
from hystfmu.identify.catalogue import Option, Options

LEAST_TRAVEL = 0.02
RANGE = Option("range", None, 1e-6, 1e6, text="range to which the input is scaled before the operator; default: chosen")
MOST = 0.05  # sigma relative to the range above which the input counts as random excitation and not as noisy
WIDTH = 2.0  # half-width of the play, relative to sigma
DEAD_BAND_TEXT = "half-width of a play before the model, in the unit of measure of u; default: 2 sigma of noise"
DEAD_BAND = Option("dead_band", None, 0.0, 1e300, text=DEAD_BAND_TEXT)


def thresholds(u: Array, n: int) -> Array:
    """Return n equally spaced half-widths of plays, from 98 % of half the range of u down to 1/n of this value.

    The output of a play whose half-width exceeds half of the range is constant after the first full swing. Shen & Ma
    2017 distribute the half-widths over the whole range, so half of their plays have a constant output. A play that
    moves by less than 2 % of the range has little excitation: its weight would depend on the noise at the extrema and
    would cause errors for larger inputs.
    """
    return np.asarray((1 - LEAST_TRAVEL) * np.ptp(u) / 2 * np.arange(1, n + 1) / n)


def plays(u: Array, r: Array, u0: float | Array) -> Array:
    """Return the outputs (rows, n) of plays with half-widths r (n,) for the input u (rows,), from rest at `u0`.

    `u0` is an input, or the initial output of each play (n,).
    """
    bank = Graph.single(Node("bank", "play_bank", {"n": len(r)}, {"r": r, "z0": u0}))
    return bank.run(u).reshape(len(u), len(r))


def with_plays(u: Array, r: Array, u0: float) -> Array:
    """Return the input u (rows,) and the outputs of `plays`, shape (rows, n + 1): the columns of a sum of plays."""
    return np.column_stack([u, plays(u, r, u0)])


def u0_option(what: str) -> Option:
    """Return the option ``u0`` for the initial memory; `what` describes the state, for example "every play rests"."""
    return Option("u0", None, -1e300, 1e300, text=f"initial memory: {what} at this input; default the first input")


def branch_option(of: str = "") -> Option:
    """Return the option ``memory`` of an operator with a branch function; `of` is the name of the operator."""
    what = f"a branch of {of}" if of else "a branch"
    return Option(
        "memory",
        "dominant",
        choices=("dominant", "last"),
        text=f"extremum at which {what} starts; last: as printed in the paper",
    )


def u0_of(data: Dataset, options: Options) -> float:
    """Return the value of the option ``u0`` in the unit of measure of u; the default is the first input."""
    return float(data.u[0]) if options["u0"] is None else float(options["u0"])


def dead_band(u: Array) -> float:
    """Return the half-width of the dead band for an input u (n,); it is 0 if u has no noise or is a random signal."""
    sigma = noise(u)
    return WIDTH * sigma if sigma < MOST * float(np.ptp(u)) else 0.0


def behind_dead_band(data: Dataset, band: float) -> Dataset:
    """Return the data with the input filtered by a play of half-width `band`."""
    if band == 0:
        return data
    r, u0 = np.array([band]), float(data.u[0])
    return data.with_input(data.along(lambda u: plays(u, r, u0)[:, 0]))


def with_dead_band(graph: Graph, band: float) -> Graph:
    """Return the graph with a play of half-width `band` before its first input; for `band` = 0, return it unchanged."""
    if band == 0:
        return graph
    port, *others = graph.inputs
    node = Node("dead_band", "play_bank", {"n": 1}, {"r": band, "z0": port.start})
    wires = [*((f"{node.name}.z", end) for end in port.to), *graph.wires]
    entry = Input(port.name, (f"{node.name}.u",), port.unit, port.start, port.text)
    return Graph([node, *graph.nodes], wires, [entry, *others], graph.outputs)

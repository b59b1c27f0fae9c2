"""Sector of local slopes: the remaining hysteresis of a plant behind an imperfect inverse.

In a loop around an inverse and its plant, the loop gain contains the local slope of inverse and plant. This slope
depends on the path. The loop must be stable for every slope of the sector.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hystfmu.base.arrays import Array
from hystfmu.base.errors import InputError
from hystfmu.core.library import block_types
from hystfmu.design.linear import linearise
from hystfmu.graph import Graph, Node
from hystfmu.model import Model

MOVED = 1e-3  # of the largest step of the path: smaller ones say nothing about a slope
COMPARED = 20_000  # rows at most at which a path with creep is compared with one that stands
CONTINUOUS = "continuous"  # rate of the blocks that count with their static gain


def sector(path: Array, *chain: Graph | Model, h: float) -> tuple[float, float]:
    """Return the smallest and the largest local slope of units in series along a path.

    Parameters
    ----------
    path : array, shape (n,)
        Input of the first unit, one value per step.
    *chain : Graph or Model
        Units in series, for example the inverse and the plant. The path drives the first input of each unit; its other
        inputs keep their start values. The first output of each unit is used. Linear dynamics are replaced by their
        static gain.
    h : float
        Step (s).

    Returns
    -------
    least, largest : float
        Slopes of the last output with respect to the path.

    Raises
    ------
    InputError
        The path does not move.
    """
    graphs = [without_dynamics(unit.graph if isinstance(unit, Model) else unit) for unit in chain]
    return slopes_along(path, *graphs, h=h)


def slopes_along(path: Array, *chain: Graph, h: float) -> tuple[float, float]:
    """Return the sector of units in series, see `sector`. The units may contain creep and its inverse.

    For each slope, the output after a step of the path is compared with the output without this step. Trap: creep
    continues while the path does not move. Therefore differences of the output over time are not slopes; for an inverse
    at its limit, such differences gave -1.3.
    """
    v = np.asarray(path, float)
    dv = np.diff(v)
    largest = np.abs(dv).max(initial=0.0)
    if not largest > 0:
        raise InputError("The path must move to have slopes. Got a constant one.")
    moved = np.flatnonzero(np.abs(dv) > MOVED * largest) + 1
    if any(_drifts(n) for graph in chain for n in graph.nodes):
        moved = moved[:: -(-len(moved) // COMPARED)]
        dy = _against_rest(v, moved, chain, h)
    else:
        y = v
        for graph in chain:
            sizes = [p.size for p in graph.ports if p.kind == "input"]
            rows = np.tile(np.repeat([i.start for i in graph.inputs], sizes), (len(y), 1))
            rows[:, 0] = y
            y = graph.executor().run(rows, graph.n_outputs, h)[:, 0]
        dy = y[moved] - y[moved - 1]
    found = dy / dv[moved - 1]
    return float(found.min()), float(found.max())


def _drifts(node: Node) -> bool:
    """Return whether the output of a block moves while its input is constant."""
    undone = node.block.inverts
    return node.block.rate == CONTINUOUS or bool(undone and block_types()[undone].rate == CONTINUOUS)


def _against_rest(v: Array, moved: NDArray[np.intp], chain: Sequence[Graph], h: float) -> Array:
    """Return the change of the last output at these rows because of the last step of the path.

    The reference is the output for a path that is constant since the previous row.
    """
    units = [graph.executor() for graph in chain]
    ends = [[next(p.reference for p in g.ports if p.kind == kind) for kind in ("input", "output")] for g in chain]

    def through(x: float, k: int) -> float:
        for unit, (into, out) in zip(units, ends, strict=True):
            unit.set(into, x)
            if k:
                unit.step(k * h, h)
            else:
                unit.start(0.0)
            x = unit.get(out)
        return x

    asked, found = set(moved.tolist()), []
    through(float(v[0]), 0)
    for k in range(1, len(v)):
        if k not in asked:
            through(float(v[k]), k)
            continue
        before = [unit.state for unit in units]
        rest = through(float(v[k - 1]), k)
        for unit, state in zip(units, before, strict=True):
            unit.state = state
        found.append(through(float(v[k]), k) - rest)
    return np.array(found)


def without_dynamics(graph: Graph) -> Graph:
    """Replace the linear dynamics of a graph by their static gains."""
    for n in graph.nodes:
        if n.block.rate == CONTINUOUS:
            graph = graph.replace(Node(n.name, "scaling", {"n": 1}, {"gain": gain_of(n)}))
    return graph


def gain_of(node: Node) -> float:
    """Return the gain that replaces a linear block: its static gain, or 1 if the static gain is 0 or infinite.

    An integrator has no static gain. Its gain is a part of the dynamics.
    """
    gain = static_gain(node)
    return gain if np.isfinite(gain) and gain != 0 else 1.0


def static_gain(node: Node) -> float:
    """Return the static gain D - C A^-1 B of a linear block; infinite for an integrator."""
    A, B, C, D = linearise(Graph.single(node))
    if not len(A):
        return float(D[0, 0])
    try:
        return float((D - C @ np.linalg.solve(A, B))[0, 0])
    except np.linalg.LinAlgError:
        return np.inf
